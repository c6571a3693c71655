//! The results for two eyes; a polygon that both eyes see is written once.

use std::ops::Range;

use super::layout::Page;
use crate::polygon::BLOCK;

/// Both eyes, as bits of `eyes`.
pub(super) const BOTH: u8 = 0b11;

/// The results for two eyes. Until [`Sets::finish`], the second set contains the polygons that only one eye sees.
pub(super) struct Sets<'a> {
    pub(super) masks: [&'a mut [u16]; 2],
    begin: usize,
    end: usize,
    /// Number of polygons that each eye sees.
    pub(super) found: [usize; 2],
}

impl<'a> Sets<'a> {
    /// Two empty sets with an entry for every block of the index.
    #[inline(always)]
    pub(super) fn new(masks: [&'a mut [u16]; 2]) -> Self {
        Self { masks, begin: usize::MAX, end: 0, found: [0; 2] }
    }

    #[inline(always)]
    pub(super) fn count(&self) -> usize {
        self.found[0] + self.found[1]
    }

    #[inline(always)]
    pub(super) fn note(&mut self, begin: usize, end: usize) {
        self.begin = self.begin.min(begin);
        self.end = self.end.max(end);
    }

    /// Adds polygons of a block, with one mask for each eye.
    #[inline(always)]
    pub(super) fn add_each(&mut self, block: usize, [first, second]: [u32; 2]) {
        if first | second != 0 {
            self.note(block, block + 1);
            self.found[0] += first.count_ones() as usize;
            self.found[1] += second.count_ones() as usize;
            self.masks[0][block] |= first as u16;
            self.masks[1][block] ^= (first ^ second) as u16;
        }
    }

    /// Adds the runs `runs` of a page for these eyes.
    #[inline(always)]
    pub(super) fn add_runs(&mut self, eyes: u8, page: &Page, runs: u32) {
        let (mut low, mut high, mut polygons) = (usize::MAX, 0, 0);
        let mut left = runs & 0xFFFF;
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let (block, lanes) = (page.first[i] as usize / BLOCK, page.masks[i] << (page.first[i] % 16));
            (low, high) = (low.min(block), high.max(block + 1));
            polygons += lanes.count_ones() as usize;
            if eyes & 1 != 0 {
                self.masks[0][block] |= lanes;
            }
            if eyes != BOTH {
                self.masks[1][block] ^= lanes;
            }
        }
        self.note(low, high);
        self.found[0] += polygons * usize::from(eyes & 1);
        self.found[1] += polygons * usize::from(eyes >> 1);
    }

    /// Adds the first `runs` runs of a page for these eyes.
    #[inline(always)]
    pub(super) fn add_page(&mut self, eyes: u8, page: &Page, runs: u32) {
        if eyes != BOTH {
            self.add_runs(eyes, page, (1 << runs) - 1);
            return;
        }
        let (mut low, mut high, mut polygons) = (usize::MAX, 0, 0);
        for (&first, &mask) in page.first.iter().zip(&page.masks).take(runs as usize) {
            let block = first as usize / BLOCK;
            (low, high) = (low.min(block), high.max(block + 1));
            polygons += mask.count_ones() as usize;
            self.masks[0][block] |= mask << (first % 16);
        }
        self.note(low, high);
        self.found[0] += polygons;
        self.found[1] += polygons;
    }

    /// Completes the second set; returns the range of written blocks.
    #[inline(always)]
    pub(super) fn finish(self) -> Range<usize> {
        let [first, second] = self.masks;
        let span = self.begin..self.end;
        if !span.is_empty() {
            for (second, first) in second[span.clone()].iter_mut().zip(&first[span.clone()]) {
                *second ^= *first;
            }
        }
        span
    }
}
