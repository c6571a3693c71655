//! Drawing aids: straight lines, a mirror, and a brush of constant width on the screen.

use std::collections::BTreeMap;

use osp_session::recording::{Motion, StrokeId};

/// The drawing aids.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aids {
    /// Whether strokes are straight, as with Shift.
    pub straight: bool,
    /// The x coordinate of the mirror plane, metres. The plane is perpendicular to the x axis. Each stroke is also
    /// drawn mirrored. `None` without a mirror.
    pub mirror_x: Option<f32>,
    /// Width of the brush on the screen, pixels; its width in the model then depends on the distance.
    pub width_px: Option<f32>,
}

/// For each unfinished stroke, its mirror image and the reflection.
#[derive(Clone, Debug, Default)]
pub(super) struct MirrorStrokes(pub(super) BTreeMap<StrokeId, (StrokeId, Motion)>);
