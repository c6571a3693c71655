use std::collections::VecDeque;

use super::edit::Edit;

/// The edits that an author can undo or redo.
///
/// The limits are constants, not settings, because they are part of a recording's meaning: every replay must forget the
/// same edits.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    done: VecDeque<Edit>,
    taken_back: Vec<Edit>,
    /// Number of strokes that all edits list.
    named: usize,
    /// The open step: the number of edits that may still join it, and whether its first edit was made.
    open: Option<OpenStep>,
}

#[derive(Clone, Copy, Debug)]
struct OpenStep {
    left: u32,
    has_begun: bool,
}

/// Edits that a history has dropped.
#[derive(Clone, Debug, Default)]
pub(super) struct Lost {
    /// Undone edits that cannot be redone any more.
    pub(super) taken_back: Vec<Edit>,
    /// Edits that cannot be undone any more.
    pub(super) done: Vec<Edit>,
}

impl History {
    /// Largest number of edits that can be undone; older edits are forgotten. If it were larger, undo would reach
    /// further, and erased strokes would stay in memory longer.
    pub(super) const DEPTH: usize = 1000;

    /// Largest number of strokes that all edits together list. The oldest edits are forgotten, but never the last one.
    /// The limit bounds memory: moves and groupings store up to 28 bytes per stroke.
    pub(super) const NAMED: usize = 1 << 20;

    /// Largest number of edits in the histories of all authors, equal to 65 full histories. The longest history forgets
    /// its oldest edit.
    pub(super) const DEPTH_OF_ALL: usize = 1 << 16;

    /// Largest number of strokes that the edits of all authors list. The history that lists most forgets its oldest
    /// edit.
    pub(super) const NAMED_OF_ALL: usize = 4 * Self::NAMED;

    pub(super) fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub(super) fn can_redo(&self) -> bool {
        !self.taken_back.is_empty()
    }

    /// Number of edits, done and undone.
    pub(super) fn len(&self) -> usize {
        self.done.len() + self.taken_back.len()
    }

    /// Number of strokes that the edits list.
    pub(super) fn named(&self) -> usize {
        self.named
    }

    /// Makes the next `edits` edits one step. The previous step ends; 0 begins no step.
    pub(super) fn open_step(&mut self, edits: u32) {
        self.open = (edits > 0).then_some(OpenStep { left: edits, has_begun: false });
    }

    /// Whether the next edit joins the open step.
    pub(super) fn is_step_open(&self) -> bool {
        self.open.is_some()
    }

    /// Adds an edit. Appends to `lost` the undone edits, which can no longer be redone, and the oldest edits beyond the
    /// limits.
    pub(super) fn record(&mut self, edit: Edit, lost: &mut Lost) {
        for edit in self.taken_back.drain(..) {
            self.named -= edit.named();
            lost.taken_back.push(edit);
        }
        self.add(edit);
        while self.done.len() > Self::DEPTH || (self.named > Self::NAMED && self.done.len() > 1) {
            self.forget_one(0, lost);
        }
    }

    /// Forgets the oldest edit, but keeps the `keep` last done edits. If no other done edit exists, forgets the undone
    /// edit that would be redone last. Returns `false` if no edit was forgotten.
    pub(super) fn forget_one(&mut self, keep: usize, lost: &mut Lost) -> bool {
        let edit = if self.done.len() > keep {
            self.done.pop_front().inspect(|edit| lost.done.push(edit.clone()))
        } else if !self.taken_back.is_empty() {
            let edit = self.taken_back.remove(0);
            lost.taken_back.push(edit.clone());
            Some(edit)
        } else {
            None
        };
        edit.inspect(|edit| self.named -= edit.named()).is_some()
    }

    /// Forgets all edits.
    pub(super) fn forget_all(&mut self) -> Lost {
        let all = std::mem::take(self);
        Lost { taken_back: all.taken_back, done: all.done.into() }
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

    /// Removes the last edit, so that the caller undoes it and passes it to [`History::taken_back`]. The open step
    /// ends, unless there was no edit.
    pub(super) fn undo(&mut self) -> Option<Edit> {
        self.done.pop_back().inspect(|_| self.open = None)
    }

    pub(super) fn taken_back(&mut self, edit: Edit) {
        self.taken_back.push(edit);
    }

    /// Removes the last undone edit, so that the caller redoes it and passes it to [`History::made_again`]. The open
    /// step ends, unless there was no edit.
    pub(super) fn redo(&mut self) -> Option<Edit> {
        self.taken_back.pop().inspect(|_| self.open = None)
    }

    pub(super) fn made_again(&mut self, edit: Edit) {
        self.done.push_back(edit);
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
        assert_eq!((lost.done.len(), lost.taken_back.len()), (1, 0));
        assert!(history.undo().is_some_and(|edit| edit.named() > History::NAMED) && !history.can_undo());
        let (mut history, mut lost) = (History::default(), Lost::default());
        history.record(moved(1), &mut lost);
        history.record(moved(History::NAMED - 1), &mut lost);
        assert!(history.undo().is_some() && history.undo().is_some() && lost.done.is_empty());
    }
}
