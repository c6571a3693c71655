use std::collections::BTreeSet;

use super::history::History;

/// An author of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuthorInfo {
    /// The name, as given when joining.
    pub name: String,
    /// Colour that shows the author's work: red, green, blue, sRGB; none if the author has chosen none.
    pub color: Option<(f32, f32, f32)>,
    /// When the author joined, seconds.
    pub joined_secs: f64,
    /// When the author left, seconds; none for a present author.
    pub left_secs: Option<f64>,
}

/// State of an author in a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct AuthorState {
    /// None for the author of a recording that names none.
    pub(super) info: Option<AuthorInfo>,
    pub(super) history: History,
    /// Strokes erased by edits of the author that can be undone.
    pub(super) erased: BTreeSet<u32>,
    /// Strokes that are being drawn. Empty for the author of a recording that names none, who never leaves.
    pub(super) open: BTreeSet<u32>,
}
