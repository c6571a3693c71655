use std::collections::VecDeque;

use super::{edit::Edit, log::State};

/// Number of edits in all histories, and total number of strokes that they list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HistoryTotals {
    pub(super) edits: usize,
    pub(super) named: usize,
}

/// The edits that an author can undo or redo.
///
/// The limits are constants, not settings, because every replay of a recording must forget the same edits.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    done: VecDeque<Edit>,
    undone: Vec<Edit>,
    /// Total number of strokes that the edits list.
    pub(super) named: usize,
    /// The step that the next edit becomes part of.
    open: Option<OpenStep>,
    /// Number of edits at the end of `undone` that the scene has not undone yet. If negative, the number of edits at
    /// the end of `done` that it has not redone yet.
    behind: isize,
}

#[derive(Clone, Copy, Debug)]
struct OpenStep {
    left: u32,
    has_begun: bool,
}

/// Edits that a history has dropped.
#[derive(Clone, Debug, Default)]
pub(super) struct Lost {
    pub(super) undone: Vec<Edit>,
    pub(super) done: Vec<Edit>,
}

impl History {
    /// Largest number of edits that can be undone. Older edits are forgotten. With a larger number, erased strokes
    /// would stay in memory longer.
    pub(super) const DEPTH: usize = 1000;

    /// Largest total number of strokes that the edits list. Beyond it the oldest edits are forgotten, but never the
    /// last edit. The limit bounds memory: moves and groupings store up to 28 bytes per stroke.
    pub(super) const NAMED: usize = 1 << 20;

    /// Largest number of edits in the histories of all authors: 65 full histories. Beyond it, the longest history
    /// forgets its oldest edit.
    pub(super) const DEPTH_OF_ALL: usize = 1 << 16;

    /// Largest total number of strokes that the edits of all authors list. Beyond it, the history that lists the most
    /// strokes forgets its oldest edit.
    pub(super) const NAMED_OF_ALL: usize = 4 * Self::NAMED;

    pub(super) fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub(super) fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    /// Number of edits, done and undone.
    pub(super) fn len(&self) -> usize {
        self.done.len() + self.undone.len()
    }

    /// Ends the current step, and makes the next `edits` edits one step. With 0, no step begins.
    pub(super) fn open_step(&mut self, edits: u32) {
        self.open = (edits > 0).then_some(OpenStep { left: edits, has_begun: false });
    }

    /// Whether the next edit becomes part of an open step.
    pub(super) fn is_step_open(&self) -> bool {
        self.open.is_some()
    }

    /// Adds an edit. Appends to `lost` the undone edits, which can no longer be redone, and the oldest edits beyond the
    /// limits.
    pub(super) fn record(&mut self, edit: Edit, lost: &mut Lost) {
        for edit in self.undone.drain(..) {
            self.named -= edit.named();
            lost.undone.push(edit);
        }
        self.add(edit);
        while self.done.len() > Self::DEPTH || (self.named > Self::NAMED && self.done.len() > 1) {
            self.forget_one(0, lost);
        }
    }

    /// Forgets the oldest edit that is not undone, but keeps the last `keep` of them. If there is no further edit,
    /// forgets the undone edit that would be redone last. Returns `false` if no edit was forgotten.
    pub(super) fn forget_one(&mut self, keep: usize, lost: &mut Lost) -> bool {
        let edit = if self.done.len() > keep {
            self.done.pop_front().inspect(|edit| lost.done.push(edit.clone()))
        } else if !self.undone.is_empty() {
            let edit = self.undone.remove(0);
            lost.undone.push(edit.clone());
            Some(edit)
        } else {
            None
        };
        edit.inspect(|edit| self.named -= edit.named()).is_some()
    }

    pub(super) fn forget_all(&mut self) -> Lost {
        let all = std::mem::take(self);
        Lost { undone: all.undone, done: all.done.into() }
    }

    fn add(&mut self, edit: Edit) {
        let Some(mut step) = self.open.take() else {
            self.named += edit.named();
            self.done.push_back(edit);
            return;
        };
        match self.done.back_mut() {
            Some(Edit::Several(edits)) if step.has_begun => {
                self.named += 1 + edit.named();
                edits.push(edit);
            }
            _ => {
                let several = Edit::Several(vec![edit]);
                self.named += several.named();
                self.done.push_back(several);
            }
        }
        step = OpenStep { left: step.left - 1, has_begun: true };
        self.open = (step.left > 0).then_some(step);
    }

    /// Undoes the last edit. If there was an edit, the open step ends. The scene follows with [`History::catch_up`].
    /// Returns the change of the number of strokes that the scene must then visit.
    pub(super) fn undo(&mut self) -> Option<i64> {
        let edit = self.done.pop_back()?;
        let named = 1 + edit.named() as i64;
        self.undone.push(edit);
        (self.open, self.behind) = (None, self.behind + 1);
        Some(if self.behind > 0 { named } else { -named })
    }

    /// Redoes the last undone edit, like [`History::undo`].
    pub(super) fn redo(&mut self) -> Option<i64> {
        let edit = self.undone.pop()?;
        let named = 1 + edit.named() as i64;
        self.done.push_back(edit);
        (self.open, self.behind) = (None, self.behind - 1);
        Some(if self.behind < 0 { named } else { -named })
    }

    /// Calls `turn` for each edit that the scene must still undo or redo, in order.
    pub(super) fn catch_up(&mut self, mut turn: impl FnMut(&Edit, State)) {
        let count = self.behind.unsigned_abs();
        if std::mem::take(&mut self.behind) > 0 {
            self.undone[self.undone.len() - count..].iter().for_each(|edit| turn(edit, State::Undone));
        } else {
            self.done.range(self.done.len() - count..).for_each(|edit| turn(edit, State::Active));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_edit_can_be_taken_back_however_many_strokes_it_names() {
        let (mut history, mut lost) = (History::default(), Lost::default());
        let moved = |strokes: usize| Edit::Arrange { at: 0, named: strokes as u32 };
        history.record(moved(1), &mut lost);
        history.record(moved(History::NAMED + 1), &mut lost);
        assert_eq!((lost.done.len(), lost.undone.len()), (1, 0));
        assert!(history.undo() > Some(History::NAMED as i64) && !history.can_undo());
        let (mut history, mut lost) = (History::default(), Lost::default());
        history.record(moved(1), &mut lost);
        history.record(moved(History::NAMED - 1), &mut lost);
        assert!(history.undo().is_some() && history.undo().is_some() && lost.done.is_empty());
    }
}
