use std::collections::BTreeSet;

use super::history::History;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuthorInfo {
    pub name: String,
    /// Colour for the author's work: red, green, blue, sRGB; `None` if the author has chosen none.
    pub color: Option<(f32, f32, f32)>,
    /// Time at which the author joined, seconds.
    pub joined_secs: f64,
    /// Time at which the author left, seconds; `None` if the author is present.
    pub left_secs: Option<f64>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct AuthorState {
    /// Data of the join; `None` for the sole author of a recording without authors.
    pub(super) info: Option<AuthorInfo>,
    pub(super) history: History,
    /// Strokes that are erased by the author's undoable edits.
    pub(super) erased: BTreeSet<u32>,
    /// The author's unfinished strokes. Empty for the sole author of a recording without authors, who never leaves.
    pub(super) open: BTreeSet<u32>,
}
