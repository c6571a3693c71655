//! Changes of the selected strokes: colour, width, rotation, scale, mirror, copies.
//!
//! A changed copy replaces each stroke. All replacements together are one [step](Event::Step) of undo. The file stores
//! the copies and erasures as ordinary events.

use std::collections::BTreeMap;

use osp_session::recording::{Event, Motion, StrokeId};

/// A change of the selected strokes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Altering {
    /// Gives the strokes the brush's colour.
    Color,
    /// Gives the strokes the brush's width.
    Width,
    /// Rotation about the vertical axis through the selection's centre, degrees, counter-clockwise seen from above.
    Turn(f32),
    /// Scale about the selection's centre, a factor.
    Scale(f32),
    /// Reflection in the drawing aids' mirror if it is on. Otherwise the plane of reflection is perpendicular to the x
    /// axis and contains the selection's centre.
    Mirror,
    /// A motion in world space.
    Motion(Motion),
}

/// The clipboard: copied strokes in world space.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    pub(super) strokes: Vec<ClipStroke>,
    /// The groups of the strokes; parents come before children.
    pub(super) groups: Vec<ClipGroup>,
    /// Largest extent of all strokes, metres.
    pub(super) extent_m: f32,
    /// Number of times that the clip was pasted.
    pub(super) pasted: u32,
}

#[derive(Clone, Debug)]
pub(super) struct ClipStroke {
    pub(super) id: StrokeId,
    pub(super) events: Vec<Event>,
    pub(super) layer: u32,
    /// Index of the stroke's group in [`Clip::groups`].
    pub(super) group: Option<usize>,
}

#[derive(Clone, Debug)]
pub(super) struct ClipGroup {
    pub(super) name: Option<String>,
    pub(super) parent: Option<usize>,
}

/// The changed copy of each replaced stroke. Undo and redo move the selection between the stroke and its copy.
#[derive(Clone, Debug, Default)]
pub(super) struct Replaced(pub(super) BTreeMap<StrokeId, StrokeId>);
