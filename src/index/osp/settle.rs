//! Moves polygons between the tree and the flat rows beside it. The rows contain polygons that move in frame after
//! frame, and polygons of a plain list that becomes a tree. Polygons return to the tree when they have not moved for a
//! while, so a caller need not declare which polygons will move.

use super::{index::Osp, linear::Inserted, open::OpenBlock, tuning::RESTING_COMMITS};
use crate::{
    index::simd::Wide,
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

/// A commit examines this number of groups for unmoved polygons, and in addition one of every [`GROUPS_SHARE`] groups.
/// With larger numbers, unmoved polygons return sooner, and frames in which they return take longer.
const GROUPS_A_COMMIT: usize = 2;
const GROUPS_SHARE: usize = 512;

/// While polygons of a former plain list wait for the tree, a commit moves about this number of their runs to the tree.
/// It moves one more for each run that was inserted since the last commit. If none was inserted, it moves
/// [`RUNS_ALONE`]. With larger numbers, the rows are empty sooner, and the frames until then take longer.
const RUNS_WITH_MORE: u32 = 12;
const RUNS_ALONE: u32 = 48;

/// Largest number of groups that such a commit examines, in addition to one for each inserted run.
const GROUPS_WAITING: usize = 8;

impl Osp {
    /// Moves polygons of the tree or the open block to the flat rows.
    pub(super) fn take_in(&mut self, block: u32, lanes: u16, boxes: &[Wide; BLOCK]) {
        let mut left = lanes;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % BLOCK;
            left &= left - 1;
            let id = PolygonId(block * BLOCK as u32 + lane as u32);
            self.take_out(id);
            self.movers.insert(id, &boxes[lane].to_box());
            self.upkeep.inserted += 1;
        }
    }

    /// Returns a bounded number of unmoved polygons to the tree. `new_runs` is `Osp::new_runs`: the number of runs or polygons
    /// inserted since the last commit.
    pub(super) fn settle(&mut self, new_runs: u32) {
        self.clock = self.clock.wrapping_add(1);
        if self.movers.len() == 0 {
            if std::mem::take(&mut self.is_settling) {
                self.movers.give_boxes_back();
            }
            return;
        }
        if self.movers.is_round_over() {
            if self.clock.wrapping_sub(self.round) < RESTING_COMMITS {
                return;
            }
            self.round = self.clock;
            self.movers.begin_round();
        }
        let (groups, runs) = match (self.is_settling, new_runs) {
            (false, _) => (GROUPS_A_COMMIT + new_runs as usize / BLOCK, u32::MAX),
            (true, 0) => (GROUPS_WAITING, RUNS_ALONE),
            (true, _) => (GROUPS_WAITING + new_runs as usize, new_runs.saturating_add(RUNS_WITH_MORE)),
        };
        let last_run = self.new_runs.saturating_add(runs);
        for _ in 0..groups + self.movers.group_count() / GROUPS_SHARE {
            if self.new_runs >= last_run {
                return;
            }
            if self.movers.is_round_over() {
                // Polygons that still move stay in the rows.
                self.is_settling &= self.movers.len() == 0;
                return;
            }
            let mut resting = [(PolygonId(0), Aabb::EMPTY); BLOCK];
            let count = self.movers.take_resting(&mut resting);
            self.put_back(&resting[..count]);
        }
    }

    /// Inserts polygons that were in the flat rows into the tree or the list.
    fn put_back(&mut self, resting: &[(PolygonId, Aabb)]) {
        for of_block in resting.chunk_by(|(a, _), (b, _)| a.0 / 16 == b.0 / 16) {
            let number = of_block[0].0.0 / 16;
            let is_apart = of_block.len() > 1 && !self.is_linear && !self.open.is(number);
            let mut block = OpenBlock::new();
            block.begin(number, self.ids.in_tree(number));
            for (id, bounds) in of_block {
                let bounds = Wide::from_box(bounds);
                self.upkeep.inserted += 1;
                if is_apart {
                    // The block that is being drawn stays open.
                    block.add(id.index() % BLOCK, bounds);
                    self.len += 1;
                } else if !self.put_into_list(*id, bounds) {
                    self.put(number, id.index() % BLOCK, bounds);
                }
            }
            if is_apart {
                self.insert_block(&block);
            }
        }
    }

    /// Inserts a polygon into the plain list. Returns `false` if the index has no list or the list is full.
    fn put_into_list(&mut self, id: PolygonId, bounds: Wide) -> bool {
        if !self.is_linear {
            return false;
        }
        match self.linear.insert(id.0, &bounds.to_box(), self.list_blocks) {
            Inserted::Full => self.make_tree(),
            _ => self.len += 1,
        }
        self.is_linear
    }
}
