//! Moves all polygons to the flat rows if many runs change in each frame. Changes of the tree would then take longer than
//! a test of all boxes, and a change in the rows only writes a box. Later commits return the polygons to the tree. If
//! the changes continue, the next attempt is later.

use super::{index::Osp, pool::NONE};
use crate::{
    index::simd::Boxes,
    math::Aabb,
    polygon::{BLOCK, PolygonId, bits::bits_of},
};

/// All polygons go to the rows at once if a single commit edits the runs of more than one in this number of polygons.
const MOST: usize = 8;

/// A burst begins when a commit has edited more than [`BURST_LEAST`] runs, and more than one for this number of polygons.
/// Further moving polygons then go to the rows.
const BURST: usize = 64;
const BURST_LEAST: usize = 64;

/// Smallest tree that goes to the rows at once, in polygons.
const LEAST: usize = 1024;

/// Number of updates in the sample of a batch.
const SAMPLE: usize = 64;

impl Osp {
    /// Ends a commit's count of edits. Moves all polygons to the rows if many commits had many edits.
    pub(super) fn note_edits(&mut self) {
        let adjusted = self.upkeep.adjusted;
        if self.churn.keeps_rows {
            self.churn.note_kept(self.clock, adjusted, &mut self.movers);
        } else if self.churn.note_edits(self.len, self.ids.are_scattered()) {
            self.move_all_to_rows();
        }
    }

    /// Whether this commit has edited so many runs that all polygons should go to the rows at once.
    #[inline]
    pub(super) fn is_churned(&self) -> bool {
        self.len >= LEAST && self.churn.edits as usize > self.len / MOST
    }

    /// Whether this commit has edited so many runs of scattered polygons that further moving polygons should go to the rows
    /// at once. Commits return them to the tree, a few at a time.
    #[inline]
    pub(super) fn has_burst(&self) -> bool {
        self.churn.edits as usize > BURST_LEAST.max(self.len / BURST) && self.ids.are_scattered()
    }

    /// Whether a batch of updates moves a large part of a tree of scattered polygons, by a sample.
    pub(super) fn moves_most(&self, updates: &[(PolygonId, Aabb)]) -> bool {
        if self.len < LEAST || updates.len() < self.len / MOST || !self.ids.are_scattered() {
            return false;
        }
        let sample = updates.iter().step_by(updates.len().div_ceil(SAMPLE));
        let (count, in_tree) = sample.fold((0, 0), |(count, in_tree), (id, _)| {
            (count + 1, in_tree + usize::from(self.movers.slot(*id).is_none()))
        });
        updates.len() * in_tree / count > self.len / MOST
    }

    /// Moves all polygons of the tree to the rows, block by block, and empties the tree.
    #[inline(never)]
    pub(super) fn move_all_to_rows(&mut self) {
        self.churn.keep_rows(self.clock, self.upkeep.adjusted);
        self.is_settling = false;
        self.upkeep.inserted += self.len as u64;
        for lane in bits_of(u64::from(self.open.lanes())) {
            let id = PolygonId(self.open.block() * BLOCK as u32 + lane as u32);
            self.movers.insert(id, &self.open.bounds(lane));
        }
        for (first, blocks) in self.ids.shelves() {
            for (block, &lanes) in (first / BLOCK as u32..).zip(blocks).filter(|&(_, &lanes)| lanes != 0) {
                let store = self.ids.store(block);
                let mut boxes = if store == NONE { Boxes::EMPTY } else { *self.ids.boxes(store) };
                for lane in bits_of(u64::from(lanes)) {
                    let Some(place) = self.ids.place(block * BLOCK as u32 + lane as u32) else { continue };
                    let (run, bounds) = self.pages.run(place / 16, place as usize % 16);
                    if run.is_exact() {
                        boxes.set(lane, &bounds);
                    }
                }
                self.movers.insert_block(block, lanes, &boxes);
            }
        }
        self.movers.forget_moves();
        self.flat.fill(0);
        self.clear_tree();
        self.len = 0;
    }
}
