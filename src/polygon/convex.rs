use glam::Vec3;

use crate::math::{Aabb, QUAD_FLATNESS, Ray};

/// A quad counts as flat if its fourth corner leaves the plane of the other three by less than this fraction of the longest
/// edge. If it is larger, models have fewer polygons, but occluders are pushed further back to stay conservative.
pub const FLATNESS: f32 = QUAD_FLATNESS;

/// A convex, planar polygon with 3 or 4 corners, two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvexPolygon {
    /// The corners; a triangle repeats its last corner.
    corners: [Vec3; 4],
    count: u8,
}

impl ConvexPolygon {
    /// A triangle.
    pub fn triangle(a: Vec3, b: Vec3, c: Vec3) -> Self {
        Self { corners: [a, b, c, c], count: 3 }
    }

    /// A quad, which must be flat ([`FLATNESS`]) and convex; this is not checked. `osp_session::stroke::split_into_convex`
    /// divides any outline into such quads.
    pub fn quad(corners: [Vec3; 4]) -> Self {
        Self { corners, count: 4 }
    }

    /// The corners in order.
    pub fn vertices(&self) -> &[Vec3] {
        &self.corners[..self.count as usize]
    }

    /// Distance at which a ray meets the polygon, from either side, in lengths of the ray's direction; see
    /// [`Ray::meet_triangle`].
    pub fn meet(&self, ray: &Ray) -> Option<f32> {
        match *self.vertices() {
            [a, b, c] => ray.meet_triangle([a, b, c]),
            [a, b, c, d] => ray.meet_triangle([a, b, c]).or_else(|| ray.meet_triangle([a, c, d])),
            _ => None,
        }
    }

    /// The tight box around the polygon.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(&self.corners)
    }

    /// The normal with twice the area as its length; zero for a degenerate polygon.
    pub fn area_vector(&self) -> Vec3 {
        let [a, b, c, d] = self.corners;
        // A triangle has d == c, so the product of the diagonals would also be right for it, except for rounding.
        if self.count == 4 { (c - a).cross(d - b) } else { (b - a).cross(c - a) }
    }

    /// Area, square metres.
    pub fn area_m2(&self) -> f32 {
        self.area_vector().length() * 0.5
    }

    /// The polygon with each corner mapped by `f`.
    #[must_use]
    pub fn map(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        Self { corners: self.corners.map(f), count: self.count }
    }
}
