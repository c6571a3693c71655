//! Polygons that change a little where they are: the last ones of a stroke that is being smoothed, things that move slowly.

use super::{grid, index::Osp, tuning::RUN_STRETCH};
use crate::{index::simd::Wide, polygon::PolygonId};

impl Osp {
    /// Gives a polygon in the tree another box without taking it out of its run. False, and nothing is changed, if the
    /// run with that box would be put in another leaf, or would be longer than [`RUN_STRETCH`] allows a new one to be.
    pub(super) fn adjust(&mut self, id: PolygonId, bounds: Wide) -> bool {
        let Some(place) = self.ids.place(id.0) else { return false };
        let (page_number, lane) = (place / 16, place as usize % 16);
        let (run, _) = self.pages.run(page_number, lane);
        let mut run_box = bounds;
        if !run.is_exact() {
            let others = run.lanes() & !(1 << (id.0 % 16));
            let boxes = self.ids.boxes(run.store);
            run_box = run_box.union(Wide::from_box(&boxes.around(u32::from(others))));
            let mut most_m = bounds.length();
            let mut left = others;
            while left != 0 {
                most_m += Wide::from_box(&boxes.get(left.trailing_zeros() as usize)).length();
                left &= left - 1;
            }
            if run_box.length() > most_m * RUN_STRETCH {
                return false;
            }
        }
        let bucket_number = self.pages[page_number].bucket;
        let head = self.chain_head(bucket_number);
        if self.leaf_for(run_box) != Some(head) {
            return false;
        }
        if !run.is_exact() {
            self.ids.boxes_mut(run.store).set_wide(id.index() % 16, bounds);
        }
        self.upkeep.boxes += 1;
        let loose = self.pages[page_number].loose & (1 << lane);
        self.pages.set_run(page_number, lane, run, &run_box.to_box());
        // A run that has only one polygon left still waits to be made one.
        self.pages[page_number].loose |= loose;
        let at = usize::from(self.pages[page_number].at);
        let bucket = &mut self.buckets[bucket_number];
        if bucket.boxes.widen(at, &run_box.to_box()) {
            bucket.refresh();
            let widened = bucket.bounds.to_box();
            self.widen_above(head, &widened);
            self.upkeep.boxes += 1;
        }
        // The boxes above may be too wide now.
        self.queue_page(page_number);
        self.removals += 1;
        true
    }

    /// The leaf, or list of straddlers, where a run with this box would be put, if it is there.
    fn leaf_for(&self, bounds: Wide) -> Option<u32> {
        let top = &self.nodes[self.top];
        let is_inside = self.is_flat || grid::same_cell(&top.key, &self.grid.key(bounds), top.shift);
        is_inside.then(|| self.way(bounds).bucket)
    }
}
