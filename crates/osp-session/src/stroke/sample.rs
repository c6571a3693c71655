use glam::{Quat, Vec3};

/// One sample of a tracker: a control point of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position, world space, metres.
    pub position: Vec3,
    /// Rotation from the tracker to world space, unit quaternion.
    pub orientation: Quat,
    /// Pressure, 0 to 1.
    pub pressure: f32,
}
