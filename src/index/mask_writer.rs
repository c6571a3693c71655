use std::ops::Range;

use super::simd::{IdWriter, Kernel, WithKernel};
use crate::polygon::{BLOCK, PolygonId, VisibleBlocks};

/// The output of a query that tests blocks of sixteen ids: a list of ids, or a mask for each block.
pub trait RunSink {
    /// Adds the polygons `first + bit` for the set bits of `mask`; all belong to one block.
    fn push_run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32);

    /// Adds the polygons of consecutive blocks from `block` on: a mask for each. Returns their number.
    fn push_masks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]) -> usize;

    /// Adds polygons of one block; the mask may be 0. Has no branch, unlike [`RunSink::push_run`].
    fn push_block<K: Kernel>(&mut self, kernel: K, block: usize, mask: u16);

    /// Number of polygons added.
    fn found(&self) -> usize;
}

/// Number of blocks whose ids are written together, at most [`IdWriter::BLOCKS`].
const TOGETHER: usize = 8;

/// Number of bits that are set in masks. Four masks are counted at once.
#[inline(always)]
pub(crate) fn ones(masks: &[u16]) -> u32 {
    let (four, rest) = masks.as_chunks::<4>();
    let word = |four: &[u16; 4]| four.iter().fold(0, |word, &mask| word << 16 | u64::from(mask));
    four.iter().map(|four| word(four).count_ones()).sum::<u32>()
        + rest.iter().map(|mask| mask.count_ones()).sum::<u32>()
}

impl RunSink for IdWriter<'_> {
    #[inline(always)]
    fn push_run<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        if mask != 0 {
            self.push(kernel, first, mask);
        }
    }

    #[inline(always)]
    fn push_masks<K: Kernel>(&mut self, kernel: K, block: usize, masks: &[u16]) -> usize {
        // These are plain loops, because a closure would not be compiled for the kernel's instruction set.
        let id_of = |at: usize| ((block + at) * BLOCK) as u32;
        let is_full = |masks: &[u16]| masks.iter().fold(u16::MAX, |all, &mask| all & mask) == u16::MAX;
        let (before, mut at) = (self.len(), 0);
        while at < masks.len() {
            let start = at;
            while at + TOGETHER <= masks.len() && is_full(&masks[at..at + TOGETHER]) {
                at += TOGETHER;
            }
            if at > start {
                self.push_span(kernel, id_of(start), (at - start) * BLOCK);
                continue;
            }
            // A branch for full blocks would be unpredictable here.
            let end = (at + TOGETHER).min(masks.len());
            self.push_blocks(kernel, id_of(at), &masks[at..end]);
            at = end;
        }
        self.len() - before
    }

    #[inline(always)]
    fn push_block<K: Kernel>(&mut self, kernel: K, block: usize, mask: u16) {
        self.push(kernel, (block * BLOCK) as u32, mask.into());
    }

    #[inline(always)]
    fn found(&self) -> usize {
        self.len()
    }
}

/// Adds the polygons `ids` to a set that contains none of them. `ids` has no duplicates.
pub(super) struct SetAll<'a> {
    pub(super) visible: &'a mut VisibleBlocks,
    pub(super) ids: &'a [PolygonId],
}

impl WithKernel for SetAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _kernel: K) {
        self.visible.set_all(self.ids);
    }
}

/// Sets the masks of blocks, and stores the range of the changed blocks.
#[derive(Debug)]
pub struct MaskWriter<'a> {
    masks: &'a mut [u16],
    begin: usize,
    end: usize,
    found: usize,
}

impl<'a> MaskWriter<'a> {
    /// A writer to the masks of an empty set. The set must have masks up to the highest id; see
    /// [`crate::polygon::VisibleBlocks::masks_for`].
    pub fn new(masks: &'a mut [u16]) -> Self {
        Self { masks, begin: usize::MAX, end: 0, found: 0 }
    }

    /// The masks of all blocks. Set bits by OR, then call [`MaskWriter::note`].
    #[inline(always)]
    pub(crate) fn masks(&mut self) -> &mut [u16] {
        self.masks
    }

    /// Records that `polygons` bits were set in these blocks.
    #[inline(always)]
    pub(crate) fn note(&mut self, blocks: Range<usize>, polygons: usize) {
        self.begin = self.begin.min(blocks.start);
        self.end = self.end.max(blocks.end);
        self.found += polygons;
    }

    /// Returns the range of changed blocks and the number of polygons: the arguments of
    /// [`crate::polygon::VisibleBlocks::note_filled`].
    #[inline(always)]
    pub fn finish(self) -> (Range<usize>, usize) {
        (self.blocks(), self.found)
    }

    /// The range of changed blocks.
    pub(crate) fn blocks(&self) -> Range<usize> {
        self.begin.min(self.end)..self.end
    }
}

impl RunSink for MaskWriter<'_> {
    #[inline(always)]
    fn push_run<K: Kernel>(&mut self, _kernel: K, first: u32, mask: u32) {
        if mask != 0 {
            let (block, bit) = (first as usize / BLOCK, first % BLOCK as u32);
            debug_assert!(mask << bit <= 0xFFFF, "a run within its block");
            self.masks[block] |= (mask << bit) as u16;
            self.note(block..block + 1, mask.count_ones() as usize);
        }
    }

    #[inline(always)]
    fn push_masks<K: Kernel>(&mut self, _kernel: K, block: usize, masks: &[u16]) -> usize {
        let blocks = block..block + masks.len();
        for (to, from) in self.masks[blocks.clone()].iter_mut().zip(masks) {
            *to |= from;
        }
        let polygons = ones(masks) as usize;
        self.note(blocks, polygons);
        polygons
    }

    #[inline(always)]
    fn push_block<K: Kernel>(&mut self, _kernel: K, block: usize, mask: u16) {
        self.masks[block] |= mask;
        self.note(block..block + 1, mask.count_ones() as usize);
    }

    #[inline(always)]
    fn found(&self) -> usize {
        self.found
    }
}
