use std::collections::BTreeSet;

use super::history::History;

/// An author of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuthorInfo {
    /// The name, as given when joining.
    pub name: String,
    /// In which colour to show what is the author's: red, green, blue, sRGB; if the author has said.
    pub color: Option<(f32, f32, f32)>,
    /// When the author joined, seconds.
    pub joined_secs: f64,
    /// When the author left, seconds; none: not yet.
    pub left_secs: Option<f64>,
}

/// State of an author in a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct AuthorState {
    /// None for the author of a recording that names none.
    pub(super) info: Option<AuthorInfo>,
    pub(super) history: History,
    /// Strokes that edits of the author have erased, as far as these can be taken back.
    pub(super) erased: BTreeSet<u32>,
    /// Strokes that are being drawn; not kept for the author of a recording that names none, who never leaves.
    pub(super) open: BTreeSet<u32>,
}
