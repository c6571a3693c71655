use glam::Vec3;

use super::Aabb;

/// An oriented plane `normal . x + d = 0`. On its inner side, this sum is not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The normal, pointing to the inner side. Distances are in metres only if its length is 1.
    pub normal: Vec3,
    /// Signed distance of the origin, metres (for a unit normal).
    pub d: f32,
}

impl Plane {
    /// The plane through `point` with this normal. Because of rounding, the plane may miss a point that is far from the
    /// origin.
    pub fn from_point_normal(point: Vec3, normal: Vec3) -> Self {
        Self { normal, d: -(normal.x * point.x + normal.y * point.y + normal.z * point.z) }
    }

    /// Signed distance of a point. All tests of the crate compute this one expression (see [`crate::math`]).
    #[inline]
    pub fn signed_distance(&self, p: Vec3) -> f32 {
        ((self.normal.x * p.x + self.normal.y * p.y) + self.normal.z * p.z) + self.d
    }

    /// The corner of the box that lies farthest along the normal (the "positive vertex").
    #[inline]
    pub fn positive_vertex(&self, bounds: &Aabb) -> Vec3 {
        let n = self.normal;
        Vec3::new(
            if n.x >= 0.0 { bounds.max.x } else { bounds.min.x },
            if n.y >= 0.0 { bounds.max.y } else { bounds.min.y },
            if n.z >= 0.0 { bounds.max.z } else { bounds.min.z },
        )
    }

    /// The corner of the box that lies farthest against the normal (the "negative vertex").
    #[inline]
    pub(crate) fn negative_vertex(&self, bounds: &Aabb) -> Vec3 {
        let n = self.normal;
        Vec3::new(
            if n.x >= 0.0 { bounds.min.x } else { bounds.max.x },
            if n.y >= 0.0 { bounds.min.y } else { bounds.max.y },
            if n.z >= 0.0 { bounds.min.z } else { bounds.max.z },
        )
    }
}
