//! The parents that undoable groupings set, and the changes when a grouping is undone or redone.
//!
//! All active groupings apply in order, from the parents before all of them. A grouping that would close a cycle, or
//! exceed the nesting depth, has no effect. The effect of a grouping therefore depends on earlier groupings. If a later
//! grouping may depend on an undone or redone one, [`GroupParents::settle`] applies all of them again, once for all undo
//! and redo of a frame. After forgotten groupings it applies them at once, because the stored parents may contradict
//! each other. The result then does not depend on the frames.

use std::collections::{BTreeMap, BTreeSet};

use super::{group::Groups, log::State};

/// An active grouping that sets a parent.
#[derive(Clone, Copy, Debug)]
struct Grouping {
    group: usize,
    parent: Option<usize>,
    /// The group's parent before the grouping.
    before: Option<usize>,
    /// Whether the grouping has an effect.
    holds: bool,
}

impl Grouping {
    /// Whether a later grouping may have another effect without this one.
    fn is_significant(&self) -> bool {
        !self.holds || self.before != self.parent
    }
}

/// The active groupings that set parents; see the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct GroupParents {
    /// The groupings by their log indices.
    active: BTreeMap<u64, Grouping>,
    /// Log indices of the groupings of each group.
    of_group: BTreeSet<(usize, u64)>,
    /// Log indices of the significant groupings.
    significant: BTreeSet<u64>,
    /// While [`GroupParents::settle`] is due: the parents before all groupings.
    base: Option<BTreeMap<usize, Option<usize>>>,
    /// Whether a grouping was forgotten since all groupings last applied again.
    is_outdated: bool,
    /// Number of groupings applied again so far.
    pub(super) steps: u64,
}

impl GroupParents {
    fn insert(&mut self, place: u64, grouping: Grouping) {
        if grouping.is_significant() {
            self.significant.insert(place);
        }
        self.of_group.insert((grouping.group, place));
        self.active.insert(place, grouping);
    }

    fn remove(&mut self, place: u64) -> Option<Grouping> {
        let grouping = self.active.remove(&place)?;
        self.of_group.remove(&(grouping.group, place));
        self.significant.remove(&place);
        Some(grouping)
    }

    /// The first grouping of a group after `place`.
    fn next_of(&self, group: usize, place: u64) -> Option<&Grouping> {
        let (_, next) = self.of_group.range((group, place + 1)..=(group, u64::MAX)).next()?;
        self.active.get(next)
    }

    /// Appends a new grouping, which has changed the group's parent from `before` to `parent`.
    pub(super) fn add(&mut self, place: u64, group: usize, before: Option<usize>, parent: Option<usize>) {
        self.insert(place, Grouping { group, parent, before, holds: true });
    }

    /// Whether an active grouping has an effect.
    pub(super) fn holds(&self, place: u64) -> bool {
        self.active.get(&place).is_some_and(|grouping| grouping.holds)
    }

    /// Undoes or redoes a grouping. If no later grouping depends on it, the group's parent is set immediately.
    pub(super) fn set_state(
        &mut self,
        groups: &mut Groups,
        place: u64,
        group: usize,
        parent: Option<usize>,
        state: State,
    ) {
        let next = self.next_of(group, place);
        let before = match self.active.get(&place) {
            Some(undone) => undone.before,
            None => next.map_or_else(|| groups.parent(group), |next| next.before),
        };
        let is_depended_on = next.is_some() || self.significant.last().is_some_and(|&last| last > place);
        if self.base.is_none() && before != parent && is_depended_on {
            let mut base = BTreeMap::new();
            for grouping in self.active.values() {
                base.entry(grouping.group).or_insert(grouping.before);
            }
            self.base = Some(base);
        }
        self.remove(place);
        let mut holds = before == parent;
        match &mut self.base {
            Some(base) => _ = base.entry(group).or_insert(before),
            None if holds => {}
            None if state == State::Undone => _ = groups.try_hang(group, before),
            None => holds = groups.try_hang(group, parent),
        }
        if state == State::Active {
            self.insert(place, Grouping { group, parent, before, holds });
        }
        if self.is_outdated {
            self.settle(groups);
        }
    }

    /// Removes an active grouping that undo no longer reaches. If it has an effect, the group's earlier groupings have
    /// none any more. Other groups change only in the next [`GroupParents::settle`].
    pub(super) fn forget(&mut self, place: u64) {
        let Some(forgotten) = self.remove(place).filter(|forgotten| forgotten.holds) else { return };
        self.is_outdated = true;
        let group = forgotten.group;
        while let Some(&(_, earlier)) = self.of_group.range((group, 0)..(group, place)).next() {
            self.remove(earlier);
        }
    }

    /// Updates all parents after undo and redo: groups return to their parents before all groupings, and the groupings
    /// apply again.
    pub(super) fn settle(&mut self, groups: &mut Groups) {
        let Some(base) = self.base.take() else { return };
        self.steps += self.active.len() as u64;
        self.is_outdated = false;
        self.significant.clear();
        groups.rearrange(base.keys().copied(), |groups| {
            for (&group, &parent) in &base {
                groups.try_link(group, parent);
            }
            for (&place, grouping) in &mut self.active {
                grouping.before = groups.parent(grouping.group);
                grouping.holds = groups.try_link(grouping.group, grouping.parent);
                if grouping.is_significant() {
                    self.significant.insert(place);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests;
