//! Under which group each group hung after every grouping that can still be taken back, and what changes when one of them is.
//!
//! The groups hang as all active groupings leave them, one after the other: one that would close a circle or make a chain too
//! long has no effect. So what a grouping does depends on those before it, and to take one back may change the outcome of any
//! that is later. [`Hangings::settle`] goes through time from that grouping on, and knows two courses: the one of before, which
//! is kept, and the one that comes about. It follows
//! * the groups that hang elsewhere in one course than in the other: they *differ*;
//! * all that hangs below these, the groups that are *reached*: only from there does the way up lead elsewhere, so only
//!   groupings under those may have another outcome,
//! * or those of a group that is *above* one that differs: it may be higher or lower than it was.
//!
//! All other groupings have the outcome that they had, and are not looked at. It ends as soon as no group differs.

mod walk;

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Bound::{Excluded, Unbounded},
};

use super::{group::Groups, log::Turn};
use walk::Scratch;

/// When something is hung. First come the groups that no grouping hangs, then the others as they were before all groupings, group
/// by group, then the groupings by their places in the log.
type Time = (u64, usize);

fn constant_time(group: usize) -> Time {
    (0, group)
}

fn base_time(group: usize) -> Time {
    (1, group)
}

fn time_of(place: u64) -> Time {
    (place + 2, 0)
}

/// The place of the grouping at a time, if there is one.
fn place_at(time: Time) -> Option<u64> {
    time.0.checked_sub(2)
}

const END: Time = (u64::MAX, usize::MAX);

/// What happens to one group in the course of time, and under it. Of a group that no grouping hangs, the first two are empty:
/// it hangs where it hangs.
#[derive(Clone, Debug, Default)]
struct Line {
    /// Where it hangs from a time on: before all groupings, and after those that have an effect.
    held: BTreeMap<Time, Option<usize>>,
    /// Where groupings without effect would hang it.
    refused: BTreeMap<Time, usize>,
    /// The groups that are hung under it, with effect or without.
    toward: BTreeMap<Time, usize>,
    /// How often each.
    from: BTreeMap<usize, u32>,
    /// Scratch: where it hangs in the walk with this number, until this time.
    known: (u64, Time, Option<usize>),
}

impl Line {
    fn is_constant(&self) -> bool {
        self.held.is_empty() && self.refused.is_empty()
    }

    /// Whether all groupings that hang it are gone, and only what was before is left.
    fn is_base_only(&self) -> bool {
        self.held.len() + self.refused.len() == 1
    }

    fn before(&self, time: Time) -> Option<usize> {
        self.held.range(..time).next_back().and_then(|(_, &parent)| parent)
    }
}

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Hangings {
    /// By group.
    lines: Vec<Option<Box<Line>>>,
    /// Active groupings that hang something, and the places of those that have no effect, or hang a group elsewhere.
    count: usize,
    significant: BTreeSet<u64>,
    /// Where the course that is kept has a group hang from a time on, where that is not so any more.
    outdated: BTreeMap<Time, (usize, Option<usize>)>,
    /// Groupings that were made again since.
    fresh: BTreeMap<Time, usize>,
    /// Where groupings found their group, where that is not what comes before them any more: only while something is outdated.
    found: BTreeMap<Time, Option<usize>>,
    /// So much is outdated that it is not kept.
    is_all_outdated: bool,
    /// Groups that a grouping hung that was taken back since.
    let_go: Vec<usize>,
    /// What is outdated has to be worked off before anybody asks where a group hangs.
    is_due: bool,
    /// The number of the walk.
    walk: u64,
    steps: u64,
    scratch: Scratch,
}

impl Hangings {
    /// Groups and groupings looked at so far.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

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

    /// Adds a grouping; `now` is where the group hangs if none hangs it yet.
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

    /// Takes a grouping out; whether it had an effect.
    fn remove(&mut self, time: Time, group: usize, parent: Option<usize>) -> bool {
        let line = self.line_mut(group);
        let held = line.held.remove(&time).is_some();
        line.refused.remove(&time);
        self.forget_toward(parent, time, group);
        self.count -= 1;
        self.significant.remove(&place_at(time).unwrap_or_default());
        self.found.remove(&time);
        held
    }

    /// What a grouping, or one that is made again, finds a group under that is under `now`.
    fn found(&self, time: Time, group: usize, now: Option<usize>, turn: Turn) -> Option<usize> {
        let Some(line) = self.line(group).filter(|line| !line.is_constant()) else { return now };
        let finder = match turn {
            Turn::TakenBack => Some(time),
            Turn::MadeAgain => {
                let held = line.held.range(time..).next().map(|(&time, _)| time);
                held.into_iter().chain(line.refused.range(time..).next().map(|(&time, _)| time)).min()
            }
        };
        finder.map_or(now, |time| self.found.get(&time).copied().unwrap_or_else(|| line.before(time)))
    }

    /// No grouping hangs a group any more: from now on it hangs where it hangs, as it always has.
    fn make_constant(&mut self, groups: &Groups, group: usize) {
        let Some(line) =
            self.lines.get_mut(group).and_then(Option::as_mut).filter(|line| line.is_base_only())
        else {
            return;
        };
        let Some((time, base)) = line.held.pop_first() else { return };
        self.forget_toward(base, time, group);
        self.drop_if_empty(group);
        // It hangs there before the others are hung, from now on.
        if groups.parent(group) != base || self.outdated.contains_key(&time) {
            self.outdated.entry(time).or_insert((group, base));
            self.outdated.entry(constant_time(group)).or_insert((group, None));
        }
    }

    /// A grouping was made, as the last one: the group hung under `before`, and hangs under `parent`.
    pub(super) fn add(&mut self, place: u64, group: usize, before: Option<usize>, parent: Option<usize>) {
        self.insert(time_of(place), group, parent, true, before);
        if before != parent {
            self.significant.insert(place);
        }
    }

    /// Whether nothing is outdated.
    fn is_as_kept(&self) -> bool {
        self.outdated.is_empty() && !self.is_all_outdated
    }

    /// Whether an active grouping has an effect.
    pub(super) fn holds(&self, place: u64, group: usize) -> bool {
        self.line(group).is_some_and(|line| line.held.contains_key(&time_of(place)))
    }

    /// Whether a later grouping depends on what this one does.
    fn is_depended_on(&self, place: u64, group: usize) -> bool {
        let later = (Excluded(time_of(place)), Unbounded);
        self.significant.last().is_some_and(|&last| last > place)
            || self.line(group).is_some_and(|line| {
                line.held.range(later).next().is_some() || line.refused.range(later).next().is_some()
            })
    }

    /// A grouping is taken back, or made again. If no later one depends on it, the group is hung at once; else all that
    /// depends on it waits for [`Hangings::settle`], so that many turns of a frame cost one walk.
    pub(super) fn turn(
        &mut self,
        groups: &mut Groups,
        place: u64,
        group: usize,
        parent: Option<usize>,
        turn: Turn,
    ) {
        let (time, now) = (time_of(place), groups.parent(group));
        if !self.is_due {
            let before = self.found(time, group, now, turn);
            let is_at_once = before == parent || !self.is_depended_on(place, group);
            if is_at_once && turn == Turn::MadeAgain {
                let holds = before == parent || groups.try_hang(group, parent);
                self.insert(time, group, parent, holds, now);
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
        // What was forgotten since the last walk comes first, as it is.
        let is_pure = self.is_due || self.is_as_kept();
        self.is_due = true;
        match turn {
            Turn::MadeAgain => {
                self.insert(time, group, parent, false, now);
                self.significant.insert(place);
                self.fresh.insert(time, group);
            }
            Turn::TakenBack => {
                let was_fresh = self.fresh.remove(&time).is_some();
                if self.remove(time, group, parent) && !was_fresh {
                    self.outdated.entry(time).or_insert((group, parent));
                }
                self.let_go.push(group);
            }
        }
        if !is_pure {
            self.settle(groups);
        }
    }

    /// An active grouping becomes part of what was before all others. If it has an effect, earlier ones of its group have no
    /// say any more; what that changes for others shows when a grouping is taken back next that others depend on.
    pub(super) fn forget(&mut self, groups: &Groups, place: u64, group: usize, parent: Option<usize>) {
        let time = time_of(place);
        if !self.remove(time, group, parent) {
            self.make_constant(groups, group);
            return;
        }
        // Where all earlier groupings leave everything as it was, they still do.
        let is_first = self.is_as_kept() && self.significant.first().is_none_or(|&first| first > place);
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

    /// Hangs all groups as they hang after what was taken back and made again. Costs what depends on it: the groups below
    /// those that hang elsewhere at any time since, and the later groupings of those, and of the groups above them.
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
            self.hang_anew(groups);
        }
        self.is_all_outdated = false;
        self.outdated.clear();
        self.fresh.clear();
        self.found.clear();
        for group in std::mem::take(&mut self.let_go) {
            self.make_constant(groups, group);
        }
        scratch.end();
        self.scratch = scratch;
    }

    fn hang_differing(&mut self, groups: &mut Groups, differs: &BTreeMap<usize, Option<usize>>) {
        let mut to_hang = Vec::new();
        for &group in differs.keys() {
            let parent = self.link(groups, group, END);
            if parent != groups.parent(group) {
                to_hang.push((group, parent));
            }
        }
        // In between there is no circle either.
        to_hang.iter().for_each(|&(group, _)| groups.hang(group, None));
        to_hang.iter().for_each(|&(group, parent)| groups.hang(group, parent));
    }

    /// Hangs the groups of all groupings as they were before, then as these say, one after the other.
    fn hang_anew(&mut self, groups: &mut Groups) {
        let mut all = Vec::new();
        for (group, line) in self.lines.iter().enumerate() {
            let Some(line) = line.as_deref().filter(|line| !line.is_constant()) else { continue };
            groups.hang(group, None);
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
            // It is under none before all groupings then.
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
