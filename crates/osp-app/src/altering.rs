//! Changes of the selection: another colour or width, turned, scaled, mirrored, copied.
//!
//! A changed copy replaces each stroke, as one [step](Event::Step) for undo. So a replay, and the file after a crash,
//! contain the same change.

use std::collections::BTreeMap;

use osp_session::recording::{Event, Motion, StrokeId};

/// Change of the selection.
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
    /// Mirrored on the mirror while that is on, else on the plane across the x axis through its middle.
    Mirror,
    /// Moved in any way, world space.
    Motion(Motion),
}

/// Copied strokes, as they were in the world.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    pub(super) strokes: Vec<ClipStroke>,
    /// Parents come before children.
    pub(super) groups: Vec<ClipGroup>,
    /// Largest extent of all strokes, metres.
    pub(super) extent_m: f32,
    /// Number of times that it was pasted.
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

/// Changed copies that replaced strokes, by which undo and redo keep them selected.
#[derive(Clone, Debug, Default)]
pub(super) struct Replaced(pub(super) BTreeMap<StrokeId, StrokeId>);
