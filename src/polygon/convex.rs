use glam::Vec3;

use crate::math::{Aabb, QUAD_FLATNESS, Ray};

/// A quad whose fourth corner leaves the plane of the others by less than this fraction of its longest edge is
/// flat. Larger: fewer polygons, but occluders are pushed further back to stay conservative.
pub const FLATNESS: f32 = QUAD_FLATNESS;

/// A convex, planar polygon with 3 or 4 corners, two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvexPolygon {
    /// A triangle repeats its last corner.
    corners: [Vec3; 4],
    count: u8,
}

impl ConvexPolygon {
    /// A triangle.
    pub fn triangle(a: Vec3, b: Vec3, c: Vec3) -> Self {
        Self { corners: [a, b, c, c], count: 3 }
    }

    /// A quad that must be flat ([`FLATNESS`]) and convex; this is not checked.
    /// `osp_session::stroke::split_into_convex` divides any outline into such quads.
    pub fn quad(corners: [Vec3; 4]) -> Self {
        Self { corners, count: 4 }
    }

    /// The corners in order.
    pub fn vertices(&self) -> &[Vec3] {
        &self.corners[..self.count as usize]
    }

    /// Distance at which a ray meets the polygon, from either side; see [`Ray::meet_triangle`].
    pub fn meet(&self, ray: &Ray) -> Option<f32> {
        match *self.vertices() {
            [a, b, c] => ray.meet_triangle([a, b, c]),
            [a, b, c, d] => ray.meet_triangle([a, b, c]).or_else(|| ray.meet_triangle([a, c, d])),
            _ => None,
        }
    }

    /// The tight box.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(&self.corners)
    }

    /// Twice the area times the normal; zero for a degenerate polygon.
    pub fn area_vector(&self) -> Vec3 {
        let [a, b, c, d] = self.corners;
        // For a triangle d == c, and the diagonals' product is still the triangle's.
        if self.count == 4 { (c - a).cross(d - b) } else { (b - a).cross(c - a) }
    }

    /// Area, square metres.
    pub fn area_m2(&self) -> f32 {
        self.area_vector().length() * 0.5
    }

    /// Each corner mapped by `f`.
    #[must_use]
    pub fn map(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        Self { corners: self.corners.map(f), count: self.count }
    }
}
