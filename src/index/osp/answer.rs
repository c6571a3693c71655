//! The output of a query: a list of ids, or a mask of visible polygons for each block of sixteen ids.

use std::ops::Range;

use super::{ids::IdMap, layout::Page};
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

    /// Whether the query reports the polygons outside the frustum instead of the polygons inside.
    const IS_OUTSIDE: bool = false;

    /// Adds the polygons `first + bit` for the set bits of `mask`.
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32);

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

/// An output that can also receive many polygons at once.
pub(super) trait Filling: Answer {
    /// Adds all polygons of the id map.
    fn all<K: Kernel>(&mut self, kernel: K, ids: &IdMap);

    /// Adds the polygons `seen` of at most sixteen blocks with these numbers.
    fn numbered<K: Kernel>(&mut self, kernel: K, numbers: &[u32], seen: &[u16; BLOCK]);

    /// Adds the ids whose lanes are set in `seen`, from at most sixteen groups. The ids of a group may belong to any
    /// blocks.
    fn listed<K: Kernel>(&mut self, kernel: K, groups: &[[u32; BLOCK]], seen: &[u16; BLOCK]);
}

/// Output as a list of ids.
pub(super) struct Ids<'a>(IdWriter<'a>);

/// Number of blocks whose ids are written together, at most [`IdWriter::BLOCKS`].
const TOGETHER: usize = 8;

impl<'a> Ids<'a> {
    pub(super) fn new(ids: &'a mut Vec<PolygonId>) -> Self {
        Self(IdWriter::new(ids))
    }

    /// Adds the polygons of consecutive blocks; `first` is the first id of the first block.
    #[inline(always)]
    pub(super) fn blocks<K: Kernel>(&mut self, kernel: K, first: u32, masks: &[u16]) {
        // These are plain loops, because a closure would not be compiled for the kernel's instruction set.
        let id_of = |block: usize| first.wrapping_add(block as u32 * 16);
        let is_full = |masks: &[u16]| masks.iter().fold(u16::MAX, |all, &mask| all & mask) == u16::MAX;
        let mut block = 0;
        while block < masks.len() {
            let start = block;
            while block + TOGETHER <= masks.len() && is_full(&masks[block..block + TOGETHER]) {
                block += TOGETHER;
            }
            if block > start {
                self.0.push_span(kernel, id_of(start), (block - start) * 16);
                continue;
            }
            // A branch for full blocks would be unpredictable here.
            let end = (block + TOGETHER).min(masks.len());
            self.0.push_blocks(kernel, id_of(block), &masks[block..end]);
            block = end;
        }
    }
}

impl Filling for Ids<'_> {
    #[inline(always)]
    fn all<K: Kernel>(&mut self, kernel: K, ids: &IdMap) {
        for (first, masks) in ids.shelves() {
            self.blocks(kernel, first, masks);
        }
    }

    #[inline(always)]
    fn numbered<K: Kernel>(&mut self, kernel: K, numbers: &[u32], seen: &[u16; BLOCK]) {
        self.0.push_numbered(kernel, numbers, seen);
    }

    #[inline(always)]
    fn listed<K: Kernel>(&mut self, kernel: K, groups: &[[u32; BLOCK]], seen: &[u16; BLOCK]) {
        self.0.push_groups(kernel, groups, seen);
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

impl Filling for Blocks<'_> {
    #[inline(always)]
    fn all<K: Kernel>(&mut self, _kernel: K, ids: &IdMap) {
        for (first, in_tree) in ids.shelves() {
            let block = first as usize / BLOCK;
            // Polygons of the open block may be set already.
            for (there, &mask) in self.0.masks()[block..block + in_tree.len()].iter_mut().zip(in_tree) {
                *there |= mask;
            }
            let polygons = in_tree.iter().map(|mask| mask.count_ones() as usize).sum();
            self.0.note(block..block + in_tree.len(), polygons);
        }
    }

    #[inline(always)]
    fn numbered<K: Kernel>(&mut self, kernel: K, numbers: &[u32], seen: &[u16; BLOCK]) {
        for (&number, &seen) in numbers.iter().zip(seen) {
            self.run(kernel, number * BLOCK as u32, u32::from(seen));
        }
    }

    #[inline(always)]
    fn listed<K: Kernel>(&mut self, kernel: K, groups: &[[u32; BLOCK]], seen: &[u16; BLOCK]) {
        for (ids, &seen) in groups.iter().zip(seen) {
            let mut left = seen;
            while left != 0 {
                self.run(kernel, ids[left.trailing_zeros() as usize % BLOCK], 1);
                left &= left - 1;
            }
        }
    }
}

impl Answer for Blocks<'_> {
    type Done = (Range<usize>, usize);

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.0.push_run(kernel, first, mask);
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

/// Output by exclusion. All polygons in the tree are set first. The query then reports the polygons outside
/// the frustum, and their bits are cleared.
pub(super) struct Outside<'a> {
    /// Masks of the blocks from `first` on.
    masks: &'a mut [u16],
    first: usize,
    count: usize,
}

impl<'a> Outside<'a> {
    /// `masks` begins with block `first`. Blocks without an entry in the id map are not written.
    pub(super) fn new(masks: &'a mut [u16], first: usize, ids: &IdMap) -> Self {
        for (id, in_tree) in ids.shelves() {
            let block = id as usize / BLOCK - first;
            masks[block..block + in_tree.len()].copy_from_slice(in_tree);
        }
        Self { masks, first, count: 0 }
    }
}

impl Answer for Outside<'_> {
    /// Number of polygons outside.
    type Done = usize;

    const IS_OUTSIDE: bool = true;

    #[inline(always)]
    fn run<K: Kernel>(&mut self, _kernel: K, first: u32, mask: u32) {
        let (block, bit) = (first as usize / BLOCK, first % BLOCK as u32);
        self.masks[block - self.first] &= !((mask << bit) as u16);
        self.count += mask.count_ones() as usize;
    }

    #[inline(always)]
    fn single<K: Kernel>(&mut self, _kernel: K, page: &Page, count: u32) {
        let ids = &page.first[..(count as usize).min(BLOCK)];
        for &id in ids {
            self.masks[id as usize / BLOCK - self.first] &= !(1 << (id % BLOCK as u32));
        }
        self.count += ids.len();
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    fn finish(self) -> usize {
        self.count
    }
}

/// Output as masks of blocks, for scattered polygons. The query appends runs of one polygon to a list of ids. One pass
/// over this list then sets or clears all their bits. This is several times as fast as setting them during the query.
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

    const IS_OUTSIDE: bool = A::IS_OUTSIDE;

    #[inline(always)]
    fn run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.runs.run(kernel, first, mask);
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
