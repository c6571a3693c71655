//! Aids for drawing: a straight edge, a mirror, and a brush of constant width on the screen.

use std::collections::BTreeMap;

use osp_session::recording::{Motion, StrokeId};

/// The aids for drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aids {
    /// Strokes are straight, as if Shift were held.
    pub straight: bool,
    /// Position of the mirror, a plane across the x axis, metres. Each stroke is drawn on both sides of it.
    pub mirror_x: Option<f32>,
    /// Width of the brush in pixels; its width in the model depends on the distance.
    pub width_px: Option<f32>,
}

/// Unfinished strokes with their mirror images.
#[derive(Clone, Debug, Default)]
pub(super) struct Twins(pub(super) BTreeMap<StrokeId, (StrokeId, Motion)>);
