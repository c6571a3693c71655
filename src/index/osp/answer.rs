//! The output of a query of the tree: a list of ids, or a mask of visible polygons for each block of sixteen ids.

use std::ops::Range;

use super::layout::Page;
use crate::{
    index::{
        mask_writer::{MaskWriter, RunSink},
        simd::{IdWriter, Kernel, PageRuns, lanes_of},
    },
    polygon::BLOCK,
};

/// The output that a query of the tree for `V` views writes to.
pub(super) trait Answer<const V: usize = 1> {
    /// Adds the polygons `first + bit` for the set bits of the mask of each view.
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, masks: [u32; V]);

    /// Adds the first `runs` runs of a page for all views.
    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        for (&first, &mask) in page.first.iter().zip(&page.masks).take(runs as usize) {
            self.run(kernel, first, [u32::from(mask); V]);
        }
    }

    /// Does the same for a page whose runs all have one polygon.
    #[inline(always)]
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        self.page(kernel, page, runs);
    }

    /// Adds the runs `lanes` of a page.
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: [u32; V]);

    /// Does the same for a page whose runs all have one polygon.
    #[inline(always)]
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, lanes: [u32; V]) {
        self.lanes(kernel, page, lanes);
    }

    /// Number of polygons added, for all views together.
    fn found(&self) -> usize;
}

impl Answer for IdWriter<'_> {
    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, [mask]: [u32; 1]) {
        self.push(kernel, first, mask);
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        self.push_page(kernel, runs_of(page), runs);
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, _: K, page: &Page, count: u32) {
        self.push_copy(&page.first, count);
    }

    #[inline(always)]
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, [lanes]: [u32; 1]) {
        self.push_packed(kernel, &page.first, lanes);
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, [lanes]: [u32; 1]) {
        self.push_lanes(kernel, runs_of(page), lanes);
    }

    #[inline(always)]
    fn found(&self) -> usize {
        self.len()
    }
}

/// A run sets bits in one mask only, because all its polygons belong to one block.
impl Answer for MaskWriter<'_> {
    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, [mask]: [u32; 1]) {
        self.push_run(kernel, first, mask);
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, _: K, page: &Page, count: u32) {
        let ids = &page.first[..(count as usize).min(BLOCK)];
        let (mut low, mut high) = (u32::MAX, 0);
        let masks = self.masks();
        for &id in ids {
            masks[id as usize / BLOCK] |= 1 << (id % BLOCK as u32);
            (low, high) = (low.min(id), high.max(id));
        }
        if !ids.is_empty() {
            self.note(low as usize / BLOCK..high as usize / BLOCK + 1, ids.len());
        }
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, [lanes]: [u32; 1]) {
        for lane in lanes_of(lanes & 0xFFFF) {
            self.push_run(kernel, page.first[lane % 16], u32::from(page.masks[lane % 16]));
        }
    }

    #[inline(always)]
    fn found(&self) -> usize {
        RunSink::found(self)
    }
}

/// Output as masks of blocks for two eyes. Both see nearly the same, so a polygon that both see is written once: until
/// [`Pair::finish`], the second masks have the polygons that only one eye sees.
pub(super) struct Pair<'a> {
    first: MaskWriter<'a>,
    second: &'a mut [u16],
    /// Number of polygons that the second eye sees.
    found: usize,
}

impl<'a> Pair<'a> {
    pub(super) fn new(first: &'a mut [u16], second: &'a mut [u16]) -> Self {
        Self { first: MaskWriter::new(first), second, found: 0 }
    }

    /// Completes the second masks. Returns the range of the changed blocks, and the number of polygons of each eye.
    pub(super) fn finish(self) -> (Range<usize>, usize, usize) {
        let Self { mut first, second, found } = self;
        let blocks = first.blocks();
        for (second, first) in second[blocks.clone()].iter_mut().zip(&first.masks()[blocks.clone()]) {
            *second ^= *first;
        }
        (blocks, RunSink::found(&first), found)
    }
}

impl Answer<2> for Pair<'_> {
    #[inline(always)]
    fn run<K: Kernel>(&mut self, _: K, first: u32, [one, two]: [u32; 2]) {
        let (block, bit) = (first as usize / BLOCK, first % BLOCK as u32);
        if one | two != 0 {
            self.first.masks()[block] |= (one << bit) as u16;
            self.first.note(block..block + 1, one.count_ones() as usize);
            self.second[block] ^= ((one ^ two) << bit) as u16;
            self.found += two.count_ones() as usize;
        }
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        let before = RunSink::found(&self.first);
        self.first.page(kernel, page, runs);
        self.found += RunSink::found(&self.first) - before;
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, [one, two]: [u32; 2]) {
        let before = RunSink::found(&self.first);
        self.first.lanes(kernel, page, [one & two]);
        self.found += RunSink::found(&self.first) - before;
        for lane in lanes_of((one ^ two) & 0xFFFF) {
            let masks = [one, two].map(|lanes| u32::from(page.masks[lane % 16]) * (lanes >> lane & 1));
            self.run(kernel, page.first[lane % 16], masks);
        }
    }

    #[inline(always)]
    fn found(&self) -> usize {
        RunSink::found(&self.first) + self.found
    }
}

/// Output as masks of blocks, for scattered polygons. The query appends runs of one polygon to a list of ids. One pass
/// over this list then sets all their bits. This is several times as fast as setting them during the query.
pub(super) struct Listing<'r, 's> {
    /// The runs of several polygons.
    pub(super) runs: MaskWriter<'r>,
    pub(super) singles: IdWriter<'s>,
}

impl Answer for Listing<'_, '_> {
    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, [mask]: [u32; 1]) {
        self.runs.run(kernel, first, [mask]);
    }

    #[inline(always)]
    fn page<K: Kernel>(&mut self, kernel: K, page: &Page, runs: u32) {
        self.lanes(kernel, page, [(1 << (runs & 31)) - 1]);
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, kernel: K, page: &Page, count: u32) {
        self.singles.single(kernel, page, count);
    }

    #[inline(always)]
    fn singles<K: Kernel>(&mut self, kernel: K, page: &Page, [lanes]: [u32; 1]) {
        self.singles.singles(kernel, page, [lanes]);
    }

    #[inline(always)]
    fn lanes<K: Kernel>(&mut self, kernel: K, page: &Page, [lanes]: [u32; 1]) {
        let exact = u32::from(page.exact);
        self.singles.singles(kernel, page, [lanes & exact]);
        self.runs.lanes(kernel, page, [lanes & !exact]);
    }

    #[inline(always)]
    fn found(&self) -> usize {
        RunSink::found(&self.runs) + self.singles.len()
    }
}

#[inline(always)]
fn runs_of(page: &Page) -> PageRuns<'_> {
    let (gaps, single) = (u32::from(page.gaps), u32::from(page.exact));
    PageRuns { first: &page.first, masks: &page.masks, gaps, single }
}
