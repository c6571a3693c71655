//! Undo and redo of each author. Later edits of other authors do not prevent undo and redo.

use super::{
    Scene,
    edit::{Arrangement, Edit},
    history::{History, Lost},
    log::State,
};
use crate::recording::Author;

impl Scene {
    /// Adds an arrangement that took effect to the author's history.
    pub(super) fn arrange(&mut self, author: Author, what: Arrangement) {
        let named = what.named();
        let at = self.log.add(what);
        self.record(author, Edit::Arrange { at, named });
    }

    pub(super) fn record(&mut self, author: Author, edit: Edit) {
        let mut lost = std::mem::take(&mut self.lost);
        self.with_history(author, |history| history.record(edit, &mut lost));
        self.forget(author, &mut lost);
        while self.totals.edits > History::DEPTH_OF_ALL || self.totals.named > History::NAMED_OF_ALL {
            self.looked_at += self.authors.len() as u64;
            let too_many = self.totals.edits > History::DEPTH_OF_ALL;
            let size = |history: &History| if too_many { history.len() } else { history.named };
            let sizes = self.authors.iter().map(|(&of, state)| (size(&state.history), std::cmp::Reverse(of)));
            let Some((_, std::cmp::Reverse(of))) = sizes.max() else { break };
            self.catch_up(of);
            // The author's newest edit is kept.
            if !self.with_history(of, |history| history.forget_one(usize::from(of == author), &mut lost)) {
                break;
            }
            self.forget(of, &mut lost);
        }
        self.lost = lost;
    }

    /// Changes a history, and updates the totals.
    fn with_history<T>(&mut self, author: Author, change: impl FnOnce(&mut History) -> T) -> T {
        let history = &mut self.authors.entry(author).or_default().history;
        let (edits, named) = (history.len(), history.named);
        let result = change(history);
        self.totals.edits = self.totals.edits + history.len() - edits;
        self.totals.named = self.totals.named + history.named - named;
        result
    }

    /// Drops edits of an author that undo and redo no longer reach.
    fn forget(&mut self, author: Author, lost: &mut Lost) {
        let first = self.gone[0].len();
        for edit in lost.undone.drain(..) {
            edit.for_each(&mut |edit| match edit {
                Edit::Draw { stroke } => self.gone[0].push(*stroke),
                Edit::Arrange { at, .. } => self.log.remove(*at),
                Edit::Erase { .. } | Edit::Several(_) => {}
            });
        }
        for edit in lost.done.drain(..) {
            edit.for_each(&mut |edit| match edit {
                Edit::Erase { stroke } => {
                    self.author_mut(author).erased.remove(stroke);
                    self.gone[0].push(*stroke);
                }
                Edit::Arrange { at, .. } => {
                    let mut hangs = false;
                    if self.log.sets_parent(*at) {
                        self.parents.settle(&mut self.groups);
                        hangs = self.parents.holds(*at);
                        self.parents.forget(*at);
                    }
                    for (stroke, offset) in self.log.forget(*at, hangs) {
                        self.set_offset(stroke, offset);
                    }
                }
                Edit::Draw { .. } | Edit::Several(_) => {}
            });
        }
        for i in first..self.gone[0].len() {
            self.put_out_of_reach(self.gone[0][i]);
        }
    }

    /// Makes all edits of an author permanent.
    pub(super) fn forget_all(&mut self, author: Author) {
        self.catch_up(author);
        let mut lost = self.with_history(author, History::forget_all);
        self.forget(author, &mut lost);
    }

    /// Removes a stroke that undo and redo no longer reach. Its number is never used again.
    fn put_out_of_reach(&mut self, at: u32) {
        let Some(stroke) = self.strokes.get_mut(at as usize) else { return };
        stroke.is_gone = true;
        if stroke.builder.take().is_some() && !stroke.author().is_sole() {
            let author = stroke.author();
            self.author_mut(author).open.remove(&at);
        }
        let Some(stroke) = self.strokes.get_mut(at as usize) else { return };
        if let Some(id) = stroke.id {
            self.stroke_by_id.remove(&id);
            self.used.insert(id.0);
        }
        let group = stroke.group.take();
        if group.is_some() {
            self.groups.change_member(at, stroke.layer, group, None);
            self.displace(at);
        }
    }

    /// Undoes or redoes an edit. The scene follows at the end of the frame, or before the next event that depends on
    /// the edit. A frame therefore undoes and redoes each edit at most once.
    pub(super) fn turn(&mut self, author: Author, to: State) -> Option<()> {
        let history = &mut self.authors.get_mut(&author)?.history;
        let named = if to == State::Undone { history.undo() } else { history.redo() }?;
        self.behind_named = self.behind_named.saturating_add_signed(named);
        self.behind.insert(author);
        Some(())
    }

    /// Undoes and redoes the edits of an author that the scene has not followed yet.
    pub(super) fn catch_up(&mut self, author: Author) {
        if !self.behind.remove(&author) {
            return;
        }
        let mut history = std::mem::take(&mut self.author_mut(author).history);
        history.catch_up(|edit, state| {
            self.behind_named = self.behind_named.saturating_sub(1 + edit.named() as u64);
            self.play(author, edit, state);
        });
        self.author_mut(author).history = history;
    }

    pub(super) fn catch_up_all(&mut self) {
        while let Some(&author) = self.behind.first() {
            self.catch_up(author);
        }
    }

    fn play(&mut self, author: Author, edit: &Edit, state: State) {
        self.looked_at += 1;
        match (edit, state) {
            (Edit::Draw { stroke }, _) => self.set_undone(*stroke, state == State::Undone),
            (Edit::Erase { stroke }, _) => self.set_erased(author, *stroke, state == State::Active),
            (Edit::Arrange { at, .. }, _) => self.set_state(*at, state),
            (Edit::Several(edits), State::Undone) => {
                edits.iter().rev().for_each(|edit| self.play(author, edit, state));
            }
            (Edit::Several(edits), State::Active) => {
                edits.iter().for_each(|edit| self.play(author, edit, state));
            }
        }
    }

    fn set_state(&mut self, at: u64, state: State) {
        let mut what = self.log.take(at);
        self.looked_at += u64::from(what.named());
        match &mut what {
            Arrangement::Nothing => {}
            Arrangement::Move(moved) => {
                let strokes = &self.strokes;
                let now = |at: u32| strokes.get(at as usize).map(|stroke| stroke.offset).unwrap_or_default();
                let offsets = self.log.set_state_of_moves(at, moved, state, now);
                moved.iter().zip(offsets).for_each(|(named, offset)| self.set_offset(named.stroke, offset));
            }
            Arrangement::Group(grouping) => {
                let group = grouping.group;
                if let Some(names) = &mut grouping.names {
                    let now = || self.groups.name(group).map(str::to_owned);
                    if let Some(name) = self.log.set_state_of_name(at, group, names, state, now) {
                        self.groups.set_name(group, name);
                    }
                }
                if let Some(parent) = grouping.new_parent {
                    self.parents.set_state(&mut self.groups, at, group, parent, state);
                }
                let strokes = &self.strokes;
                let now = |at: u32| strokes.get(at as usize).and_then(|stroke| stroke.group);
                let members =
                    self.log.set_state_of_values(at, &mut grouping.members, state, Some(group), now);
                members.into_iter().for_each(|(stroke, group)| self.set_group(stroke, group));
            }
            Arrangement::Place { group, before, to } => {
                let (group, now) = (*group, self.groups.transform(*group));
                let place = self.log.set_state_of_place(at, group, before, state, *to, now);
                if let Some(place) = place {
                    self.groups.place(group, place);
                }
            }
            Arrangement::Assign { layer, strokes: named } => {
                let strokes = &self.strokes;
                let now = |at: u32| strokes.get(at as usize).map_or(0, |stroke| stroke.layer);
                let layers = self.log.set_state_of_values(at, named, state, *layer, now);
                layers.into_iter().for_each(|(stroke, layer)| self.set_layer(stroke, layer));
            }
        }
        self.log.put(at, what, state);
    }
}
