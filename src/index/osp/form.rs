//! Converts the plain list to the tree, and the tree to the plain list.

use super::{
    index::{AT_ONCE, CHANGES_BETWEEN, Osp},
    linear::{Inserted, Linear},
    pool::NONE,
    tuning::{RESTING_COMMITS, SCATTERED_FACTOR},
};
use crate::{
    math::Aabb,
    polygon::{BLOCK, PolygonId, ids_of},
};

/// The tree becomes a plain list again when it has fewer blocks than the list's limit divided by this number. Because of
/// this gap, erasing and drawing at the limit does not convert again and again.
const BACK_TO_LINEAR: usize = 2;

impl Osp {
    /// Whether the tree has so few blocks that it should be a plain list.
    pub(super) fn is_small(&self) -> bool {
        self.ids.blocks() + self.movers.group_count() < self.linear_blocks / BACK_TO_LINEAR
    }

    /// Inserts a polygon into the full plain list, if the list's limit may rise. The limit rises as long as the
    /// polygons are scattered and few are inserted in a frame.
    #[inline(never)]
    pub(super) fn insert_into_full_list(&mut self, id: PolygonId, bounds: &Aabb) -> Inserted {
        let may_be_longer =
            self.list_blocks < self.linear_blocks.saturating_mul(SCATTERED_FACTOR) && self.new_runs < AT_ONCE;
        if may_be_longer && self.movers.len() == 0 && self.linear.is_scattered() {
            self.list_blocks = self.list_blocks.saturating_add(self.linear_blocks);
        }
        self.linear.insert(id.0, bounds, self.list_blocks)
    }

    /// Makes a tree from the plain list. The blocks become flat rows, and later commits insert them step by step. If
    /// the flat rows are not empty, the blocks are inserted now.
    #[inline(never)]
    pub(super) fn make_tree(&mut self) {
        (self.is_linear, self.list_blocks) = (false, self.linear_blocks);
        // For the list, `new_runs` counts polygons; sixteen polygons make about one run.
        self.new_runs = self.new_runs.div_ceil(BLOCK as u32);
        if self.linear.move_to(&mut self.movers) {
            self.len = 0;
            self.is_settling = true;
        }
        let mut linear = std::mem::replace(&mut self.linear, Linear::with_room_for(0, 0));
        for (number, lanes, boxes) in linear.rows().blocks() {
            self.open.begin_with(number, lanes, boxes);
            self.close_block();
        }
        linear.clear();
        self.linear = linear;
        self.changes = CHANGES_BETWEEN;
        // Later commits move resting polygons to the tree.
        self.round = self.clock.wrapping_sub(RESTING_COMMITS);
    }

    /// Moves all polygons from the tree to the plain list. The tree is a single small list of runs.
    #[inline(never)]
    pub(super) fn make_linear(&mut self) {
        // The open block is read instead of closed, because closing it could build a tree from the list of runs.
        for id in ids_of(self.open.block() as usize, self.open.lanes()) {
            self.linear.insert(id.0, &self.open.bounds(id.index() % BLOCK), usize::MAX);
        }
        let mut at = self.nodes[self.top].own;
        while at != NONE {
            let bucket = &self.buckets[at];
            for &page in &bucket.pages[..bucket.page_count as usize] {
                for lane in 0..usize::from(self.pages[page].runs) {
                    let (run, bounds) = self.pages.run(page, lane);
                    for id in ids_of(run.first as usize / BLOCK, run.lanes()) {
                        let own = if run.is_exact() {
                            bounds
                        } else {
                            self.ids.boxes(run.store).get(id.index() % BLOCK)
                        };
                        self.linear.insert(id.0, &own, usize::MAX);
                    }
                }
            }
            at = bucket.next;
        }
        self.clear_tree();
        (self.is_linear, self.churn.keeps_rows) = (true, false);
    }
}
