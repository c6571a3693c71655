//! Fingers on a touch screen. One finger acts as the pointer. Two orbit the camera around the centre of the view and
//! change its distance. Three move it along the screen.

use glam::Vec2;

/// Motion of the fingers on the window since the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingers {
    /// Number of fingers, at least two.
    pub count: usize,
    /// Motion of their middle, in heights of the window, y downwards.
    pub moved: Vec2,
    /// Their distance, as a multiple of the previous one.
    pub spread: f32,
}

/// A finger that has come down and has not acted yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resting {
    pub(super) at: Vec2,
    pub(super) since_secs: f64,
}
