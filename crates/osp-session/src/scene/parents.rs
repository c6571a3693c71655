//! The parent of each group after every undoable grouping, and the changes when a grouping is undone or redone.
//!
//! All active groupings apply in order. A grouping that would close a cycle, or exceed the nesting depth, has no
//! effect. The effect of a grouping therefore depends on earlier groupings. Undoing a grouping may change the effect of
//! any later grouping. [`GroupParents::settle`] visits the later groupings in order of time. It compares the stored,
//! old timeline with the new timeline. It tracks three kinds of groups:
//! * A group *differs* if its parents on the two timelines differ.
//! * A group is *reached* if it differs or has an ancestor that differs. Only reached groups may have other ancestors
//!   on the new timeline.
//! * A group is *above* if it is an ancestor of a group that differs, on either timeline. Only the subtrees of groups
//!   that are above may have another height.
//!
//! Only groupings whose parent or group is reached, or whose group is above, may have another effect. The walk skips
//! all other groupings. When no group differs any more, the walk continues at the next edit, or ends.

mod scratch;
mod time;
mod walk;

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Bound::{Excluded, Unbounded},
};

use super::{group::Groups, log::State};
use scratch::Scratch;
use time::{END, Time, base_time, constant_time, place_at, time_of};

/// The timeline of a group's parent, and the groupings whose parent is the group. `held` and `refused` are empty for a
/// group without groupings, because its parent is constant.
#[derive(Clone, Debug, Default)]
struct Line {
    /// The parent from each time on: the base parent, then the parents that groupings with an effect have set.
    held: BTreeMap<Time, Option<usize>>,
    /// The parents of groupings without effect.
    refused: BTreeMap<Time, usize>,
    /// The groups whose groupings, with or without effect, have this group as parent.
    toward: BTreeMap<Time, usize>,
    /// Number of entries of `toward` for each group.
    from: BTreeMap<usize, u32>,
    /// Cache: the number of a walk, and the parent found in this walk, valid until this time.
    known: (u64, Time, Option<usize>),
}

impl Line {
    fn is_constant(&self) -> bool {
        self.held.is_empty() && self.refused.is_empty()
    }

    /// Whether only the base parent remains, without any grouping.
    fn is_base_only(&self) -> bool {
        self.held.len() + self.refused.len() == 1
    }

    fn before(&self, time: Time) -> Option<usize> {
        self.held.range(..time).next_back().and_then(|(_, &parent)| parent)
    }
}

/// The timelines of the parents of all groups; see the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct GroupParents {
    lines: Vec<Option<Box<Line>>>,
    /// Number of active groupings that set a parent.
    count: usize,
    /// Log indices of the active groupings that have no effect, or that change the parent.
    significant: BTreeSet<u64>,
    /// Outdated entries of the stored timeline: the group, and its parent from this time on.
    outdated: BTreeMap<Time, (usize, Option<usize>)>,
    /// Groupings redone since the last walk.
    fresh: BTreeMap<Time, usize>,
    /// For groupings, the parent that each replaced, if this parent differs from the preceding entry. Empty if no entry
    /// is outdated.
    found: BTreeMap<Time, Option<usize>>,
    /// Whether too many entries are outdated to list them. The next walk then rebuilds all parents.
    is_all_outdated: bool,
    /// Groups of the groupings that were undone since the last walk.
    to_detach: Vec<usize>,
    /// Whether [`GroupParents::settle`] must run before a parent is read.
    is_due: bool,
    /// Number of the current walk.
    walk: u64,
    /// Number of groups and groupings visited so far.
    pub(super) steps: u64,
    scratch: Scratch,
}

impl GroupParents {
    fn line(&self, group: usize) -> Option<&Line> {
        self.lines.get(group)?.as_deref()
    }

    fn line_mut(&mut self, group: usize) -> &mut Line {
        if self.lines.len() <= group {
            self.lines.resize(group + 1, None);
        }
        self.lines[group].get_or_insert_default()
    }

    fn is_constant(&self, group: usize) -> bool {
        self.line(group).is_none_or(Line::is_constant)
    }

    fn note_toward(&mut self, parent: Option<usize>, time: Time, group: usize) {
        if let Some(parent) = parent {
            let line = self.line_mut(parent);
            line.toward.insert(time, group);
            *line.from.entry(group).or_default() += 1;
        }
    }

    fn forget_toward(&mut self, parent: Option<usize>, time: Time, group: usize) {
        let Some(parent) = parent else { return };
        let line = self.line_mut(parent);
        line.toward.remove(&time);
        match line.from.get_mut(&group) {
            Some(count) if *count > 1 => *count -= 1,
            _ => _ = line.from.remove(&group),
        }
        self.drop_if_empty(parent);
    }

    fn drop_if_empty(&mut self, group: usize) {
        if self.line(group).is_some_and(|line| line.is_constant() && line.toward.is_empty()) {
            self.lines[group] = None;
        }
    }

    /// Adds a grouping. `now` is the group's current parent. It becomes the base parent if the group has no grouping
    /// yet.
    fn insert(&mut self, time: Time, group: usize, parent: Option<usize>, holds: bool, now: Option<usize>) {
        let line = self.line_mut(group);
        if line.is_constant() {
            line.held.insert(base_time(group), now);
            self.note_toward(now, base_time(group), group);
        }
        let line = self.line_mut(group);
        let is_elsewhere = line.before(time) != now;
        let is_last = line.held.range(time..).next().is_none() && line.refused.range(time..).next().is_none();
        match parent {
            Some(parent) if !holds => _ = line.refused.insert(time, parent),
            _ => _ = line.held.insert(time, parent),
        }
        if is_elsewhere && is_last && !self.is_due {
            self.found.insert(time, now);
        }
        self.note_toward(parent, time, group);
        self.count += 1;
    }

    fn remove(&mut self, time: Time, group: usize, parent: Option<usize>) -> bool {
        let line = self.line_mut(group);
        let held = line.held.remove(&time).is_some();
        line.refused.remove(&time);
        self.forget_toward(parent, time, group);
        self.count -= 1;
        self.significant.remove(&place_at(time).unwrap_or_default());
        self.found.remove(&time);
        self.fresh.remove(&time);
        held
    }

    /// The parent that undoing a grouping restores, or that redoing it replaces. `now` is the group's current parent.
    fn found(&self, time: Time, group: usize, now: Option<usize>, state: State) -> Option<usize> {
        let Some(line) = self.line(group).filter(|line| !line.is_constant()) else { return now };
        let finder = match state {
            State::Undone => Some(time),
            State::Active => {
                let held = line.held.range(time..).next().map(|(&time, _)| time);
                held.into_iter().chain(line.refused.range(time..).next().map(|(&time, _)| time)).min()
            }
        };
        finder.map_or(now, |time| self.found.get(&time).copied().unwrap_or_else(|| line.before(time)))
    }

    /// Makes the current parent of a group constant, if the group has no more groupings.
    fn make_constant(&mut self, groups: &Groups, group: usize) {
        let Some(line) =
            self.lines.get_mut(group).and_then(Option::as_mut).filter(|line| line.is_base_only())
        else {
            return;
        };
        let Some((time, base)) = line.held.pop_first() else { return };
        self.forget_toward(base, time, group);
        self.drop_if_empty(group);
        // A constant parent precedes all base parents on the timeline.
        if groups.parent(group) != base || self.outdated.contains_key(&time) {
            self.outdated.entry(time).or_insert((group, base));
            self.outdated.entry(constant_time(group)).or_insert((group, None));
        }
    }

    /// Appends a new grouping, which has changed the group's parent from `before` to `parent`.
    pub(super) fn add(&mut self, place: u64, group: usize, before: Option<usize>, parent: Option<usize>) {
        self.insert(time_of(place), group, parent, true, before);
        if before != parent {
            self.significant.insert(place);
        }
    }

    /// Whether the stored timeline has no outdated entry.
    fn is_up_to_date(&self) -> bool {
        self.outdated.is_empty() && !self.is_all_outdated
    }

    /// Whether an active grouping has an effect.
    pub(super) fn holds(&self, place: u64, group: usize) -> bool {
        self.line(group).is_some_and(|line| line.held.contains_key(&time_of(place)))
    }

    /// Whether a later grouping depends on the effect of this grouping.
    fn is_depended_on(&self, place: u64, group: usize) -> bool {
        let later = (Excluded(time_of(place)), Unbounded);
        self.significant.last().is_some_and(|&last| last > place)
            || self.line(group).is_some_and(|line| {
                line.held.range(later).next().is_some() || line.refused.range(later).next().is_some()
            })
    }

    /// Undoes or redoes a grouping. If no later grouping depends on it, the group's parent is set immediately.
    /// Otherwise [`GroupParents::settle`] updates all dependent groupings, in one walk for all undo and redo of a
    /// frame.
    pub(super) fn set_state(
        &mut self,
        groups: &mut Groups,
        place: u64,
        group: usize,
        parent: Option<usize>,
        state: State,
    ) {
        let (time, now) = (time_of(place), groups.parent(group));
        if !self.is_due {
            let before = self.found(time, group, now, state);
            let is_at_once = before == parent || !self.is_depended_on(place, group);
            if is_at_once && state == State::Active {
                let holds = before == parent || groups.try_hang(group, parent);
                self.insert(time, group, parent, holds, now);
                if !holds && !self.is_up_to_date() {
                    // The current parents refuse the grouping, but they differ from the stored timeline.
                    self.fresh.insert(time, group);
                }
                if before != parent {
                    self.significant.insert(place);
                }
                return;
            }
            if is_at_once {
                self.remove(time, group, parent);
                if before != parent && !groups.try_hang(group, before) {
                    self.outdated.insert(time, (group, now));
                }
                self.make_constant(groups, group);
                return;
            }
        }
        // Entries that were outdated before this change are processed immediately, in the same walk as this change.
        let is_pure = self.is_due || self.is_up_to_date();
        self.is_due = true;
        match state {
            State::Active => {
                self.insert(time, group, parent, false, now);
                self.significant.insert(place);
                self.fresh.insert(time, group);
            }
            State::Undone => {
                let was_fresh = self.fresh.remove(&time).is_some();
                if self.remove(time, group, parent) && !was_fresh {
                    self.outdated.entry(time).or_insert((group, parent));
                }
                self.to_detach.push(group);
            }
        }
        if !is_pure {
            self.settle(groups);
        }
    }

    /// Removes an active grouping that undo no longer reaches. If the grouping has an effect, its parent becomes the
    /// base parent, and the group's earlier groupings are dropped. Other groups change only in the next walk.
    pub(super) fn forget(&mut self, groups: &Groups, place: u64, group: usize, parent: Option<usize>) {
        let time = time_of(place);
        if !self.remove(time, group, parent) {
            self.make_constant(groups, group);
            return;
        }
        // If no earlier grouping is significant, no entry becomes outdated.
        let is_first = self.is_up_to_date() && self.significant.first().is_none_or(|&first| first > place);
        let line = self.line_mut(group);
        let after = line.held.split_off(&time);
        let held = std::mem::replace(&mut line.held, after);
        let after = line.refused.split_off(&time);
        let refused = std::mem::replace(&mut line.refused, after);
        if !is_first {
            let before = held.iter().map(|(&from, &parent)| (from, (group, parent)));
            for (from, was) in before.chain([(time, (group, parent))]) {
                self.outdated.entry(from).or_insert(was);
            }
            if self.outdated.len() > 2 * self.count + 1024 {
                self.is_all_outdated = true;
            }
            if self.is_all_outdated {
                self.outdated.clear();
            }
        }
        let refused = refused.into_iter().map(|(from, parent)| (from, Some(parent)));
        for (from, parent) in held.into_iter().chain(refused) {
            self.forget_toward(parent, from, group);
            if let Some(place) = place_at(from) {
                self.count -= 1;
                self.significant.remove(&place);
                self.found.remove(&from);
            }
        }
        self.line_mut(group).held.insert(base_time(group), parent);
        self.note_toward(parent, base_time(group), group);
        self.make_constant(groups, group);
    }

    /// Updates all parents after undo and redo. The cost grows with the number of groups that differ at a later time,
    /// and of their descendants. It also grows with the number of later groupings of these groups and of their
    /// ancestors.
    pub(super) fn settle(&mut self, groups: &mut Groups) {
        if !std::mem::take(&mut self.is_due) {
            return;
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        self.walk += 1;
        scratch.begin(groups.len());
        if !self.is_all_outdated && self.walk_through(groups, &mut scratch) {
            self.hang_differing(groups, &scratch.differs);
        } else {
            self.rebuild(groups);
        }
        self.is_all_outdated = false;
        self.outdated.clear();
        self.fresh.clear();
        self.found.clear();
        for group in std::mem::take(&mut self.to_detach) {
            self.make_constant(groups, group);
        }
        scratch.end();
        self.scratch = scratch;
    }

    fn hang_differing(&mut self, groups: &mut Groups, differs: &BTreeMap<usize, Option<usize>>) {
        let mut to_attach = Vec::new();
        for &group in differs.keys() {
            let parent = self.link(groups, group, END);
            if parent != groups.parent(group) {
                to_attach.push((group, parent));
            }
        }
        // All groups are detached first, so that no intermediate state has a cycle.
        to_attach.iter().for_each(|&(group, _)| groups.set_parent(group, None));
        to_attach.iter().for_each(|&(group, parent)| groups.set_parent(group, parent));
    }

    /// Rebuilds all parents: resets the groups of all groupings to their base parents, then applies the groupings in order.
    fn rebuild(&mut self, groups: &mut Groups) {
        let mut all = Vec::new();
        for (group, line) in self.lines.iter().enumerate() {
            let Some(line) = line.as_deref().filter(|line| !line.is_constant()) else { continue };
            groups.set_parent(group, None);
            all.extend(line.held.iter().map(|(&time, &parent)| (time, group, parent)));
            all.extend(line.refused.iter().map(|(&time, &parent)| (time, group, Some(parent))));
        }
        all.sort_unstable();
        for (time, group, parent) in all {
            let before = groups.parent(group);
            let holds = groups.try_hang(group, parent);
            self.set_outcome(time, group, parent, holds);
            self.note_significance(time, holds && before == parent);
        }
    }

    fn set_outcome(&mut self, time: Time, group: usize, parent: Option<usize>, holds: bool) {
        let line = self.line_mut(group);
        line.known.0 = 0;
        if holds {
            line.refused.remove(&time);
            line.held.insert(time, parent);
        } else if place_at(time).is_none() {
            // The base parent is refused, so the group has no parent before all groupings.
            line.held.insert(time, None);
            self.forget_toward(parent, time, group);
        } else if let Some(parent) = parent {
            line.held.remove(&time);
            line.refused.insert(time, parent);
        }
    }

    fn note_significance(&mut self, time: Time, changes_nothing: bool) {
        let Some(place) = place_at(time) else { return };
        if changes_nothing {
            self.significant.remove(&place);
        } else {
            self.significant.insert(place);
        }
    }
}

#[cfg(test)]
mod tests;
