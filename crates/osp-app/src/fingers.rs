//! Fingers on a touch screen. One does what the pointer does; two turn the camera around the centre of the view and come nearer
//! or go away; three move it along the screen.

use glam::Vec2;

/// What the fingers on the window did since the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingers {
    /// How many there are; at least two.
    pub count: usize,
    /// How far their middle went, heights of the window, y downwards.
    pub moved: Vec2,
    /// Their distance, as a multiple of the one before.
    pub spread: f32,
}

/// A finger that has come down and has done nothing yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resting {
    pub(super) at: Vec2,
    pub(super) since_secs: f64,
}
