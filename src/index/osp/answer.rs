//! The output of a query: a list of ids, or a mask of visible polygons for each block of sixteen ids.

use std::ops::Range;

use super::layout::Page;
use crate::{
    index::{
        mask_writer::{MaskWriter, RunSink},
        simd::{IdWriter, Kernel, PageRuns},
    },
    polygon::{BLOCK, PolygonId},
};

/// The output that a query writes to.
pub(super) trait Answer {
    /// The result of a complete query.
    type Done;

    /// Adds the polygons `first + bit` for the set bits of `mask`.
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32);

    /// Adds polygons of a block; the mask may be 0. Has no branch, unlike [`Answer::run`].
    fn block<K: Kernel>(&mut self, kernel: K, block: usize, mask: u16);

    /// Adds the polygons of consecutive blocks from `block` on: a mask for each.
    fn blocks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]);

    /// Adds the first `runs` runs of a page.
    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        for (&first, &mask) in page.first.iter().zip(&page.masks).take(runs as usize) {
            self.run(kernel, first, u32::from(mask));
        }
    }

    /// Adds the first `count` runs of a page whose runs all have one polygon.
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, count: u32);

    /// Adds the runs `lanes` of a page whose runs all have one polygon.
    #[inline(always)]
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        let mut left = lanes & 0xFFFF;
        while left != 0 {
            let lane = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            self.run(kernel, page.first[lane], 1);
        }
    }

    /// Adds the runs `lanes` of a page.
    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        let mut left = lanes & 0xFFFF;
        while left != 0 {
            let lane = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            self.run(kernel, page.first[lane], u32::from(page.masks[lane]));
        }
    }

    /// Number of entries added.
    fn count(&self) -> usize;

    /// Completes the output.
    fn finish(self) -> Self::Done;
}

/// Output as a list of ids.
pub(super) struct Ids<'a>(IdWriter<'a>);

impl<'a> Ids<'a> {
    pub(super) fn new(ids: &'a mut Vec<PolygonId>) -> Self {
        Self(IdWriter::new(ids))
    }
}

impl Answer for Ids<'_> {
    type Done = ();

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.0.push(kernel, first, mask);
    }

    #[inline(always)]
    fn block<K: Kernel>(&mut self, kernel: K, block: usize, mask: u16) {
        self.0.push(kernel, (block * BLOCK) as u32, mask.into());
    }

    #[inline(always)]
    fn blocks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]) {
        self.0.push_masks(kernel, block, masks);
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
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        self.0.push_packed(kernel, &page.first, lanes);
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        self.0.push_lanes(kernel, runs_of(page), lanes);
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

/// Output as masks of blocks. A run sets bits in one mask only, because all its polygons belong to one block.
pub(super) struct Blocks<'a>(MaskWriter<'a>);

impl<'a> Blocks<'a> {
    /// `masks` has an entry for every block of the index.
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
    fn block<K: Kernel>(&mut self, _kernel: K, block: usize, mask: u16) {
        self.0.masks()[block] |= mask;
        self.0.note(block..block + 1, mask.count_ones() as usize);
    }

    #[inline(always)]
    fn blocks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]) {
        self.0.push_masks(kernel, block, masks);
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
    fn count(&self) -> usize {
        self.0.found()
    }

    #[inline(always)]
    fn finish(self) -> Self::Done {
        self.0.finish()
    }
}

/// Output as masks of blocks, for scattered polygons. The query appends runs of one polygon to a list of ids. One pass
/// over this list then sets all their bits. This is several times as fast as setting them during the query.
pub(super) struct Listing<'a, A> {
    runs: A,
    singles: IdWriter<'a>,
}

impl<'a, A> Listing<'a, A> {
    /// An output that writes runs of several polygons to `runs`, and appends runs of one polygon to the list
    /// `singles`. The list must be empty.
    pub(super) fn new(runs: A, singles: &'a mut Vec<PolygonId>) -> Self {
        Self { runs, singles: IdWriter::new(singles) }
    }
}

impl<A: Answer> Answer for Listing<'_, A> {
    type Done = A::Done;

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.runs.run(kernel, first, mask);
    }

    #[inline(always)]
    fn block<K: Kernel>(&mut self, kernel: K, block: usize, mask: u16) {
        self.runs.block(kernel, block, mask);
    }

    #[inline(always)]
    fn blocks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]) {
        self.runs.blocks(kernel, block, masks);
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        self.lanes(kernel, page, (1 << (runs & 31)) - 1);
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, count: u32) {
        self.singles.push_copy(kernel, &page.first, count);
    }

    #[inline(always)]
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        self.singles.push_packed(kernel, &page.first, lanes);
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: u32) {
        let exact = u32::from(page.exact);
        self.singles.push_packed(kernel, &page.first, lanes & exact);
        self.runs.lanes(kernel, page, lanes & !exact);
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.runs.count() + self.singles.len()
    }

    /// Returns the result for the runs of several polygons.
    #[inline(always)]
    fn finish(self) -> A::Done {
        self.singles.finish();
        self.runs.finish()
    }
}

#[inline(always)]
fn runs_of(page: &Page) -> PageRuns<'_> {
    let (gaps, single) = (u32::from(page.gaps), u32::from(page.exact));
    PageRuns { first: &page.first, masks: &page.masks, gaps, single }
}
