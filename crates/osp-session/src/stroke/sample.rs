use glam::{Quat, Vec3};

/// One sample of a tracker: a control point of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position, world space, metres.
    pub position: Vec3,
    /// World from tracker, unit quaternion.
    pub orientation: Quat,
    /// Pressure, 0 to 1.
    pub pressure: f32,
}
