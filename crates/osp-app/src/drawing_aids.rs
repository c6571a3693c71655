//! Aids for drawing: a straight edge, a mirror, and a brush that is as wide on the screen at any distance.

use std::collections::BTreeMap;

use osp_session::recording::{Motion, StrokeId};

/// What helps to draw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aids {
    /// Strokes are straight, as if Shift were held.
    pub straight: bool,
    /// Each stroke is drawn on both sides of a plane across the x axis: where that is, metres.
    pub mirror_x: Option<f32>,
    /// The brush is so many pixels wide; in the model it has another width at each distance.
    pub width_px: Option<f32>,
}

/// The strokes in the making that have a mirror image.
#[derive(Clone, Debug, Default)]
pub(super) struct Twins(pub(super) BTreeMap<StrokeId, (StrokeId, Motion)>);
