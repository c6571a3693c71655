//! Under which group each group hung after every grouping that can still be taken back, and what changes when one of them is.
//!
//! The groups hang as all active groupings leave them, one after the other: one that would close a circle or make a chain too
//! long has no effect. So what a grouping does depends on those before it, and to take one back may change the outcome of any
//! that is later. [`Hangings::settle`] goes through time from that grouping on, and knows two courses: the one of before, which
//! is kept, and the one that comes about. It follows
//! * the groups that hang elsewhere in one course than in the other: they *differ*;
//! * all that hangs below these: only there does a way up lead elsewhere, so only groupings under those are *reached*;
//! * all that is *above* these: only there is a group higher or lower than it was.
//!
//! All other groupings have the outcome that they had, and are not looked at. It ends as soon as no group differs.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
    ops::Bound::{Excluded, Unbounded},
};

use super::{
    group::{Groups, MAX_GROUP_DEPTH},
    log::Turn,
};

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

/// What leads to a grouping that may have another outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Reason {
    /// The course was changed here.
    Edit,
    /// The group under which it hangs one is reached.
    Toward { group: usize, stamp: u64 },
    /// The group that it hangs is reached.
    Own { stamp: u64 },
    /// The group that it hangs is above one that differs.
    Above { mark: u64 },
}

/// Scratch of [`Hangings::settle`].
#[derive(Clone, Debug, Default)]
struct Scratch {
    /// Groups that hang elsewhere than in the course before, and where they hung in that.
    differs: BTreeMap<usize, Option<usize>>,
    /// For each group a number if it differs or is below one that does; else 0.
    reached: Vec<u64>,
    /// Those of which the number has been set.
    touched: Vec<usize>,
    last_stamp: u64,
    /// For each group the mark, if it has been above one that differs since no group did.
    above: Vec<u64>,
    mark: u64,
    /// Chains may become too long.
    minds_heights: bool,
    queue: BinaryHeap<Reverse<(Time, usize, Reason)>>,
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

    /// Goes through time; `false`: to hang all anew costs less than the rest of the way.
    fn walk_through(&mut self, groups: &Groups, scratch: &mut Scratch) -> bool {
        let edits = self.outdated.iter().map(|(&time, &(group, _))| (time, group));
        let edits = edits.chain(self.fresh.iter().map(|(&time, &group)| (time, group)));
        scratch.queue.extend(edits.map(|(time, group)| Reverse((time, group, Reason::Edit))));
        let most = self.steps + MAX_GROUP_DEPTH as u64 * (self.count as u64 + 64);
        let mut last = None;
        while let Some(Reverse((time, group, reason))) = scratch.queue.pop() {
            let is_valid = match reason {
                Reason::Edit => true,
                Reason::Toward { group, stamp } => scratch.reached[group] == stamp,
                Reason::Own { stamp } => scratch.reached[group] == stamp,
                Reason::Above { mark } => scratch.mark == mark,
            };
            if !is_valid {
                continue;
            }
            if last.replace(time) != Some(time) {
                self.steps += 1;
                self.pass(groups, scratch, time, group);
            }
            self.queue_next(scratch, time, group, reason);
            if self.steps > most {
                return false;
            }
        }
        true
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

    /// Where a group hangs after a time, in the course that comes about. Times may only grow in a walk.
    fn link(&mut self, groups: &Groups, group: usize, time: Time) -> Option<usize> {
        self.steps += 1;
        let walk = self.walk;
        let Some(line) =
            self.lines.get_mut(group).and_then(Option::as_mut).filter(|line| !line.is_constant())
        else {
            return groups.parent(group);
        };
        let (of, until, parent) = line.known;
        if of == walk && time < until {
            return parent;
        }
        let parent = line.held.range(..=time).next_back().and_then(|(_, &parent)| parent);
        let until = line.held.range((Excluded(time), Unbounded)).next().map_or(END, |(&until, _)| until);
        line.known = (walk, until, parent);
        parent
    }

    /// Takes what is hung at a time, in both courses.
    fn pass(&mut self, groups: &Groups, scratch: &mut Scratch, time: Time, group: usize) {
        let line = self.line(group);
        let held = line.and_then(|line| line.held.get(&time).copied());
        let refused = line.and_then(|line| line.refused.get(&time).copied());
        let (parent, is_fresh) = (held.or(refused.map(Some)), self.fresh.contains_key(&time));
        let held_before = held.is_some() && !is_fresh;
        let before = match line.filter(|line| !line.is_constant()) {
            Some(line) => line.before(time),
            None => groups.parent(group),
        };
        let before_of_old = scratch.differs.get(&group).copied().unwrap_or(before);
        let old = match self.outdated.get(&time) {
            Some(&(_, old)) => old,
            None if held_before => parent.flatten(),
            None => before_of_old,
        };
        let mut new = before;
        if let Some(parent) = parent {
            let is_asked = parent.is_some_and(|parent| scratch.reached[parent] > 0)
                || scratch.is_above(group)
                || is_fresh
                || (place_at(time).is_none() && self.outdated.contains_key(&time));
            let holds = match parent {
                Some(_) if before == parent => true,
                Some(to) if is_asked => self.can_hang(groups, scratch, group, to, time),
                Some(_) => held_before,
                None => true,
            };
            if holds != held_before {
                self.set_outcome(time, group, parent, holds);
            }
            if holds {
                new = parent;
            }
            self.note_significance(time, holds && before == parent);
        }
        if old == new {
            scratch.differs.remove(&group);
            scratch.mark += u64::from(scratch.differs.is_empty());
        } else {
            scratch.differs.insert(group, old);
        }
        if scratch.minds_heights && (old != new || scratch.is_above(group)) {
            self.mark_above(groups, scratch, new, time, false);
            self.mark_above(groups, scratch, old, time, true);
        }
        let was_reached = scratch.reached[group] > 0;
        let is_reached = old != new || new.is_some_and(|parent| scratch.reached[parent] > 0);
        if was_reached != is_reached {
            self.reach(groups, scratch, group, time, is_reached);
        }
    }

    /// Whether a group can hang under another one, at a time: not below itself, and in no chain that is too long.
    fn can_hang(
        &mut self,
        groups: &Groups,
        scratch: &Scratch,
        group: usize,
        parent: usize,
        time: Time,
    ) -> bool {
        let (mut depth, mut above) = (0, Some(parent));
        while let Some(at) = above {
            depth += 1;
            if depth >= MAX_GROUP_DEPTH || at == group {
                return false;
            }
            above = self.link(groups, at, time);
        }
        if !scratch.minds_heights {
            return true;
        }
        let (mut walk, mut below) = (vec![(group, depth + 1)], Vec::new());
        while let Some((at, depth)) = walk.pop() {
            if depth > MAX_GROUP_DEPTH {
                return false;
            }
            self.children(groups, at, time, &mut below);
            walk.extend(below.drain(..).map(|child| (child, depth + 1)));
        }
        true
    }

    /// The groups that hang under one after a time, in the course that comes about.
    fn children(&mut self, groups: &Groups, group: usize, time: Time, children: &mut Vec<usize>) {
        children.clear();
        children.extend(groups.children(group).filter(|&child| self.is_constant(child)));
        let first = children.len();
        children.extend(self.line(group).into_iter().flat_map(|line| line.from.keys()));
        let mut kept = first;
        for at in first..children.len() {
            if self.link(groups, children[at], time) == Some(group) {
                children[kept] = children[at];
                kept += 1;
            }
        }
        children.truncate(kept);
    }

    /// Marks a group and all above it, in the course of before or the one that comes about.
    fn mark_above(
        &mut self,
        groups: &Groups,
        scratch: &mut Scratch,
        from: Option<usize>,
        time: Time,
        of_old: bool,
    ) {
        let mut above = from;
        while let Some(at) = above
            && std::mem::replace(&mut scratch.above[at], scratch.mark) != scratch.mark
        {
            let mark = scratch.mark;
            self.queue_next(scratch, time, at, Reason::Above { mark });
            let link = self.link(groups, at, time);
            above = scratch.differs.get(&at).copied().filter(|_| of_old).unwrap_or(link);
        }
    }

    /// A group is reached from a time on, or is not any more, and with it those below.
    fn reach(&mut self, groups: &Groups, scratch: &mut Scratch, group: usize, time: Time, is_reached: bool) {
        let (mut walk, mut below) = (vec![group], Vec::new());
        while let Some(at) = walk.pop() {
            if is_reached {
                if scratch.reached[at] > 0 {
                    continue;
                }
                scratch.last_stamp += 1;
                let stamp = scratch.last_stamp;
                scratch.reached[at] = stamp;
                scratch.touched.push(at);
                self.queue_next(scratch, time, at, Reason::Own { stamp });
                self.queue_next(scratch, time, at, Reason::Toward { group: at, stamp });
            } else {
                scratch.reached[at] = 0;
            }
            self.children(groups, at, time, &mut below);
            // What differs is reached anyway.
            let differs = &scratch.differs;
            walk.extend(below.drain(..).filter(|child| is_reached || !differs.contains_key(child)));
        }
    }

    /// Queues what comes after a time for a reason, if anything does.
    fn queue_next(&self, scratch: &mut Scratch, time: Time, group: usize, reason: Reason) {
        let later = (Excluded(time), Unbounded);
        let next = match reason {
            Reason::Edit => None,
            Reason::Toward { group, .. } => self
                .line(group)
                .and_then(|line| line.toward.range(later).next().map(|(&time, &group)| (time, group))),
            Reason::Own { .. } => self
                .line(group)
                .and_then(|line| line.held.range(later).next().map(|(&time, _)| (time, group))),
            Reason::Above { .. } => self.line(group).and_then(|line| {
                let held = line.held.range(later).next().map(|(&time, _)| (time, group));
                let refused = line.refused.range(later).next().map(|(&time, _)| (time, group));
                held.into_iter().chain(refused).min()
            }),
        };
        scratch.queue.extend(next.map(|(time, group)| Reverse((time, group, reason))));
    }
}

impl Scratch {
    fn begin(&mut self, groups: usize) {
        self.mark += 1;
        self.reached.resize(groups, 0);
        self.above.resize(groups, 0);
        self.minds_heights = groups > MAX_GROUP_DEPTH;
    }

    fn end(&mut self) {
        for group in self.touched.drain(..) {
            self.reached[group] = 0;
        }
        self.differs.clear();
        self.queue.clear();
    }

    fn is_above(&self, group: usize) -> bool {
        self.above[group] == self.mark
    }
}

#[cfg(test)]
mod tests;
