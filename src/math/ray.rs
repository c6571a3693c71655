use glam::Vec3;

use super::Aabb;

/// A ray from `origin` along `direction`, with parameter `t` in units of `direction`'s length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, world space.
    pub origin: Vec3,
    /// Direction, any length but zero.
    pub direction: Vec3,
    /// Component-wise reciprocal of the direction, kept for the slab test.
    inverse: Vec3,
}

impl Ray {
    /// A ray from its start and direction.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, inverse: direction.recip() }
    }

    /// The slab test: the `t` at which the ray enters the box (0 if it starts inside), if that is at most `t_max`.
    pub fn enter_box(&self, bounds: &Aabb, t_max: f32) -> Option<f32> {
        let mut near = 0.0f32;
        let mut far = t_max;
        for axis in 0..3 {
            let a = (bounds.min[axis] - self.origin[axis]) * self.inverse[axis];
            let b = (bounds.max[axis] - self.origin[axis]) * self.inverse[axis];
            // 0 * inf is NaN where the origin lies on a slab parallel to the ray; `f32::min/max` then keep the
            // other number, so the slab does not exclude it: a query may report too much, never too little.
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        // Rounding can move both ends by a few units in the last place.
        (near <= far * (1.0 + 4.0 * f32::EPSILON)).then_some(near)
    }

    /// Where the ray meets a triangle, from either side; `None` for a miss or a degenerate triangle. A ray through an
    /// edge that two triangles share meets at least one of them (Sven Woop, Carsten Benthin, Ingo Wald, "Watertight
    /// Ray/Triangle Intersection", 2013).
    pub fn meet_triangle(&self, corners: [Vec3; 3]) -> Option<f32> {
        let along = self.direction.abs().max_position();
        let (x, y) = ((along + 1) % 3, (along + 2) % 3);
        let inverse = self.direction[along].recip();
        let (shear_x, shear_y) = (self.direction[x] * inverse, self.direction[y] * inverse);
        // The ray becomes the third axis: what is left is whether the origin lies in a flat triangle.
        let [a, b, c] = corners.map(|corner| {
            let p = corner - self.origin;
            (p[x] - shear_x * p[along], p[y] - shear_y * p[along], p[along] * inverse)
        });
        // Of a shared edge both triangles compute the same number but for its sign; glam and rustc fuse nothing.
        let side = |from: (f32, f32, f32), to: (f32, f32, f32)| to.0 * from.1 - to.1 * from.0;
        let (u, v, w) = (side(b, c), side(c, a), side(a, b));
        let is_between = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let area = u + v + w;
        if !is_between || area == 0.0 || !area.is_finite() {
            return None;
        }
        let t = (u * a.2 + v * b.2 + w * c.2) / area;
        (t >= 0.0).then_some(t)
    }
}
