#![expect(
    unsafe_code,
    reason = "numbers that the tree holds are looked up without a check; it pays in queries"
)]

use std::ops::{Index, IndexMut};

use super::{
    layout::{Page, PageBoxes, Run},
    pool::{NONE, Pool},
};
use crate::{
    index::simd::{Halves, prefetch_lines},
    math::Aabb,
};

/// The pages, in two pools whose entries are taken and released together, so that a page has the same number in both.
#[derive(Clone, Debug)]
pub(super) struct Pages {
    heads: Pool<Page>,
    boxes: Pool<PageBoxes>,
}

impl Pages {
    /// Room for `pages` pages, and for `most` in total if runs are short.
    pub(super) fn with_room_for(pages: usize, most: usize) -> Self {
        Self {
            heads: Pool::with_room_for(pages).and_room_for(most),
            boxes: Pool::with_room_for(pages).and_room_for(most),
        }
    }

    pub(super) fn make_room(&mut self, more: usize) {
        self.heads.make_room(more);
        self.boxes.make_room(more);
    }

    pub(super) fn take(&mut self) -> u32 {
        let number = self.heads.take();
        let same = self.boxes.take();
        debug_assert_eq!(number, same);
        number
    }

    pub(super) fn give(&mut self, number: u32) {
        self.heads.give(number);
        self.boxes.give(number);
    }

    pub(super) fn live(&self) -> u32 {
        self.heads.live()
    }

    pub(super) fn clear(&mut self) {
        self.heads.clear();
        self.boxes.clear();
    }

    pub(super) fn bytes(&self) -> usize {
        self.heads.bytes() + self.boxes.bytes()
    }

    /// A run and its box.
    #[inline]
    pub(super) fn run(&self, number: u32, lane: usize) -> (Run, Aabb) {
        let (page, boxes) = (&self.heads[number], &self.boxes[number]);
        let exact = page.exact >> lane & 1 == 1;
        let store = if exact { NONE } else { boxes.store[lane] };
        let run = Run { first: page.first[lane], store, mask: page.masks[lane] };
        (run, boxes.boxes.get(lane))
    }

    /// Sets a run; its box counts as tight.
    #[inline]
    pub(super) fn set_run(&mut self, number: u32, lane: usize, run: Run, bounds: &Aabb) {
        let (page, boxes) = (&mut self.heads[number], &mut self.boxes[number]);
        boxes.boxes.set(lane, bounds);
        if !run.is_exact() {
            boxes.store[lane] = run.store;
        }
        page.first[lane] = run.first;
        page.masks[lane] = run.mask;
        page.exact = page.exact & !(1 << lane) | u16::from(run.is_exact()) << lane;
        page.note_gaps(lane);
        page.loose &= !(1 << lane);
    }

    /// Appends a run, whose box counts as tight, to a page that is not full; returns the run's lane.
    #[inline]
    pub(super) fn push_run(&mut self, number: u32, run: Run, bounds: &Aabb) -> usize {
        let (page, boxes) = (&mut self.heads[number], &mut self.boxes[number]);
        let lane = usize::from(page.runs) % 16;
        page.runs += 1;
        page.first[lane] = run.first;
        page.masks[lane] = run.mask;
        // The marks of an unused lane are clear.
        if run.is_exact() {
            page.exact |= 1 << lane;
        } else {
            boxes.store[lane] = run.store;
            page.note_gaps(lane);
        }
        boxes.boxes.set(lane, bounds);
        lane
    }

    /// The boxes of a page's runs.
    #[inline]
    pub(super) fn boxes(&self, number: u32) -> &Halves {
        &self.boxes[number].boxes
    }

    /// A page by its number, without a check.
    ///
    /// # Safety
    /// The page is in use.
    #[inline(always)]
    pub(super) unsafe fn known(&self, number: u32) -> &Page {
        // SAFETY: the caller guarantees that the page is in use.
        unsafe { self.heads.known(number) }
    }

    /// The boxes of a page, without a check.
    ///
    /// # Safety
    /// The page is in use.
    #[inline(always)]
    pub(super) unsafe fn known_boxes(&self, number: u32) -> &PageBoxes {
        // SAFETY: the page is in use. Both pools take and release their entries together.
        unsafe { self.boxes.known(number) }
    }

    /// Prefetches a whole page.
    #[inline]
    pub(super) fn prefetch_all(&self, number: u32) {
        prefetch_lines::<2, _>(self.heads.place(number));
        prefetch_lines::<7, _>(self.boxes.place(number));
    }

    /// Prefetches the memory that [`Pages::push_run`] touches at a lane, for a run of one polygon.
    #[inline]
    pub(super) fn prefetch(&self, number: u32, lane: u8) {
        prefetch_lines::<2, _>(self.heads.place(number));
        prefetch_lines::<3, _>(Halves::half_of(self.boxes.place(number).cast(), usize::from(lane)));
    }
}

impl Index<u32> for Pages {
    type Output = Page;

    #[inline]
    fn index(&self, number: u32) -> &Page {
        &self.heads[number]
    }
}

impl IndexMut<u32> for Pages {
    #[inline]
    fn index_mut(&mut self, number: u32) -> &mut Page {
        &mut self.heads[number]
    }
}
