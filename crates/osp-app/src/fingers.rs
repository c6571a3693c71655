//! Fingers on a touch screen. One finger acts as the pointer. Two fingers orbit the camera around the centre of the
//! view and change its distance. Three fingers pan the camera.

use glam::Vec2;

/// Motion of the fingers on the window since the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingers {
    /// Number of fingers, at least two.
    pub count: usize,
    /// Motion of the fingers' centroid, in heights of the window, y downwards.
    pub moved: Vec2,
    /// Distance between the fingers, divided by their distance in the previous frame.
    pub spread: f32,
}

/// A finger that has touched the screen and has had no effect yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resting {
    pub(super) at: Vec2,
    pub(super) since_secs: f64,
}
