//! The artist's head. A spring pulls it to its target, and it bobs while the artist walks.

use glam::DVec3;

use super::hand::RATE_HZ;
use super::vector::{level, perpendicular, quaternion};

/// Stiffness of the spring that pulls the head to its target, 1/s.
const EAGERNESS: f64 = 2.2;

/// Fraction by which the viewing direction approaches its target in one sample.
const TURN: f64 = 0.06;

#[derive(Debug)]
pub(super) struct Head {
    pub(super) eye: DVec3,
    velocity: DVec3,
    look: DVec3,
    /// Phase of the walking bob, radians.
    stride: f64,
    /// Largest speed, m/s.
    speed_limit: f64,
}

impl Head {
    pub(super) fn new(eye: DVec3, look: DVec3, speed_limit: f64) -> Self {
        Self { eye, velocity: DVec3::ZERO, look, stride: 0.0, speed_limit }
    }

    /// Advances by one sample towards `target`, looking at `at`.
    pub(super) fn advance(&mut self, target: DVec3, at: DVec3) {
        let dt = 1.0 / RATE_HZ;
        // The spring is critically damped, so the head arrives without overshoot.
        let pull = (target - self.eye) * (EAGERNESS * EAGERNESS) - self.velocity * (2.0 * EAGERNESS);
        self.velocity += pull * dt;
        let speed = self.velocity.length();
        if speed > self.speed_limit {
            self.velocity *= self.speed_limit / speed;
        }
        self.eye += self.velocity * dt;
        // Two steps a second at full speed.
        self.stride += std::f64::consts::TAU * 1.9 * (speed.min(self.speed_limit) / self.speed_limit) * dt;
        let wish = (at - self.eye).normalize_or(self.look);
        self.look = (self.look + (wish - self.look) * TURN).normalize_or(wish);
    }

    pub(super) fn pose(&self) -> (DVec3, [f64; 4]) {
        let walking = (self.velocity.length() / 1.2).min(1.0);
        let bob = DVec3::new(0.0, 0.012 * walking * libm::sin(self.stride), 0.0);
        let back = -self.look;
        let up = perpendicular(DVec3::Y, back);
        (self.eye + bob, quaternion(up.cross(back), up, back))
    }

    /// The horizontal direction from a position to the head.
    pub(super) fn from(&self, place: DVec3) -> DVec3 {
        level(self.eye - place, DVec3::Z)
    }
}
