//! Where the answer of a query goes: ids or blocks.

use std::ops::Range;

use super::{ids::IdMap, layout::Page};
use crate::{
    index::{
        DrawList,
        mask_writer::{MaskWriter, RunSink},
        simd::{IdWriter, Kernel, PageRuns},
    },
    polygon::BLOCK,
};

/// Where the answer goes.
pub(super) trait Answer {
    /// What is known when it is complete.
    type Done;

    /// Polygons `first + bit` of a mask.
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32);

    /// The first `runs` runs of a page.
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32);

    /// The first `count` runs of a page of single polygons.
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, count: u32);

    /// Some runs of a page.
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32);

    /// All polygons that are in the index.
    fn all<K: Kernel>(&mut self, kernel: K, ids: &IdMap);

    /// Entries so far.
    fn count(&self) -> usize;

    /// The answer is complete.
    fn finish(self) -> Self::Done;
}

/// The answer as ids.
pub(super) struct Ids<'a>(IdWriter<'a>);

impl<'a> Ids<'a> {
    pub(super) fn new(draw_list: &'a mut DrawList) -> Self {
        Self(IdWriter::new(draw_list.ids_mut()))
    }
}

impl Answer for Ids<'_> {
    type Done = ();

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.0.push(kernel, first, mask);
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        self.0.push_page(kernel, runs_of(page), runs);
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, count: u32) {
        self.0.push_copy(kernel, &page.first, count);
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        self.0.push_lanes(kernel, runs_of(page), lanes);
    }

    #[inline(always)]
    fn all<K: Kernel>(&mut self, kernel: K, ids: &IdMap) {
        // Plain loops: a closure would not be compiled for the kernel's instruction set.
        for (first, masks) in ids.shelves() {
            let id_of = |block: usize| first.wrapping_add(block as u32 * 16);
            let mut block = 0;
            while block < masks.len() {
                let start = block;
                while block < masks.len() && masks[block] == u16::MAX {
                    block += 1;
                }
                if block > start {
                    self.0.push_span(kernel, id_of(start), (block - start) * 16);
                } else {
                    if masks[block] != 0 {
                        self.0.push(kernel, id_of(block), u32::from(masks[block]));
                    }
                    block += 1;
                }
            }
        }
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn finish(self) {
        self.0.finish();
    }
}

/// The answer as blocks: a run's polygons are all of one block.
pub(super) struct Blocks<'a>(MaskWriter<'a>);

impl<'a> Blocks<'a> {
    /// `masks` reaches to the highest number of the index.
    pub(super) fn new(masks: &'a mut [u16]) -> Self {
        Self(MaskWriter::new(masks))
    }
}

impl Answer for Blocks<'_> {
    type Done = (Range<usize>, usize);

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.0.push_run(kernel, first, mask);
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        for (&first, &mask) in page.first.iter().zip(&page.masks).take(runs as usize) {
            self.0.push_run(kernel, first, u32::from(mask));
        }
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, _kernel: K, page: &Page, count: u32) {
        let ids = &page.first[..(count as usize).min(BLOCK)];
        let (mut low, mut high) = (u32::MAX, 0);
        let masks = self.0.masks();
        for &id in ids {
            masks[id as usize / BLOCK] |= 1 << (id % BLOCK as u32);
            (low, high) = (low.min(id), high.max(id));
        }
        if !ids.is_empty() {
            self.0.note(low as usize / BLOCK..high as usize / BLOCK + 1, ids.len());
        }
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        let mut left = lanes & 0xFFFF;
        while left != 0 {
            let lane = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            self.0.push_run(kernel, page.first[lane], u32::from(page.masks[lane]));
        }
    }

    #[inline(always)]
    fn all<K: Kernel>(&mut self, _kernel: K, ids: &IdMap) {
        for (first, filed) in ids.shelves() {
            let block = first as usize / BLOCK;
            // Polygons of the open block may be there already.
            for (there, &mask) in self.0.masks()[block..block + filed.len()].iter_mut().zip(filed) {
                *there |= mask;
            }
            let polygons = filed.iter().map(|mask| mask.count_ones() as usize).sum();
            self.0.note(block..block + filed.len(), polygons);
        }
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.0.found()
    }

    #[inline(always)]
    fn finish(self) -> Self::Done {
        self.0.finish()
    }
}

#[inline(always)]
fn runs_of(page: &Page) -> PageRuns<'_> {
    let (gaps, single) = (u32::from(page.gaps), u32::from(page.exact));
    PageRuns { first: &page.first, masks: &page.masks, gaps, single }
}
