//! What is done to the selection: another colour or width, turned, scaled, mirrored, copied.
//!
//! Strokes are changed by taking changed copies for them, which is one [step](Event::Step) for undo. A replay, and whoever
//! opens the file after a crash, goes the same way.

use std::collections::BTreeMap;

use osp_session::recording::{Event, Motion, StrokeId};

/// How the selection is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Altering {
    /// The colour of the brush.
    Color,
    /// The width of the brush.
    Width,
    /// Turned about the vertical through its middle, degrees, counter-clockwise seen from above.
    Turn(f32),
    /// Scaled about its middle by a factor.
    Scale(f32),
    /// Mirrored on the plane across the x axis through its middle; on the mirror, while that is on.
    Mirror,
    /// Moved in any way, world space.
    Motion(Motion),
}

/// Copied strokes, as they were in the world.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    pub(super) strokes: Vec<ClipStroke>,
    /// Those above come before those below.
    pub(super) groups: Vec<ClipGroup>,
    /// How large all of it is, metres.
    pub(super) extent_m: f32,
    /// How often it was pasted.
    pub(super) pasted: u32,
}

#[derive(Clone, Debug)]
pub(super) struct ClipStroke {
    pub(super) id: StrokeId,
    pub(super) events: Vec<Event>,
    pub(super) layer: u32,
    /// A place among the clip's groups.
    pub(super) group: Option<usize>,
}

#[derive(Clone, Debug)]
pub(super) struct ClipGroup {
    pub(super) name: Option<String>,
    pub(super) parent: Option<usize>,
}

/// The changed strokes that were taken for others, so that undo and redo keep them selected.
#[derive(Clone, Debug, Default)]
pub(super) struct Replaced(pub(super) BTreeMap<StrokeId, StrokeId>);
