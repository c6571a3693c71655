use glam::Vec3;

use super::Aabb;

/// A ball in world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, metres.
    pub radius_m: f32,
}

impl Sphere {
    /// The sphere through the corners of a box.
    pub fn around(bounds: &Aabb) -> Self {
        Self { center: bounds.center(), radius_m: bounds.extent().length() * 0.5 }
    }
}
