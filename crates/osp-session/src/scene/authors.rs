//! Authors of a scene: names, presence, and undoable edits.

use std::collections::BTreeSet;

use super::{Scene, history::History};
use crate::recording::Author;
use osp::polygon::Change;

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

/// Colours of authors without a chosen colour, by their number: red, green, blue, sRGB. Neighbouring colours differ
/// clearly.
const COLORS: [(f32, f32, f32); 8] = [
    (0.90, 0.35, 0.20),
    (0.20, 0.60, 0.90),
    (0.95, 0.75, 0.15),
    (0.60, 0.35, 0.85),
    (0.25, 0.75, 0.40),
    (0.95, 0.45, 0.70),
    (0.10, 0.70, 0.70),
    (0.65, 0.55, 0.30),
];
/// Colour of strokes without an author: drawn before the first join, or in a window that continues a session of several
/// authors.
const NO_AUTHOR: (f32, f32, f32) = (0.6, 0.6, 0.6);

impl Scene {
    /// The colour for an author's work: red, green, blue, sRGB. It is the author's chosen colour, or else one of
    /// [`COLORS`].
    pub fn author_color(&self, author: Author) -> (f32, f32, f32) {
        match self.author(author) {
            Some(AuthorInfo { color: Some(color), .. }) => *color,
            _ if author.is_sole() => NO_AUTHOR,
            _ => COLORS[(author.0 as usize - 1) % COLORS.len()],
        }
    }

    /// The authors who have joined, by number. Empty for a recording without authors.
    pub fn authors(&self) -> impl Iterator<Item = (Author, &AuthorInfo)> + '_ {
        self.authors.iter().filter_map(|(&author, state)| Some((author, state.info.as_ref()?)))
    }

    /// Data about an author; `None` if no author of this number has joined.
    pub fn author(&self, author: Author) -> Option<&AuthorInfo> {
        self.authors.get(&author)?.info.as_ref()
    }

    pub fn can_undo_of(&self, author: Author) -> bool {
        self.authors.get(&author).is_some_and(|state| state.history.can_undo())
    }

    pub fn can_redo_of(&self, author: Author) -> bool {
        self.authors.get(&author).is_some_and(|state| state.history.can_redo())
    }

    /// Whether the author's next edit becomes part of the step of the last edit.
    pub fn is_step_open_of(&self, author: Author) -> bool {
        self.authors.get(&author).is_some_and(|state| state.history.is_step_open())
    }

    pub(super) fn author_mut(&mut self, author: Author) -> &mut AuthorState {
        self.authors.entry(author).or_default()
    }

    /// Whether an author may send events: an author who has joined and not left, or the sole author of a recording
    /// without authors.
    #[inline]
    pub(super) fn is_there(&self, author: Author) -> bool {
        author.is_sole() || self.author(author).is_some_and(|info| info.left_secs.is_none())
    }

    pub(super) fn join(
        &mut self,
        t: f64,
        author: Author,
        name: &str,
        color: Option<(f32, f32, f32)>,
    ) -> Option<()> {
        if author.is_sole() || !author.is_valid() || self.author(author).is_some() {
            return None;
        }
        let info = AuthorInfo { name: name.to_owned(), color, joined_secs: t, left_secs: None };
        self.author_mut(author).info = Some(info);
        Some(())
    }

    pub(super) fn leave(&mut self, t: f64, author: Author, changes: &mut Vec<Change>) -> Option<()> {
        let state = self.authors.get_mut(&author)?;
        state.info.as_mut().filter(|info| info.left_secs.is_none())?.left_secs = Some(t);
        for at in std::mem::take(&mut state.open) {
            if let Some(id) = self.strokes.get(at as usize).and_then(|stroke| stroke.id) {
                // The stroke may have ended before, if it is undone and no redo can restore it.
                let _ = self.end(id, changes);
            }
        }
        self.closed_layers.retain(|_, owner| *owner != author);
        self.forget_all(author);
        let state = self.author_mut(author);
        (state.erased, state.history) = Default::default();
        Some(())
    }
}
