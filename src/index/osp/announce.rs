//! Prefetches the memory that changes will touch. Erased and inserted polygons lie anywhere in the tree, so each change
//! would wait for a dozen cache lines, one after the other. If the lines of many changes are prefetched together, they
//! arrive in parallel. Only a `Pipeline` calls this, because it gets all changes of a frame at once.

use super::{index::Osp, pool::NONE};
use crate::{
    index::simd::{Halves, prefetch_lines},
    polygon::{Change, Geometry, PolygonId},
};

/// Number of changes, or of blocks of changes, whose memory is prefetched together.
pub(super) const TOGETHER: usize = 16;

/// Least number of changes for which prefetching is worth it.
pub(super) const LEAST: usize = 4;

impl Osp {
    /// Prefetches the memory of these changes if they lie far apart. The changes of a stroke being drawn touch few cache
    /// lines, which are in the cache already.
    pub(super) fn prefetch(&self, geometry: &dyn Geometry, changes: &[Change]) {
        // A batch of updates only is skipped, because `update_blocks` prefetches its memory itself.
        let are_together = || changes.iter().all(|change| matches!(change, Change::Update(_)));
        if changes.len() < LEAST || self.is_linear || are_together() {
            return;
        }
        for changes in changes.chunks(TOGETHER) {
            let mut places = [NONE; TOGETHER];
            let mut last = NONE;
            let apart = changes.iter().filter(|change| {
                let Some(id) = id_of(**change) else { return false };
                std::mem::replace(&mut last, id.0 / 16) != id.0 / 16
            });
            if apart.count() < LEAST {
                continue;
            }
            for id in changes.iter().filter_map(|change| id_of(*change)) {
                self.ids.prefetch(id.0 / 16);
            }
            // The box of an inserted polygon determines its leaf.
            for (place, change) in places.iter_mut().zip(changes) {
                match *change {
                    Change::Insert(id) => {
                        *place = self.bucket_for(&geometry.bounds(id));
                        prefetch_lines::<2, _>(self.buckets.place(*place));
                    }
                    Change::Remove(id) | Change::Update(id) => {
                        *place = self.ids.place(id.0).unwrap_or(NONE);
                        if *place != NONE {
                            self.pages.prefetch(*place / 16, (*place % 16) as u8);
                        }
                    }
                    Change::Repaint(_) | Change::Place(_) => {}
                }
            }
            for (place, change) in places.iter().zip(changes).filter(|(place, _)| **place != NONE) {
                match *change {
                    Change::Insert(_) => self.prefetch_end_of(*place),
                    Change::Repaint(_) | Change::Place(_) => {}
                    Change::Remove(_) | Change::Update(_) => {
                        prefetch_lines::<3, _>(self.buckets.place(self.pages[*place / 16].bucket));
                    }
                }
            }
        }
    }

    /// Prefetches the memory that updates of these blocks will touch. The first id of a block determines the page and
    /// bucket of most of its polygons.
    pub(super) fn prefetch_blocks(&self, firsts: impl Iterator<Item = u32>) {
        let mut places = [NONE; TOGETHER];
        for (place, id) in places.iter_mut().zip(firsts) {
            let is_in_tree = self.ids.in_tree(id / 16) >> (id % 16) & 1 == 1;
            *place = self.ids.place(id).filter(|_| is_in_tree).unwrap_or(NONE);
            self.ids.prefetch_boxes(id / 16);
            self.pages.prefetch_all(*place / 16);
        }
        for place in places.into_iter().filter(|&place| place != NONE) {
            let page = &self.pages[place / 16];
            let bucket = &self.buckets[page.bucket];
            prefetch_lines::<3, _>(&raw const *bucket);
            prefetch_lines::<3, _>(Halves::half_of(&raw const bucket.boxes, usize::from(page.at)));
        }
    }

    /// Prefetches the cache lines to which the next run of a bucket will be written.
    pub(super) fn prefetch_end_of(&self, bucket: u32) {
        let bucket = &self.buckets[bucket];
        let at = bucket.page_count as usize - usize::from(bucket.page_count > 0);
        self.pages.prefetch(bucket.last, bucket.counts[at]);
        prefetch_lines::<3, _>(Halves::half_of(&raw const bucket.boxes, at));
    }
}

fn id_of(change: Change) -> Option<PolygonId> {
    match change {
        Change::Insert(id) | Change::Remove(id) | Change::Update(id) | Change::Repaint(id) => Some(id),
        Change::Place(_) => None,
    }
}
