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

    /// Where the ray meets a triangle, from either side (Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle
    /// Intersection", 1997); `None` for a miss or a degenerate triangle.
    pub fn meet_triangle(&self, [a, b, c]: [Vec3; 3]) -> Option<f32> {
        let (ab, ac) = (b - a, c - a);
        let p = self.direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 || !determinant.is_finite() {
            return None;
        }
        let to_origin = self.origin - a;
        let u = to_origin.dot(p) / determinant;
        let q = to_origin.cross(ab);
        let v = self.direction.dot(q) / determinant;
        let t = ac.dot(q) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
    }
}
