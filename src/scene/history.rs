use std::collections::VecDeque;

use super::edit::Edit;

/// The edits that undo and redo can reach.
///
/// How many is part of what a recording means: everybody who replays one forgets the same edits, so both limits are the
/// same everywhere and no setting.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    done: VecDeque<Edit>,
    taken_back: Vec<Edit>,
    /// Strokes that all of them remember something of.
    named: usize,
    /// The step that is open: how many edits may still join the last one, and whether that is of the step already.
    open: Option<OpenStep>,
}

#[derive(Clone, Copy, Debug)]
struct OpenStep {
    left: u32,
    has_begun: bool,
}

impl History {
    /// Edits that can be taken back, at most: the oldest is forgotten. Larger: undo reaches further, and what was erased
    /// is held longer.
    pub(super) const DEPTH: usize = 1000;

    /// Moves and groupings of many strokes remember something of each of them, 16 or 24 bytes. Together they name at most
    /// this many strokes; the oldest edits are forgotten, but never the last one.
    pub(super) const NAMED: usize = 1 << 20;

    pub(super) fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub(super) fn can_redo(&self) -> bool {
        !self.taken_back.is_empty()
    }

    /// The next `edits` edits are one step. The step before is at its end; 0 begins none.
    pub(super) fn open_step(&mut self, edits: u32) {
        self.open = (edits > 0).then_some(OpenStep { left: edits, has_begun: false });
    }

    /// Whether the next edit joins a step.
    pub(super) fn is_step_open(&self) -> bool {
        self.open.is_some()
    }

    /// Adds an edit. What was taken back cannot be made again then, and the oldest edits may be too many: the strokes
    /// that are gone for good by either are appended to `gone`.
    pub(super) fn record(&mut self, edit: Edit, gone: &mut Vec<u32>) {
        for lost in self.taken_back.drain(..) {
            self.named -= lost.named();
            lost.strokes_of(&mut |drawn| gone.push(drawn), &mut |_| {});
        }
        self.add(edit);
        while self.done.len() > Self::DEPTH || (self.named > Self::NAMED && self.done.len() > 1) {
            let Some(oldest) = self.done.pop_front() else { return };
            self.named -= oldest.named();
            oldest.strokes_of(&mut |_| {}, &mut |erased| gone.push(erased));
        }
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

    /// The last edit, to be played backward and given to [`History::taken_back`].
    pub(super) fn undo(&mut self) -> Option<Edit> {
        self.open = None;
        self.done.pop_back()
    }

    pub(super) fn taken_back(&mut self, edit: Edit) {
        self.taken_back.push(edit);
    }

    /// The edit last taken back, to be played forward and given to [`History::made_again`].
    pub(super) fn redo(&mut self) -> Option<Edit> {
        self.open = None;
        self.taken_back.pop()
    }

    pub(super) fn made_again(&mut self, edit: Edit) {
        self.done.push_back(edit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn the_last_edit_can_be_taken_back_however_many_strokes_it_names() {
        let (mut history, mut gone) = (History::default(), Vec::new());
        let moved = |strokes: usize| Edit::Move { offsets: vec![(0, Vec3::ZERO); strokes] };
        history.record(moved(1), &mut gone);
        history.record(moved(History::NAMED + 1), &mut gone);
        assert!(history.undo().is_some_and(|edit| edit.named() > History::NAMED) && !history.can_undo());
        let mut history = History::default();
        history.record(moved(1), &mut gone);
        history.record(moved(History::NAMED - 1), &mut gone);
        assert!(history.undo().is_some() && history.undo().is_some() && gone.is_empty());
    }
}
