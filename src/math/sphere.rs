use glam::Vec3;

use super::Aabb;

/// A solid sphere in world space, metres.
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

    /// A sphere around some points, centred in their box. It is not the smallest sphere, but never larger than the sphere
    /// around the box. Without points its radius is NaN.
    pub fn from_points(points: &[Vec3]) -> Self {
        let center = Aabb::from_points(points).center();
        let far = points.iter().map(|p| p.distance(center)).fold(f32::NAN, f32::max);
        // The factor covers the rounding of a root and a sum.
        Self { center, radius_m: far * (1.0 + 4.0 * f32::EPSILON) }
    }
}
