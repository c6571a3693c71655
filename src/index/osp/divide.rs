//! Divides a full leaf over several commits. A new node takes all runs of the leaf as its straddlers, so queries find every
//! run as before. The following commits move these runs to the node's children.

use super::{
    index::Osp,
    layout::{Bucket, Link, OWN, Run},
    pool::NONE,
    tuning::{LEAF_RUNS, MOST_TAKEN},
};
use crate::{index::simd::Wide, math::Aabb};

/// Number of runs that every commit moves, if so many are queued: a page.
const MOVED_A_COMMIT: u32 = 16;
/// Number of further runs that a commit moves for each run that was inserted since the last commit.
const MOVED_FOR_EACH: u32 = 2;

/// Number of additional runs that a commit moves if no run was inserted since the last commit.
const MOVED_WHEN_IDLE: u32 = 32;

/// Numbers of polygons from which on scattered leaves may have more runs; see [`Osp::most_scattered`].
const SMALL: usize = 1 << 15;
const LARGE: usize = 1 << 16;

impl Osp {
    /// Replaces a leaf with too many runs by a node.
    /// * If its runs are scattered, the leaf is packed, and stays until it has [`Osp::most_scattered`] runs.
    /// * If most runs are short enough for a smaller cell, commits move them to the node's children.
    /// * If most runs are as long as the cell, the leaf stays until it has twice [`LEAF_RUNS`] runs. Then all its runs
    ///   become permanent straddlers of the node, and only later runs go to the children.
    ///
    /// Therefore at most twice [`LEAF_RUNS`] runs of a node are queued.
    pub(super) fn try_split(&mut self, head: u32) {
        let Bucket { slot, shift, runs, movable, .. } = self.buckets[head];
        let most = self.most_scattered();
        if slot == OWN || shift == 0 {
            self.buckets[head].split_at = u32::MAX;
        } else if runs < most && self.buckets[head].is_scattered() {
            self.buckets[head].split_at = most;
        } else if movable >= runs - runs / 2 {
            self.adopt(head);
            self.divide(head);
        } else if runs <= LEAF_RUNS * 2 {
            self.buckets[head].split_at = LEAF_RUNS * 2;
        } else {
            self.adopt(head);
        }
    }

    /// Largest number of runs of a scattered leaf before it is split. It grows with the model, because packing a leaf
    /// is a smaller part of the frame time of a large model.
    fn most_scattered(&self) -> u32 {
        match self.store.filed() {
            0..SMALL => LEAF_RUNS + LEAF_RUNS / 2,
            SMALL..LARGE => LEAF_RUNS * 2,
            _ => MOST_TAKEN as u32,
        }
    }

    /// Creates a node in place of a leaf.
    fn node_for(&mut self, head: u32) -> u32 {
        let Bucket { parent, slot, shift, .. } = self.buckets[head];
        let cell = self.cell_of_slot(parent, slot);
        let number = self.nodes.take();
        let node = &mut self.nodes[number];
        (node.shift, node.key, node.parent, node.slot) = (shift, cell, parent, slot);
        self.set_child(parent, slot, Link::node(number), &cell);
        self.shape += 1;
        number
    }

    fn adopt(&mut self, head: u32) {
        let number = self.node_for(head);
        self.nodes[number].own = head;
        let mut at = head;
        while at != NONE {
            let bucket = &mut self.buckets[at];
            (bucket.parent, bucket.slot, bucket.shift, bucket.split_at) = (number, OWN, 0, u32::MAX);
            at = bucket.next;
        }
    }

    /// Queues the runs of a node's list, to be moved to its children. Runs that are too long for the children return to the
    /// list.
    fn divide(&mut self, head: u32) {
        self.empty_first(head);
        let mut at = self.buckets[head].next;
        while at != NONE {
            self.buckets[at].drains = true;
            at = self.buckets[at].next;
        }
        self.buckets[head].divides = true;
        self.to_divide.push_back(head);
    }

    /// Moves some of the queued runs. `new_runs` is the number of runs inserted since the last commit.
    pub(super) fn divide_some(&mut self, new_runs: u32) {
        let mut left = MOVED_FOR_EACH.saturating_mul(new_runs).saturating_add(MOVED_A_COMMIT);
        if new_runs == 0 {
            left += MOVED_WHEN_IDLE;
        }
        while left > 0 {
            let Some(&head) = self.to_divide.front() else { return };
            match self.next_to_move(head) {
                Some(bucket) => left = left.saturating_sub(self.move_page_down(head, bucket)),
                None => _ = self.to_divide.pop_front(),
            }
        }
    }

    /// A bucket of the chain whose runs are queued; `None` if all have been moved, or if the chain no longer exists.
    fn next_to_move(&mut self, head: u32) -> Option<u32> {
        while self.buckets[head].divides {
            let mut at = self.buckets[head].next;
            while at != NONE && !self.buckets[at].drains {
                at = self.buckets[at].next;
            }
            if at == NONE {
                self.buckets[head].divides = false;
                // The chain may be empty now.
                self.settle_bucket(head);
                return None;
            }
            if self.buckets[at].page_count > 0 {
                return Some(at);
            }
            self.unlink_bucket(at);
        }
        None
    }

    /// Removes an empty bucket from its chain. The bucket must not be the first.
    fn unlink_bucket(&mut self, bucket: u32) {
        let Bucket { prev, next, .. } = self.buckets[bucket];
        self.buckets[prev].next = next;
        if next != NONE {
            self.buckets[next].prev = prev;
        }
        self.give_bucket(bucket);
    }

    /// Moves the runs of a bucket's last page to the leaves or lists where they belong now. Returns their number, at
    /// least 1.
    fn move_page_down(&mut self, head: u32, bucket: u32) -> u32 {
        let Bucket { pages, page_count, .. } = self.buckets[bucket];
        let page = pages[page_count as usize - 1];
        let (count, loose) = (usize::from(self.pages[page].runs), self.pages[page].loose);
        let mut runs = [(Run::NONE, Aabb::EMPTY); 16];
        for (lane, run) in runs.iter_mut().enumerate().take(count) {
            *run = self.pages[page].run(lane);
        }
        self.detach_page(page);
        self.release_page(page);
        let first = &mut self.buckets[head];
        first.runs -= count as u32;
        first.polygons -= runs.iter().map(|(run, _)| run.mask.count_ones()).sum::<u32>();
        for (lane, (run, bounds)) in runs.into_iter().enumerate().take(count) {
            let bounds = Wide::from_box(&bounds);
            self.insert_run(run, bounds, self.destination(bounds), loose >> lane & 1 == 1);
        }
        (count as u32).max(1)
    }
}
