//! Moves polygons between the tree and the flat rows. The rows contain polygons that move in frame after frame, and
//! polygons of a plain list that becomes a tree. Polygons return to the tree when they have not moved for a while, so a
//! caller need not declare which polygons will move.

use super::{index::Osp, linear::Inserted, open::OpenBlock, tuning::RESTING_COMMITS};
use crate::{
    index::simd::Wide,
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

/// Number of groups that a commit examines for unmoved polygons. With a larger number, unmoved polygons return sooner,
/// and frames in which they return take longer.
const GROUPS_A_COMMIT: usize = 2;
/// A commit also examines this fraction of all groups: 1 / `GROUPS_SHARE`.
const GROUPS_SHARE: usize = 512;

/// A commit returns about this number of runs, and one more for every [`RUNS_SHARE`] polygons in the rows. So it takes at
/// most a third longer than the test of the rows.
const RUNS_A_COMMIT: u32 = 8;
const RUNS_SHARE: usize = 500;

/// Number of additional runs of a former plain list that a commit moves to the tree. It also moves one run for each run
/// inserted since the last commit. With a larger number, the rows are empty sooner, and the frames until then take
/// longer.
const RUNS_WITH_MORE: u32 = 12;
/// Number of runs of a former plain list that a commit moves if no run was inserted since the last commit.
const RUNS_ALONE: u32 = 48;

/// Largest number of groups that such a commit examines, in addition to one for each inserted run.
const GROUPS_WAITING: usize = 8;

impl Osp {
    /// Moves polygons of the tree or the open block to the flat rows.
    pub(super) fn move_to_rows(&mut self, block: u32, lanes: u16, boxes: &[Wide; BLOCK]) {
        self.churn.begun += lanes.count_ones();
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

    /// Returns a bounded number of unmoved polygons to the tree. `new_runs` is `Osp::new_runs`: the number of runs or
    /// polygons inserted since the last commit.
    pub(super) fn settle(&mut self, new_runs: u32) {
        self.clock = self.clock.wrapping_add(1);
        if self.movers.len() == 0 {
            if std::mem::take(&mut self.is_settling) {
                self.movers.swap_memory(self.linear.rows_mut());
            }
            return;
        }
        self.movers.commit();
        if self.churn.keeps_rows {
            return;
        }
        if self.movers.is_round_over() {
            if self.clock.wrapping_sub(self.round) < RESTING_COMMITS {
                return;
            }
            self.round = self.clock;
            self.movers.begin_round();
        }
        if (self.clock.wrapping_sub(self.next_return) as i32) < 0 {
            return;
        }
        let runs = RUNS_A_COMMIT + (self.movers.len() / RUNS_SHARE) as u32;
        let (groups, runs) = match (self.is_settling, new_runs) {
            (false, _) => (GROUPS_A_COMMIT + new_runs as usize / BLOCK, runs),
            (true, 0) => (GROUPS_WAITING, RUNS_ALONE),
            (true, _) => (GROUPS_WAITING + new_runs as usize, new_runs.saturating_add(RUNS_WITH_MORE)),
        };
        let returned = self.return_resting(groups + self.movers.group_count() / GROUPS_SHARE, runs);
        // Whole groups return. If this commit has exceeded its limit, the next commits pause.
        self.next_return = self.clock.wrapping_add(returned / runs.max(1));
    }

    /// Returns the unmoved polygons of the next groups to the tree, until at least `runs` runs have returned. Returns their
    /// number.
    fn return_resting(&mut self, groups: usize, runs: u32) -> u32 {
        let mut returned = 0;
        for _ in 0..groups {
            if returned >= runs {
                break;
            }
            if self.movers.is_round_over() {
                // Polygons that still move stay in the rows.
                self.is_settling &= self.movers.len() == 0;
                break;
            }
            let mut resting = [(PolygonId(0), Aabb::EMPTY); BLOCK];
            let count = self.movers.take_resting(&mut resting);
            let (was_linear, before) = (self.is_linear, self.new_runs);
            self.return_to_tree(&resting[..count]);
            if was_linear != self.is_linear {
                // The list was full and became a tree. This is enough work, and `new_runs` has another unit now.
                return runs;
            }
            returned += self.new_runs - before;
        }
        returned
    }

    /// Inserts polygons that were in the flat rows into the tree or the list.
    fn return_to_tree(&mut self, resting: &[(PolygonId, Aabb)]) {
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
