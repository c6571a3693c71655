//! The walk along the timeline that finds the groupings whose effect has changed.

use std::{
    cmp::Reverse,
    ops::Bound::{Excluded, Unbounded},
};

use super::{
    super::group::{Groups, MAX_GROUP_DEPTH},
    GroupParents,
    scratch::{Reason, Scratch},
    time::{END, Time, place_at},
};

impl GroupParents {
    /// Processes the queued groupings in order of time. Returns `false` if rebuilding all parents costs less
    /// than the rest of the walk.
    pub(super) fn walk_through(&mut self, groups: &Groups, scratch: &mut Scratch) -> bool {
        let edits = self.outdated.iter().map(|(&time, &(group, _))| (time, group));
        let edits = edits.chain(self.fresh.iter().map(|(&time, &group)| (time, group)));
        scratch.queue.extend(edits.map(|(time, group)| Reverse((time, group, Reason::Edit, 0))));
        let most = self.steps + MAX_GROUP_DEPTH as u64 * (self.count as u64 + 64);
        let mut last = None;
        while let Some(Reverse((time, group, reason, mark))) = scratch.queue.pop() {
            if reason != Reason::Edit && mark != scratch.mark {
                continue;
            }
            if last.replace(time) != Some(time) {
                self.steps += 1;
                self.apply_entries_at(groups, scratch, time, group);
            }
            if reason != Reason::Edit && mark == scratch.mark {
                self.queue_next(scratch, time, group, reason);
            }
            if self.steps > most {
                return false;
            }
        }
        true
    }
    /// The parent of a group after `time`, on the new timeline. Times must not decrease within a walk.
    pub(super) fn link(&mut self, groups: &Groups, group: usize, time: Time) -> Option<usize> {
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

    /// Applies the entries that have this time to the old and the new timeline.
    fn apply_entries_at(&mut self, groups: &Groups, scratch: &mut Scratch, time: Time, group: usize) {
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
            let is_asked = parent.is_some_and(|parent| scratch.is_reached(parent))
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
        if scratch.checks_depth_limit && (old != new || scratch.is_above(group)) {
            self.mark_above(groups, scratch, new, time, false);
            self.mark_above(groups, scratch, old, time, true);
        }
        if old != new || new.is_some_and(|parent| scratch.is_reached(parent)) {
            self.reach(groups, scratch, group, time);
        }
    }

    /// Whether a group can get this parent at `time`, without a cycle and without exceeding the nesting depth.
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
        if !scratch.checks_depth_limit {
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

    /// Lists the children of a group after `time`, on the new timeline.
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

    /// Marks a group and its ancestors as above, on the old or the new timeline.
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
            self.queue_next(scratch, time, at, Reason::Above);
            let link = self.link(groups, at, time);
            above = scratch.differs.get(&at).copied().filter(|_| of_old).unwrap_or(link);
        }
    }

    /// Marks a group and its descendants as reached from `time` on.
    fn reach(&mut self, groups: &Groups, scratch: &mut Scratch, group: usize, time: Time) {
        let (mut walk, mut below) = (vec![group], Vec::new());
        while let Some(at) = walk.pop() {
            if std::mem::replace(&mut scratch.reached[at], scratch.mark) == scratch.mark {
                continue;
            }
            self.queue_next(scratch, time, at, Reason::Own);
            self.queue_next(scratch, time, at, Reason::Toward { group: at });
            self.children(groups, at, time, &mut below);
            walk.append(&mut below);
        }
    }

    /// Queues the next grouping after `time` to which the reason applies, if there is one.
    fn queue_next(&self, scratch: &mut Scratch, time: Time, group: usize, reason: Reason) {
        let later = (Excluded(time), Unbounded);
        let next = match reason {
            Reason::Edit => None,
            Reason::Toward { group } => self
                .line(group)
                .and_then(|line| line.toward.range(later).next().map(|(&time, &group)| (time, group))),
            Reason::Own => self
                .line(group)
                .and_then(|line| line.held.range(later).next().map(|(&time, _)| (time, group))),
            Reason::Above => self.line(group).and_then(|line| {
                let held = line.held.range(later).next().map(|(&time, _)| (time, group));
                let refused = line.refused.range(later).next().map(|(&time, _)| (time, group));
                held.into_iter().chain(refused).min()
            }),
        };
        let mark = scratch.mark;
        scratch.queue.extend(next.map(|(time, group)| Reverse((time, group, reason, mark))));
    }
}
