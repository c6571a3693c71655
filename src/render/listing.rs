//! A list of polygons on its way into the order of drawing.

use std::ops::Range;

use glam::Vec3;

use super::order::{Blend, Classes, Handle, HandleRun, Run};
use crate::{
    polygon::{BLOCK, PolygonId, VisibleBlocks, ids_of},
    scene::Scene,
};

/// The page of a run whose page is not over.
const NO_PAGE: u32 = u32::MAX;

/// Polygons that are looked at together.
const WORD: usize = 64;

/// Words that are looked at together, where all of their polygons are to be drawn or none.
const CHUNK_WORDS: usize = 8;

/// A list on its way into the order.
pub(super) struct List<'a, F> {
    pub(super) scene: &'a Scene,
    pub(super) polygons: &'a VisibleBlocks,
    pub(super) style: u32,
    pub(super) eye_in_world: Vec3,
    pub(super) page_len: usize,
    pub(super) classes_of: F,
    pub(super) transparent: &'a mut Vec<(u32, u32, u32)>,
}

/// Takes the opaque polygons of a list, by number.
pub(super) trait Sink {
    /// Polygons `first + bit`, of one page.
    fn add(&mut self, first: usize, opaque: u64);

    /// All polygons of a range of whole words, of one page.
    #[inline(always)]
    fn add_full(&mut self, polygons: Range<usize>) {
        polygons.step_by(WORD).for_each(|first| self.add(first, u64::MAX));
    }

    /// What was added since the page before is all of this page.
    fn end_page(&mut self, page: usize);
}

/// A list and what takes it.
pub(super) struct Walk<'a, F, S> {
    pub(super) list: List<'a, F>,
    pub(super) sink: S,
    pub(super) additive: Numbers<'a>,
}

impl<F: Fn(usize) -> Classes, S: Sink> Walk<'_, F, S> {
    #[inline(always)]
    pub(super) fn run(self) {
        let Walk { mut list, mut sink, mut additive } = self;
        let count = list.scene.polygon_count();
        let (begin, words) = list.polygons.words();
        let mut page = begin / list.page_len;
        let mut page_end = (page + 1) * list.page_len;
        'words: for (i, chunk) in words.chunks(CHUNK_WORDS).enumerate() {
            let start = begin + i * CHUNK_WORDS * WORD;
            let end = start + chunk.len() * WORD;
            let (all, any) =
                chunk.as_flattened().iter().fold((u16::MAX, 0), |(all, any), mask| (all & mask, any | mask));
            let is_opaque = |first| {
                let Classes { additive, transparent } = (list.classes_of)(first);
                additive | transparent == 0
            };
            if any == 0 {
                continue;
            }
            if all == u16::MAX && end <= page_end.min(count) && (start..end).step_by(WORD).all(is_opaque) {
                sink.add_full(start..end);
                continue;
            }
            for (first, masks) in (start..).step_by(WORD).zip(chunk) {
                let seen = masks.iter().rev().fold(0, |word, mask| word << BLOCK | u64::from(*mask));
                if seen == 0 {
                    continue;
                }
                let known = match count.saturating_sub(first) {
                    0 => break 'words,
                    left if left < WORD => seen & ((1 << left) - 1),
                    _ => seen,
                };
                let classes = (list.classes_of)(first);
                let transparent = known & classes.transparent;
                if transparent != 0 {
                    note_transparent(&mut list, first, transparent);
                }
                let mut added = known & classes.additive & !transparent;
                let mut opaque = known & !(transparent | added);
                while first + WORD > page_end {
                    let before = (1 << page_end.saturating_sub(first)) - 1;
                    sink.add(first, opaque & before);
                    additive.add(first, added & before);
                    opaque &= !before;
                    added &= !before;
                    sink.end_page(page);
                    additive.end_page(page);
                    page += 1;
                    page_end += list.page_len;
                }
                sink.add(first, opaque);
                additive.add(first, added);
            }
        }
        sink.end_page(page);
        additive.end_page(page);
    }
}

/// Takes the polygons as numbers.
pub(super) struct Numbers<'a> {
    ids: &'a mut Vec<PolygonId>,
    runs: &'a mut Vec<Run>,
    style: u32,
    blend: Blend,
    /// What is listed from here on is of no run yet.
    start: usize,
    /// A span of so many is not listed.
    least_span: usize,
    /// All polygons of this range came last, and are of no run yet.
    full: Range<usize>,
}

impl<'a> Numbers<'a> {
    pub(super) fn new(
        ids: &'a mut Vec<PolygonId>,
        runs: &'a mut Vec<Run>,
        style: u32,
        blend: Blend,
        least_span: usize,
    ) -> Self {
        let start = ids.len();
        Self { ids, runs, style, blend, start, least_span, full: 0..0 }
    }

    #[inline(always)]
    fn end_span(&mut self) {
        let Range { start, end } = std::mem::take(&mut self.full);
        if end - start >= self.least_span {
            self.end_listed();
            self.push_run(start..end, false);
        } else if start < end {
            self.ids.extend((start as u32..end as u32).map(PolygonId));
        }
    }

    fn end_listed(&mut self) {
        let listed = self.start..self.ids.len();
        self.start = listed.end;
        if !listed.is_empty() {
            self.push_run(listed, true);
        }
    }

    fn push_run(&mut self, range: Range<usize>, is_listed: bool) {
        let range = range.start as u32..range.end as u32;
        // The page is filled in when it ends.
        self.runs.push(Run { range, is_listed, page: NO_PAGE, style: self.style, blend: self.blend });
    }
}

impl Sink for Numbers<'_> {
    #[inline(always)]
    fn add_full(&mut self, polygons: Range<usize>) {
        if self.full.end != polygons.start || self.full.is_empty() {
            self.end_span();
            self.full.start = polygons.start;
        }
        self.full.end = polygons.end;
    }

    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        if opaque == 0 {
            return;
        }
        if opaque == u64::MAX {
            self.add_full(first..first + WORD);
            return;
        }
        self.end_span();
        for block in 0..WORD / BLOCK {
            let mask = opaque >> (block * BLOCK) & 0xFFFF;
            if mask != 0 {
                self.ids.extend(ids_of(first / BLOCK + block, mask as u16));
            }
        }
    }

    #[inline(always)]
    fn end_page(&mut self, page: usize) {
        self.end_span();
        self.end_listed();
        for run in self.runs.iter_mut().rev().take_while(|run| run.page == NO_PAGE) {
            run.page = page as u32;
        }
    }
}

/// Takes the polygons as blocks.
pub(super) struct Handles<'a> {
    pub(super) handles: &'a mut Vec<Handle>,
    pub(super) handle_runs: &'a mut Vec<HandleRun>,
    /// The first of no run yet, and polygons since then.
    pub(super) start: usize,
    pub(super) polygons: u32,
}

impl Sink for Handles<'_> {
    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        for block in 0..WORD / BLOCK {
            let mask = (opaque >> (block * BLOCK) & 0xFFFF) as u32;
            if mask != 0 {
                let (block, place) = ((first / BLOCK + block) as u32, self.handles.len() as u32);
                self.handles.push(Handle { block, mask, place });
                self.polygons += mask.count_ones();
            }
        }
    }

    #[inline(always)]
    fn end_page(&mut self, page: usize) {
        let range = self.start as u32..self.handles.len() as u32;
        self.start = self.handles.len();
        let polygons = std::mem::take(&mut self.polygons);
        if !range.is_empty() {
            self.handle_runs.push(HandleRun { range, page: page as u32, polygons });
        }
    }
}

/// Notes polygons that can be seen through.
#[inline(never)]
fn note_transparent<F>(list: &mut List<'_, F>, first: usize, transparent: u64) {
    let mut left = transparent;
    while left != 0 {
        let id = PolygonId((first + left.trailing_zeros() as usize) as u32);
        left &= left - 1;
        let distance_squared = list.scene.bounds(id).center().distance_squared(list.eye_in_world);
        // A distance that is not a number sorts as the farthest; it is drawn all the same.
        list.transparent.push((distance_squared.to_bits(), list.style, id.0));
    }
}
