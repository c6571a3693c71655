//! Updates boxes of moving objects, and of the last pieces of a stroke that is being smoothed.
//! Polygons that move together mostly lie in the same runs. All new boxes of a run are therefore applied at once, and
//! the run moves to another leaf as a whole.

use super::{
    announce::{LEAST, TOGETHER},
    grid,
    index::Osp,
    layout::Run,
    tuning::RUN_STRETCH,
};
use crate::{
    index::{IndexError, SpatialIndex, simd::Wide},
    math::Aabb,
    polygon::PolygonId,
};

/// New boxes for polygons of one block of sixteen ids.
#[derive(Clone, Copy)]
struct Moved {
    /// Mask of the polygons with a new box.
    lanes: u16,
    boxes: [Wide; 16],
}

impl Moved {
    const NONE: Self = Self { lanes: 0, boxes: [Wide::EMPTY; 16] };

    fn set(&mut self, lane: usize, bounds: Wide) {
        self.lanes |= 1 << lane;
        self.boxes[lane % 16] = bounds;
    }
}

impl Osp {
    /// Implements [`SpatialIndex::update_all`]. Updates the polygons of the
    /// tree block by block.
    pub(super) fn update_blocks(&mut self, mut updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        while self.is_linear {
            let mut moved = self.movers.update_first(updates);
            moved += self.linear.update_first(&updates[moved..]);
            self.upkeep.adjusted += moved as u64;
            updates = &updates[moved..];
            let Some((id, bounds)) = updates.first() else { return };
            if moved == 0 {
                refused.extend(self.update(*id, bounds).err());
                updates = &updates[1..];
            }
        }
        if self.moves_most(updates) {
            self.move_all_to_rows();
        }
        let is_worth_it = updates.len() >= LEAST;
        // Number of blocks whose memory has been prefetched.
        let mut ahead = 0_usize;
        loop {
            let moved = self.movers.update_first(updates);
            self.upkeep.adjusted += moved as u64;
            updates = &updates[moved..];
            let Some(&(PolygonId(first), _)) = updates.first() else { return };
            if is_worth_it && ahead == 0 {
                // The memory of many blocks is prefetched together, before it is used.
                let blocks = updates.chunk_by(|(a, _), (b, _)| a.0 / 16 == b.0 / 16).take(TOGETHER);
                let firsts = blocks.filter_map(|updates| updates.first()).map(|(id, _)| id.0);
                let in_tree = firsts.filter(|&id| self.movers.slot(PolygonId(id)).is_none());
                self.prefetch_blocks(in_tree.inspect(|_| ahead += 1));
            }
            let end = updates.iter().position(|(id, _)| id.0 / 16 != first / 16).unwrap_or(updates.len());
            let (of_block, rest) = updates.split_at(end);
            self.update_block(of_block, refused);
            (updates, ahead) = (rest, ahead.saturating_sub(1));
        }
    }

    /// Sets new boxes of polygons of one block; the last update of a polygon counts. Appends the errors of refused updates.
    fn update_block(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        let Some(&(PolygonId(first), _)) = updates.first() else { return };
        let block = first / 16;
        let (in_tree, open) = (self.ids.in_tree(block), self.open_lanes(block));
        let mut moved = Moved::NONE;
        for &(id, ref bounds) in updates {
            let (lane, wide) = (id.index() % 16, Wide::from_box(bounds));
            if let Some(slot) = self.movers.slot(id) {
                if wide.is_valid() {
                    self.movers.set(slot, bounds);
                    self.upkeep.adjusted += 1;
                } else {
                    refused.push(IndexError::InvalidBounds(id));
                }
            } else if (in_tree | open) >> lane & 1 == 0 {
                refused.push(IndexError::Unknown(id));
            } else if !wide.is_valid() {
                refused.push(IndexError::InvalidBounds(id));
            } else if open >> lane & 1 == 1 {
                self.update_open(lane, wide);
            } else {
                moved.set(lane, wide);
            }
        }
        self.move_block(block, &moved);
    }

    /// Sets a new box of a polygon in the open block.
    pub(super) fn update_open(&mut self, lane: usize, bounds: Wide) {
        self.open.add(lane, bounds);
        self.removals += 1;
        self.upkeep.inserted += 1;
    }

    /// Replaces the box of one polygon in a run.
    pub(super) fn move_one(&mut self, id: PolygonId, bounds: Wide) {
        let mut moved = Moved::NONE;
        moved.set(id.index() % 16, bounds);
        self.move_block(id.0 / 16, &moved);
    }

    /// Sets new boxes of polygons in runs, run by run.
    fn move_block(&mut self, block: u32, moved: &Moved) {
        let is_churned = self.is_churned();
        if moved.lanes != 0 && self.ids.is_hot(block, self.clock as u8) || is_churned || self.has_burst() {
            self.move_to_rows(block, moved.lanes, &moved.boxes);
            if is_churned {
                self.move_all_to_rows();
            }
            return;
        }
        let mut left = moved.lanes;
        while left != 0 {
            let first = block * 16 + left.trailing_zeros();
            let Some(place) = self.ids.place(first) else { return };
            let (run, _) = self.pages.run(place / 16, place as usize % 16);
            let lanes = left & run.lanes();
            // The polygon's own lane is cleared in any case, so that the loop ends.
            left &= !(lanes | 1 << left.trailing_zeros());
            if !self.move_run(place, run, lanes, &moved.boxes) {
                self.move_to_open_block(block, lanes, &moved.boxes);
            }
        }
    }

    /// Sets new boxes of the polygons `lanes` of a run. Moves the whole run if it belongs to another leaf. Returns `false`
    /// without a change if the run would become longer than [`RUN_STRETCH`] allows.
    fn move_run(&mut self, place: u32, run: Run, lanes: u16, boxes: &[Wide; 16]) -> bool {
        let Some(bounds) = self.run_box_with(run, lanes, boxes) else { return false };
        if !run.is_exact() {
            let store = self.ids.boxes_mut(run.store);
            for_each_lane(lanes, |lane| store.set_wide(lane, boxes[lane]));
        }
        self.upkeep.boxes += 1;
        self.churn.edits += 1;
        let count = lanes.count_ones();
        self.removals += count;
        let head = self.chain_head(self.pages[place / 16].bucket);
        let target = self.destination(bounds);
        let top = &self.nodes[self.top];
        let is_inside = self.is_flat || grid::same_cell(&top.key, &target.key, top.shift);
        if is_inside && target.bucket == head {
            self.upkeep.adjusted += u64::from(count);
            self.set_run_box(place, head, bounds);
            return true;
        }
        self.upkeep.inserted += u64::from(count);
        (self.changes, self.new_runs) = (self.changes + 1, self.new_runs + 1);
        let is_loose = self.pages[place / 16].loose >> (place % 16) & 1 == 1;
        self.take_run_out(place, run, head);
        self.insert_run(run, bounds, target, is_loose);
        true
    }

    /// The box of a run after some of its polygons got new boxes; `None` if it is longer than [`RUN_STRETCH`] allows.
    fn run_box_with(&self, run: Run, lanes: u16, boxes: &[Wide; 16]) -> Option<Wide> {
        let (mut around, mut most_m) = (Wide::EMPTY, 0.0);
        for_each_lane(lanes, |lane| {
            around = around.union(boxes[lane]);
            most_m += boxes[lane].length();
        });
        let others = run.lanes() & !lanes;
        if others != 0 {
            let store = self.ids.boxes(run.store);
            around = around.union(Wide::from_box(&store.around(u32::from(others))));
            for_each_lane(others, |lane| most_m += Wide::from_box(&store.get(lane)).length());
        }
        let is_short = run.is_exact() || around.length() <= most_m * RUN_STRETCH;
        is_short.then_some(around)
    }

    /// Sets the box of a run that stays in its leaf. The boxes above the run may then be too large, so its page is queued
    /// for upkeep.
    fn set_run_box(&mut self, place: u32, head: u32, bounds: Wide) {
        let narrow = bounds.to_box();
        self.pages.set_box(place / 16, place as usize % 16, &narrow);
        let page = &self.pages[place / 16];
        if self.buckets[page.bucket].widen(usize::from(page.at), &narrow) {
            self.widen_above(head, &narrow);
            self.upkeep.boxes += 1;
        }
        self.queue_page(place / 16);
    }

    /// Moves polygons from their runs to the open block, with new boxes.
    fn move_to_open_block(&mut self, block: u32, lanes: u16, boxes: &[Wide; 16]) {
        for_each_lane(lanes, |lane| {
            self.upkeep.inserted += 1;
            self.take_out(PolygonId(block * 16 + lane as u32));
            self.put(block, lane, boxes[lane]);
        });
    }
}

/// Calls `act` with the number of each bit that is set.
#[inline(always)]
fn for_each_lane(mask: u16, mut act: impl FnMut(usize)) {
    let mut left = mask;
    while left != 0 {
        act(left.trailing_zeros() as usize % 16);
        left &= left - 1;
    }
}
