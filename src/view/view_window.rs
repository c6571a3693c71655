use glam::{DVec3, Vec3};

use crate::math::triangle_solid_angle_sr;

/// The view of an eye through a screen, for occlusion culling: a pointed cone with four sides, beyond the near plane.
///
/// Screens may be off-axis; the cone only has to be convex and to lie within the half-space in front of the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewWindow {
    eye_in_world: DVec3,
    forward: DVec3,
    corners: [DVec3; 4],
    near_m: f64,
}

impl ViewWindow {
    /// A window from the eye, the direction of view, and the directions to the screen's corners, in order, in either
    /// orientation. All are in world space; directions may have any length. Nothing is drawn nearer than `near_m` along the
    /// direction of view.
    ///
    /// `None` if these directions form no pointed convex cone, or a number is not finite.
    pub fn new(eye_in_world: DVec3, forward: DVec3, corners: [DVec3; 4], near_m: f64) -> Option<Self> {
        let forward = forward.try_normalize()?;
        let mut unit = [DVec3::ZERO; 4];
        for (unit, corner) in unit.iter_mut().zip(corners) {
            *unit = corner.try_normalize()?;
        }
        let center = unit.iter().fold(DVec3::ZERO, |sum, &c| sum + c);
        if unit[0].cross(unit[1]).dot(center) < 0.0 {
            unit.reverse();
        }
        let is_convex = (0..4).all(|i| {
            let side = unit[i].cross(unit[(i + 1) % 4]);
            side.dot(unit[(i + 2) % 4]) > 0.0 && side.dot(unit[(i + 3) % 4]) > 0.0
        });
        let is_pointed = unit.iter().all(|c| c.dot(forward) > 1.0e-6);
        let is_valid =
            eye_in_world.is_finite() && near_m.is_finite() && near_m >= 0.0 && is_convex && is_pointed;
        is_valid.then_some(Self { eye_in_world, forward, corners: unit, near_m })
    }

    /// The eye, world space, metres.
    pub fn eye_in_world(&self) -> DVec3 {
        self.eye_in_world
    }

    /// The direction of view, unit length.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Unit directions to the corners; `corner[i] x corner[i + 1]` points inwards.
    pub fn corners(&self) -> &[DVec3; 4] {
        &self.corners
    }

    /// Nearest distance drawn, along the direction of view, metres.
    pub fn near_m(&self) -> f64 {
        self.near_m
    }

    /// A point of the world relative to the eye. The difference is computed in `f64`, so it is exact to the last bits at
    /// any distance from the origin.
    pub fn from_eye(&self, point_in_world: Vec3) -> DVec3 {
        point_in_world.as_dvec3() - self.eye_in_world
    }

    /// The cone's solid angle, steradians.
    pub fn solid_angle_sr(&self) -> f64 {
        let [a, b, c, d] = self.corners;
        triangle_solid_angle_sr(a, b, c) + triangle_solid_angle_sr(a, c, d)
    }
}
