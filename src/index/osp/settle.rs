//! Which polygons are kept in flat rows beside the tree: those that move in frame after frame. They go back when they have
//! rested. A caller need not tell which will move.

use super::{index::Osp, linear::Inserted};
use crate::{
    index::simd::Wide,
    polygon::{BLOCK, PolygonId},
};

/// Commits that a polygon rests at least before it goes back to the tree.
const REST: u32 = 32;

/// Groups that a commit looks at for polygons that rest: so many, and a share of all. More: what rests is back sooner, and
/// frames in which it goes back are longer.
const GROUPS_A_COMMIT: usize = 2;
const GROUPS_SHARE: usize = 512;

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
            self.upkeep.filed += 1;
        }
    }

    /// Puts a bounded number of polygons that have rested back.
    pub(super) fn settle(&mut self) {
        self.clock = self.clock.wrapping_add(1);
        if self.movers.len() == 0 {
            return;
        }
        if self.movers.is_round_over() {
            if self.clock.wrapping_sub(self.round) < REST {
                return;
            }
            self.round = self.clock;
            self.movers.begin_round();
        }
        for _ in 0..GROUPS_A_COMMIT + self.movers.group_count() / GROUPS_SHARE {
            if self.movers.is_round_over() {
                return;
            }
            let (resting, count) = self.movers.next_resting();
            for &id in &resting[..count] {
                if let Some(bounds) = self.movers.remove(id) {
                    self.put_back(id, Wide::from_box(&bounds));
                }
            }
        }
    }

    fn put_back(&mut self, id: PolygonId, bounds: Wide) {
        if self.is_linear {
            match self.linear.insert(id.0, bounds, self.linear_blocks) {
                Inserted::Full => self.make_tree(),
                _ => {
                    self.len += 1;
                    return;
                }
            }
        }
        self.put(id.0 / BLOCK as u32, id.index() % BLOCK, bounds);
        self.upkeep.filed += 1;
    }
}
