use glam::Vec3;

use super::Aabb;

/// A ray from `origin` along `direction`. Its parameter `t` is a multiple of `direction`'s length.
///
/// A ray that is not finite, or has no direction, meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, world space.
    pub origin: Vec3,
    /// Direction, any length.
    pub direction: Vec3,
    /// Component-wise reciprocal of the direction, for the slab test. A component is infinite if it would be zero or
    /// subnormal. No product with it is then finite. All are NaN if the ray meets nothing.
    inverse: Vec3,
}

impl Ray {
    /// A ray from its start and direction: arrays, or vectors of any version of glam.
    pub fn new(origin: impl Into<[f32; 3]>, direction: impl Into<[f32; 3]>) -> Self {
        let (origin, direction) = (Vec3::from(origin.into()), Vec3::from(direction.into()));
        let is_valid = origin.is_finite() && direction.is_finite() && direction != Vec3::ZERO;
        let over = |length: f32| if length.recip().is_normal() { length.recip() } else { f32::INFINITY };
        Self { origin, direction, inverse: if is_valid { direction.map(over) } else { Vec3::NAN } }
    }

    /// Whether the ray is finite and has a direction.
    #[inline]
    pub(crate) fn is_valid(&self) -> bool {
        !self.inverse.x.is_nan()
    }

    /// Component-wise reciprocal of the direction; infinite if it would be zero or subnormal, NaN if the ray is not valid.
    #[inline]
    pub(crate) fn inverse(&self) -> Vec3 {
        self.inverse
    }

    /// The slab test: the `t` at which the ray enters the box (0 if the ray starts inside), if it is at most `t_max`.
    /// Faces, edges and corners belong to the box, and the box may be flat. The ray enters no box inside this box at a
    /// smaller `t`.
    pub fn enter_box(&self, bounds: &Aabb, t_max: f32) -> Option<f32> {
        let mut near = 0.0f32;
        let mut far = t_max;
        for axis in 0..3 {
            let (min, max, origin) = (bounds.min[axis], bounds.max[axis], self.origin[axis]);
            let a = (min - origin) * self.inverse[axis];
            let b = (max - origin) * self.inverse[axis];
            let (enter, leave) = if a.is_finite() && b.is_finite() {
                (a.min(b), a.max(b))
            } else if self.is_valid() {
                cross_slab(min, max, origin, self.direction[axis])?
            } else {
                return None;
            };
            near = near.max(enter);
            far = far.min(leave);
        }
        is_no_later(near, far).then_some(near)
    }

    /// The `t` at which the ray meets a triangle, from either side; `None` for a miss or a degenerate triangle. A ray
    /// through an edge that two triangles share meets at least one of them (Sven Woop, Carsten Benthin, Ingo Wald,
    /// "Watertight Ray/Triangle Intersection", 2013).
    pub fn meet_triangle(&self, corners: [Vec3; 3]) -> Option<f32> {
        if !self.is_valid() {
            return None;
        }
        let along = self.direction.abs().max_position();
        let (x, y) = ((along + 1) % 3, (along + 2) % 3);
        let over_length = |v: f32| {
            let inverse = self.inverse[along];
            if inverse.is_finite() { v * inverse } else { v / self.direction[along] }
        };
        let (shear_x, shear_y) = (over_length(self.direction[x]), over_length(self.direction[y]));
        // A shear turns the ray into the third axis. The test is then whether the origin lies in a triangle of the
        // plane.
        let [a, b, c] = corners.map(|corner| {
            let p = corner - self.origin;
            (p[x] - shear_x * p[along], p[y] - shear_y * p[along], over_length(p[along]))
        });
        // For a shared edge both triangles compute the same number except for its sign, because glam and rustc fuse no
        // operations.
        let side = |from: (f32, f32, f32), to: (f32, f32, f32)| to.0 * from.1 - to.1 * from.0;
        let (u, v, w) = (side(b, c), side(c, a), side(a, b));
        let is_between = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let area = u + v + w;
        if !is_between || area == 0.0 || !area.is_finite() {
            return None;
        }
        let t = (u * a.2 + v * b.2 + w * c.2) / area;
        (0.0..f32::INFINITY).contains(&t).then_some(t)
    }
}

/// Whether `near` is at most `far`, within rounding: four units in the last place, and the smallest normal number.
pub(crate) fn is_no_later(near: f32, far: f32) -> bool {
    near <= latest(far)
}

/// The largest `near` that [`is_no_later`] accepts.
#[inline(always)]
pub(crate) fn latest(far: f32) -> f32 {
    far * (1.0 + 4.0 * f32::EPSILON) + f32::MIN_POSITIVE
}

/// The `t` at which a ray enters and leaves the space between two planes perpendicular to an axis; `None` if the ray passes
/// outside. This covers the cases in which `f32` fails: a direction of zero, a direction without a finite reciprocal,
/// differences or products that overflow.
///
/// A box may need this path because of a large coordinate while a smaller box inside it does not. The interval is therefore
/// wider than the rounding error of the smaller box.
#[cold]
fn cross_slab(min: f32, max: f32, origin: f32, direction: f32) -> Option<(f32, f32)> {
    const WIDER: f64 = 8.0 * f32::EPSILON as f64;
    if direction == 0.0 {
        let is_between = !(origin < min || origin > max);
        return is_between.then_some((f32::NEG_INFINITY, f32::INFINITY));
    }
    let cross = |plane: f32| (f64::from(plane) - f64::from(origin)) / f64::from(direction);
    let (a, b) = (cross(min), cross(max));
    let (enter, leave) = (a.min(b), a.max(b));
    // Intervals behind the origin have no effect.
    Some(((enter * (1.0 - WIDER)) as f32, (leave * (1.0 + WIDER)) as f32))
}
