use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
};

use super::{super::group::MAX_GROUP_DEPTH, time::Time};

/// Why a grouping may have another outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    /// The timeline was edited here.
    Edit,
    /// The parent that it sets is reached.
    Toward { group: usize },
    /// The group that it moves is reached.
    Own,
    /// The group that it moves is above one that differs.
    Above,
}

/// Scratch of [`Hangings::settle`](super::Hangings::settle).
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// The groups that differ, with their parents on the old timeline.
    pub(super) differs: BTreeMap<usize, Option<usize>>,
    /// The `mark` at which each group was last reached. A group stays reached until no group differs.
    pub(super) reached: Vec<u64>,
    /// The `mark` at which each group was last above one that differs.
    pub(super) above: Vec<u64>,
    /// Grows when a walk begins, and whenever no group differs.
    pub(super) mark: u64,
    /// There are enough groups for a chain that is too long.
    pub(super) minds_heights: bool,
    /// Each with the `mark` at which it was queued. Entries with an older mark are skipped, but for edits.
    pub(super) queue: BinaryHeap<Reverse<(Time, usize, Reason, u64)>>,
}

impl Scratch {
    pub(super) fn begin(&mut self, groups: usize) {
        self.mark += 1;
        self.reached.resize(groups, 0);
        self.above.resize(groups, 0);
        self.minds_heights = groups > MAX_GROUP_DEPTH;
    }

    pub(super) fn end(&mut self) {
        self.differs.clear();
        self.queue.clear();
    }

    pub(super) fn is_reached(&self, group: usize) -> bool {
        self.reached[group] == self.mark
    }

    pub(super) fn is_above(&self, group: usize) -> bool {
        self.above[group] == self.mark
    }
}
