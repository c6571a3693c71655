use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
};

use super::{super::group::MAX_GROUP_DEPTH, time::Time};

/// The reason why a grouping may have another effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    /// The grouping was added, removed or redone.
    Edit,
    /// The parent that the grouping sets is reached.
    Toward {
        group: usize,
    },
    Own,
    Above,
}

/// Scratch memory of [`GroupParents::settle`](super::GroupParents::settle).
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// The groups that differ, with their parents on the old timeline.
    pub(super) differs: BTreeMap<usize, Option<usize>>,
    /// The `mark` at which each group was last reached. A group with the current `mark` is reached.
    pub(super) reached: Vec<u64>,
    /// The `mark` at which each group was last above.
    pub(super) above: Vec<u64>,
    /// Number that increases when a walk begins, and whenever no group differs any more.
    pub(super) mark: u64,
    /// Whether there are enough groups to exceed the nesting limit.
    pub(super) checks_depth_limit: bool,
    /// The groupings to visit, each with the `mark` at which it was queued. Entries with an older mark are skipped,
    /// unless their reason is [`Reason::Edit`].
    pub(super) queue: BinaryHeap<Reverse<(Time, usize, Reason, u64)>>,
}

impl Scratch {
    pub(super) fn begin(&mut self, groups: usize) {
        self.mark += 1;
        self.reached.resize(groups, 0);
        self.above.resize(groups, 0);
        self.checks_depth_limit = groups > MAX_GROUP_DEPTH;
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
