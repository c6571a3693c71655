//! Lists visible polygons in drawing order, as numbers or as clusters.

use std::ops::Range;

use glam::Vec3;

use super::run::{Blend, CLUSTER, Classes, Handle, HandleRun, Run};
use osp::polygon::{BLOCK, PolygonId, VisibleBlocks, bits::bits_of};
use osp_session::scene::Scene;

/// Placeholder for the page of a run until [`Sink::end_page`] sets it.
const NO_PAGE: u32 = u32::MAX;

/// Number of polygons of a word of a bit mask.
const WORD: usize = CLUSTER;

/// Number of words of a chunk. A chunk of words is examined as a whole.
const CHUNK_WORDS: usize = 8;

/// A chunk of words becomes part of a span if at least this number of its polygons is drawn. The number is high,
/// because each unset bit of a span still costs vertex invocations.
const LEAST_OF_CHUNK: u32 = (CHUNK_WORDS * WORD * 3 / 4) as u32;

/// Smallest number of polygons of a span. A span is a run that sends a bit for each polygon instead of its number.
/// Shorter spans would need more draw calls.
pub(super) const LEAST_SPAN: usize = 2048;

/// Visible polygons of one style.
pub(super) struct List<'a, F> {
    pub(super) scene: &'a Scene,
    pub(super) polygons: &'a VisibleBlocks,
    pub(super) style: u32,
    pub(super) eye_in_world: Vec3,
    pub(super) page_len: usize,
    pub(super) classes_of: F,
    pub(super) transparent: &'a mut Vec<(u32, u32, u32)>,
    /// Whether additive and whether transparent polygons are listed.
    pub(super) lists: [bool; 2],
}

/// The receiver of the opaque polygons of a list, in ascending order.
pub(super) trait Sink {
    /// Adds the polygon `first + bit` for each set bit of `opaque`. The polygons belong to one page.
    fn add(&mut self, first: usize, opaque: u64);

    /// Tries to add the polygons of a chunk of words, which belong to one page. If it returns `false`, the caller adds
    /// them word by word.
    #[inline(always)]
    fn takes_chunk(&mut self, _first: usize, _words: &[u64]) -> bool {
        false
    }

    /// Ends a page: all polygons added since the last call belong to page number `page`.
    fn end_page(&mut self, page: usize);
}

impl Sink for () {
    #[inline(always)]
    fn add(&mut self, _first: usize, _opaque: u64) {}

    #[inline(always)]
    fn takes_chunk(&mut self, _first: usize, _words: &[u64]) -> bool {
        true
    }

    fn end_page(&mut self, _page: usize) {}
}

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
        let [lists_additive, lists_transparent] = list.lists;
        'words: for (i, chunk) in words.chunks(CHUNK_WORDS).enumerate() {
            let start = begin + i * CHUNK_WORDS * WORD;
            let end = start + chunk.len() * WORD;
            let mut seen_of = [0; CHUNK_WORDS];
            let seen_of = &mut seen_of[..chunk.len()];
            for (seen, masks) in seen_of.iter_mut().zip(chunk) {
                *seen = word_of(masks);
            }
            let is_opaque = |first| {
                let Classes { additive, transparent } = (list.classes_of)(first);
                additive | transparent == 0
            };
            if seen_of.iter().all(|seen| *seen == 0) {
                continue;
            }
            if end <= page_end.min(count) && (start..end).step_by(WORD).all(is_opaque) {
                if !sink.takes_chunk(start, seen_of) {
                    for (first, opaque) in (start..).step_by(WORD).zip(&*seen_of) {
                        sink.add(first, *opaque);
                    }
                }
                continue;
            }
            for (first, seen) in (start..).step_by(WORD).zip(&*seen_of) {
                let seen = *seen;
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
                if transparent != 0 && lists_transparent {
                    note_transparent(&mut list, first, transparent);
                }
                let added = known & classes.additive & !transparent;
                let opaque = known & !(transparent | added);
                // A page has whole words, so a word never lies in two pages.
                while first >= page_end {
                    sink.end_page(page);
                    additive.end_page(page);
                    page += 1;
                    page_end += list.page_len;
                }
                sink.add(first, opaque);
                if lists_additive {
                    additive.add(first, added);
                }
            }
        }
        sink.end_page(page);
        additive.end_page(page);
    }
}

#[inline(always)]
fn word_of(masks: &[u16; WORD / BLOCK]) -> u64 {
    masks.iter().rev().fold(0, |word, mask| word << BLOCK | u64::from(*mask))
}

/// A bit for each polygon of a span. Word `i` has the bits of 64 polygons, from number 64 `i` on.
#[derive(Clone, Debug, Default)]
pub(super) struct SpanBits {
    words: Vec<u64>,
    /// Range of the words that runs of the frame use.
    used: Range<usize>,
}

impl SpanBits {
    pub(super) fn clear(&mut self) {
        self.used = 0..0;
    }

    fn reach(&mut self, words: usize) {
        if words > self.words.len() {
            self.words.resize(words.next_power_of_two(), 0);
        }
    }

    fn use_words(&mut self, words: Range<usize>) {
        let start = if self.used.is_empty() { words.start } else { self.used.start.min(words.start) };
        self.used = start..self.used.end.max(words.end);
    }

    pub(super) fn used(&self) -> (usize, &[u64]) {
        (self.used.start, &self.words[self.used.clone()])
    }
}

pub(super) struct Numbers<'a> {
    ids: &'a mut Vec<PolygonId>,
    runs: &'a mut Vec<Run>,
    style: u32,
    blend: Blend,
    /// Index in `ids` of the first number that belongs to no run yet.
    start: usize,
    /// The bits of spans; `None` if all polygons are listed by number.
    bits: Option<&'a mut SpanBits>,
    /// The current span, polygon numbers. It belongs to no run yet.
    span: Range<usize>,
}

impl<'a> Numbers<'a> {
    /// Creates an empty list. `bits` are the bits of spans and the number of polygons of the scene.
    pub(super) fn new(
        ids: &'a mut Vec<PolygonId>,
        runs: &'a mut Vec<Run>,
        style: u32,
        blend: Blend,
        bits: Option<(&'a mut SpanBits, usize)>,
    ) -> Self {
        let start = ids.len();
        let bits = bits.map(|(bits, polygons)| {
            bits.reach(polygons.div_ceil(WORD));
            bits
        });
        Self { ids, runs, style, blend, start, bits, span: 0..0 }
    }

    #[inline(always)]
    fn end_span(&mut self) {
        let span = std::mem::take(&mut self.span);
        let Some(bits) = self.bits.as_deref_mut() else { return };
        if span.len() >= LEAST_SPAN {
            bits.use_words(span.start / WORD..span.end / WORD);
            self.end_listed();
            self.push_run(span, false);
        } else {
            for (first, word) in span.clone().step_by(WORD).zip(&bits.words[span.start / WORD..]) {
                list(self.ids, first, *word);
            }
        }
    }

    /// Appends words of one page to the span, or starts a new span with them.
    #[inline(always)]
    fn extend_span(&mut self, first: usize, words: &[u64]) {
        if self.span.end != first || self.span.is_empty() {
            self.end_span();
            self.span = first..first;
        }
        self.span.end += words.len() * WORD;
        if let Some(bits) = self.bits.as_deref_mut() {
            bits.words[first / WORD..][..words.len()].copy_from_slice(words);
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
        // `end_page` sets the page.
        self.runs.push(Run { range, is_listed, page: NO_PAGE, style: self.style, blend: self.blend });
    }
}

/// Whether a chunk of words has enough drawn polygons to become part of a span.
#[inline(always)]
fn is_dense(words: &[u64]) -> bool {
    // Counting bits is the slowest part, so it is skipped if the full words suffice.
    let full = words.iter().filter(|word| **word == u64::MAX).count();
    let polygons = || words.iter().map(|word| word.count_ones()).sum::<u32>();
    (full * WORD) as u32 >= LEAST_OF_CHUNK || polygons() >= LEAST_OF_CHUNK
}

#[inline(always)]
fn list(ids: &mut Vec<PolygonId>, first: usize, word: u64) {
    if word == u64::MAX {
        ids.extend((first as u32..(first + WORD) as u32).map(PolygonId));
        return;
    }
    // One append for all numbers checks the capacity only once.
    let (mut some, mut count) = ([PolygonId(0); WORD], 0);
    for (id, bit) in some.iter_mut().zip(bits_of(word)) {
        *id = PolygonId((first + bit) as u32);
        count += 1;
    }
    ids.extend_from_slice(&some[..count]);
}

impl Sink for Numbers<'_> {
    #[inline(always)]
    fn takes_chunk(&mut self, first: usize, words: &[u64]) -> bool {
        let takes = self.bits.is_some() && is_dense(words);
        if takes {
            self.extend_span(first, words);
        }
        takes
    }

    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        if opaque == 0 {
            return;
        }
        if opaque == u64::MAX && self.bits.is_some() {
            self.extend_span(first, &[opaque]);
            return;
        }
        self.end_span();
        list(self.ids, first, opaque);
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

pub(super) struct Handles<'a> {
    pub(super) handles: &'a mut Vec<Handle>,
    pub(super) handle_runs: &'a mut Vec<HandleRun>,
    /// Index of the first cluster mask that belongs to no run yet. `polygons` counts the polygons from this mask on.
    pub(super) start: usize,
    pub(super) polygons: u32,
}

impl Sink for Handles<'_> {
    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        if opaque != 0 {
            self.handles.push(Handle::new(first, opaque));
            self.polygons += opaque.count_ones();
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

/// Adds transparent polygons to the list, with their distances from the eye.
#[inline(never)]
fn note_transparent<F>(list: &mut List<'_, F>, first: usize, transparent: u64) {
    let mut left = transparent;
    while left != 0 {
        let id = PolygonId((first + left.trailing_zeros() as usize) as u32);
        left &= left - 1;
        let distance_squared = list.scene.bounds(id).center().distance_squared(list.eye_in_world);
        // A distance of NaN sorts as the farthest, so that the polygon is still drawn.
        list.transparent.push((distance_squared.to_bits(), list.style, id.0));
    }
}
