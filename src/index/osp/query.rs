#![expect(
    unsafe_code,
    reason = "numbers found in the tree are looked up without a check, and queues begin without contents"
)]
//! The frustum query. It tests eight children of a node, sixteen pages, sixteen runs, and at last sixteen polygons at a
//! time. The polygons of boxes inside every plane are reported without further tests.
//!
//! Buckets and pages wait in short queues while their cache lines are prefetched. A query mostly waits for memory, so it
//! requests many lines at once. Runs that one plane cuts wait in that plane's list. A full list is tested with the plane in
//! registers.

use std::mem::MaybeUninit;

use super::{
    answer::Answer,
    index::Osp,
    layout::{Bucket, Node, Page, PageBoxes, Target},
    pool::NONE,
};
use crate::index::{
    WorkCounts,
    simd::{Boxes, Kernel, PlaneSet, WithKernel, prefetch_lines},
};

/// A walk over the tree that finds the polygons inside the frustum.
pub(super) struct Cull<'a, A> {
    pub(super) osp: &'a Osp,
    /// The first node of the walk. It has to be in the tree, because unchecked reads start from it.
    pub(super) top: u32,
    pub(super) planes: &'a PlaneSet,
    pub(super) answer: A,
}

impl<A: Answer> WithKernel for Cull<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        let mut walk = Walk {
            osp: self.osp,
            planes: self.planes,
            kernel,
            answer: self.answer,
            work: WorkCounts::default(),
            tested: 0,
            buckets: WorkQueue::new(),
            whole: WorkQueue::new(),
            pages: WorkQueue::new(),
            cut: std::array::from_fn(|_| List::new()),
            full: 0,
        };
        let before = walk.answer.count();
        walk.all(self.top);
        let mut work = walk.work;
        work.reported = (walk.answer.count() - before) as u64;
        work.taken_whole = work.reported.saturating_sub(walk.tested);
        (work, walk.answer.finish())
    }
}

/// Unchecked access by number.
impl Osp {
    /// # Safety
    /// `number` is the number of a bucket in the tree.
    #[inline(always)]
    pub(super) unsafe fn known_bucket(&self, number: u32) -> &Bucket {
        // SAFETY: every bucket number in the tree belongs to a bucket in use; `validate` checks it.
        unsafe { self.buckets.known(number) }
    }

    /// # Safety
    /// `number` is the number of one of the first `page_count` pages of a bucket in the tree.
    #[inline(always)]
    pub(super) unsafe fn known_page(&self, number: u32) -> &Page {
        // SAFETY: every number in the tree belongs to an entry in use; `validate` checks this.
        unsafe { self.pages.known(number) }
    }

    /// # Safety
    /// The same as for [`Osp::known_page`].
    #[inline(always)]
    pub(super) unsafe fn known_page_boxes(&self, number: u32) -> &PageBoxes {
        // SAFETY: every number in the tree belongs to an entry in use; `validate` checks this.
        unsafe { self.pages.known_boxes(number) }
    }

    /// # Safety
    /// `number` is the number of a node in the tree.
    #[inline(always)]
    pub(super) unsafe fn known_node(&self, number: u32) -> &Node {
        // SAFETY: every number in the tree belongs to an entry in use; `validate` checks this.
        unsafe { self.nodes.known(number) }
    }
}

/// A queue of fixed capacity. Unused entries are not initialised, because this would cost a small query more than all
/// its tests.
pub(super) struct WorkQueue<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    pushed: usize,
    popped: usize,
}

impl<T: Copy, const N: usize> WorkQueue<T, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], pushed: 0, popped: 0 }
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.pushed - self.popped
    }

    /// Appends an entry to a queue that is not full. The limits below ensure this at compile time.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: T) {
        debug_assert!(self.len() < N, "the queue is full");
        self.entries[self.pushed % N] = MaybeUninit::new(entry);
        self.pushed += 1;
    }

    /// The first entry of a queue that is not empty.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> T {
        assert!(self.popped < self.pushed, "the queue is empty");
        // SAFETY: entries from `popped` to `pushed` have been written, and are overwritten only by other entries.
        let entry = unsafe { self.entries[self.popped % N].assume_init() };
        self.popped += 1;
        entry
    }
}

/// A list of fixed capacity. Unused entries are not initialised, as in [`WorkQueue`].
pub(super) struct List<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    len: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], len: 0 }
    }

    /// Appends an entry to a list that is not full.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: T) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: the places below the length have been written.
        Some(unsafe { self.entries[self.len].assume_init() })
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(super) fn as_slice(&self) -> &[T] {
        // SAFETY: the places below the length have been written.
        unsafe { std::slice::from_raw_parts(self.entries.as_ptr().cast(), self.len) }
    }
}

/// Number of a node, bucket or page that the walk has found, and the planes that cut it.
#[derive(Clone, Copy)]
pub(super) struct Below {
    pub(super) number: u32,
    pub(super) planes: u8,
}

/// A page that the walk has found, and the planes that cut it. `singles` is the number of its runs if all have one polygon,
/// else 0.
#[derive(Clone, Copy)]
struct BelowPage {
    number: u32,
    planes: u8,
    singles: u8,
}

/// A run that planes cut.
#[derive(Clone, Copy)]
struct CutRun<'a> {
    boxes: &'a Boxes<16>,
    first: u32,
    mask: u16,
    planes: u8,
}

/// Position in `cut` of the list of runs that several planes cut.
pub(super) const SEVERAL: usize = 6;

/// A list with at least this number of runs is tested. A page adds at most sixteen runs.
pub(super) const LIST: usize = 16;

/// Largest number of buckets that stay queued while the walk can still find more. A step adds at most nine buckets.
pub(super) const BUCKETS_WAIT: usize = 8;
/// The same limit for pages. A step adds at most sixteen pages.
pub(super) const PAGES_WAIT: usize = 12;

/// Capacity of each queue of buckets or pages, and of each list of runs.
pub(super) const QUEUE: usize = 32;
const _: () = assert!(BUCKETS_WAIT + 9 <= QUEUE && PAGES_WAIT + 16 <= QUEUE && LIST - 1 + 16 <= QUEUE);

/// Number of buckets wholly in view that wait in their queue while the cache lines of their pages are loaded.
const WHOLE_WAIT: usize = 1;

/// Largest number of waiting nodes: seven at each level, and the chain of levels on top.
pub(super) const STACK: usize = 8 * (super::grid::TOP_SHIFT as usize + 1);

struct Walk<'a, K, A> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    kernel: K,
    answer: A,
    work: WorkCounts,
    /// Number of polygons reported after a test of their own box.
    tested: u64,
    buckets: WorkQueue<Below, QUEUE>,
    whole: WorkQueue<u32, { WHOLE_WAIT + 1 }>,
    pages: WorkQueue<BelowPage, QUEUE>,
    /// Runs that a single plane cuts, by plane. The last list has the runs that several planes cut.
    cut: [List<CutRun<'a>, QUEUE>; 7],
    /// Mask of the lists of `cut` that are ready to be tested.
    full: u32,
}

impl<'a, K: Kernel, A: Answer> Walk<'a, K, A> {
    /// Walks the tree from the node `top`. Each step processes the lowest level of the tree on which enough entries
    /// wait. Each kind of entry is processed at one point of this loop, so that the compiler inlines all functions.
    #[inline(always)]
    fn all(&mut self, top: u32) {
        let mut nodes = List::new();
        let top = Below { number: top, planes: PlaneSet::ALL };
        // SAFETY: `top` is in the tree; see `Cull`.
        let own = unsafe { self.osp.known_node(top.number) }.own;
        if !self.osp.is_flat {
            nodes.push(top);
        } else if own != NONE {
            self.enqueue_bucket(Below { number: own, ..top });
        }
        let (mut buckets_wait, mut pages_wait) = (BUCKETS_WAIT, PAGES_WAIT);
        loop {
            while self.full != 0 {
                let list = self.full.trailing_zeros() as usize % 8;
                self.full &= self.full - 1;
                if list == SEVERAL { self.cut_by_several() } else { self.cut_by_one(list) }
            }
            if self.pages.len() > pages_wait {
                self.next_page();
            } else if self.buckets.len() > buckets_wait {
                self.next_bucket();
            } else if let Some(below) = nodes.pop() {
                self.node(below, &mut nodes);
            } else if buckets_wait > 0 {
                buckets_wait = 0;
            } else if pages_wait > 0 {
                pages_wait = 0;
            } else {
                for (i, list) in self.cut.iter().enumerate() {
                    self.full |= u32::from(list.len > 0) << i;
                }
                if self.full == 0 {
                    while self.whole.len() > 0 {
                        self.next_whole();
                    }
                    return;
                }
            }
        }
    }

    #[inline(always)]
    fn node(&mut self, Below { number, planes: mask }: Below, nodes: &mut List<Below, STACK>) {
        // SAFETY: every waiting entry is in the tree.
        let node = unsafe { self.osp.known_node(number) };
        self.work.nodes += 1;
        let sides = self.planes.sides8(self.kernel, mask, &node.boxes);
        count(&mut self.work, 8, mask);
        let mut wanted = !sides.behind & 0xFF;
        while wanted != 0 {
            let child = wanted.trailing_zeros() as usize;
            wanted &= wanted - 1;
            let planes = sides.planes_at(mask, child);
            match node.children[child].target() {
                Target::Nothing => {}
                Target::Leaf(number) => self.enqueue_bucket(Below { number, planes }),
                Target::Node(number) => {
                    // SAFETY: the children of an entry in the tree are in the tree.
                    prefetch_lines::<4, _>(unsafe { self.osp.known_node(number) });
                    nodes.push(Below { number, planes });
                }
            }
        }
        if node.own != NONE {
            self.enqueue_bucket(Below { number: node.own, planes: mask });
        }
    }

    #[inline(always)]
    fn enqueue_bucket(&mut self, below: Below) {
        // SAFETY: the caller found this bucket in the tree.
        let bucket: *const Bucket = unsafe { self.osp.known_bucket(below.number) };
        prefetch_lines::<3, _>(bucket);
        if below.planes != 0 {
            // SAFETY: the bucket is in the tree.
            prefetch_lines::<6, _>(unsafe { &raw const self.osp.known_bucket(below.number).boxes });
        }
        self.buckets.push(below);
    }

    #[inline(always)]
    fn next_bucket(&mut self) {
        let Below { number, planes } = self.buckets.pop();
        // SAFETY: every waiting entry is in the tree.
        let bucket = unsafe { self.osp.known_bucket(number) };
        self.work.nodes += 1;
        if bucket.next != NONE {
            self.enqueue_bucket(Below { number: bucket.next, planes });
        }
        if planes == 0 {
            self.whole_bucket(number, bucket);
            return;
        }
        let sides = self.planes.sides16(self.kernel, planes, &bucket.boxes);
        count(&mut self.work, bucket.page_count, planes);
        let mut wanted = bucket.used() & !sides.behind;
        while wanted != 0 {
            let i = wanted.trailing_zeros() as usize & 15;
            wanted &= wanted - 1;
            let singles = if bucket.single >> i & 1 == 1 { bucket.counts[i] } else { 0 };
            let planes = sides.planes_at(planes, i);
            self.enqueue_page(BelowPage { number: bucket.pages[i], planes, singles });
        }
    }

    /// Prefetches the pages of a bucket inside every plane, and queues the bucket. [`Walk::next_whole`] reports the
    /// pages without a test. If a page contains single polygons, only their ids are read.
    #[inline(always)]
    fn whole_bucket(&mut self, number: u32, bucket: &Bucket) {
        let pages = &bucket.pages[..(bucket.page_count as usize).min(16)];
        self.work.nodes += pages.len() as u64;
        for (i, &number) in pages.iter().enumerate() {
            // SAFETY: the children of an entry in the tree are in the tree.
            let page: *const Page = unsafe { self.osp.known_page(number) };
            if bucket.single >> i & 1 == 1 {
                prefetch_lines::<1, _>(page)
            } else {
                prefetch_lines::<2, _>(page)
            }
        }
        self.whole.push(number);
        if self.whole.len() > WHOLE_WAIT {
            self.next_whole();
        }
    }

    #[inline(always)]
    fn next_whole(&mut self) {
        // SAFETY: every waiting entry is in the tree.
        let bucket = unsafe { self.osp.known_bucket(self.whole.pop()) };
        let pages = &bucket.pages[..(bucket.page_count as usize).min(16)];
        for (i, &number) in pages.iter().enumerate() {
            // SAFETY: a page of a bucket in the tree is in the tree.
            let page = unsafe { self.osp.known_page(number) };
            let runs = u32::from(bucket.counts[i]);
            if bucket.single >> i & 1 == 1 {
                self.answer.single(self.kernel, page, runs);
            } else {
                self.answer.page(self.kernel, page, runs);
            }
        }
    }

    #[inline(always)]
    fn enqueue_page(&mut self, below: BelowPage) {
        // SAFETY: the caller found this page in the tree.
        let page: *const Page = unsafe { self.osp.known_page(below.number) };
        // SAFETY: the page is in the tree.
        let boxes: *const PageBoxes = unsafe { self.osp.known_page_boxes(below.number) };
        if below.singles != 0 {
            // Only the ids and boxes of a page of single polygons are read.
            prefetch_lines::<1, _>(page);
            if below.planes != 0 {
                prefetch_lines::<6, _>(boxes);
            }
        } else {
            prefetch_lines::<2, _>(page);
            if below.planes != 0 {
                prefetch_lines::<7, _>(boxes);
            }
        }
        self.pages.push(below);
    }

    #[inline(always)]
    fn next_page(&mut self) {
        let BelowPage { number, planes, singles } = self.pages.pop();
        // SAFETY: every waiting entry is in the tree.
        let page = unsafe { self.osp.known_page(number) };
        self.work.nodes += 1;
        if singles != 0 {
            let runs = u32::from(singles);
            if planes == 0 {
                self.answer.single(self.kernel, page, runs);
                return;
            }
            // SAFETY: the page is in the tree.
            let boxes = unsafe { self.osp.known_page_boxes(number) };
            count(&mut self.work, runs, planes);
            let behind = self.planes.behind16(self.kernel, planes, &boxes.boxes);
            let seen = ((1 << runs) - 1) & !behind;
            self.tested += u64::from(seen.count_ones());
            self.answer.singles(self.kernel, page, seen);
            return;
        }
        if planes == 0 {
            self.answer.page(self.kernel, page, u32::from(page.runs));
            return;
        }
        // SAFETY: the page is in the tree.
        let boxes = unsafe { self.osp.known_page_boxes(number) };
        count(&mut self.work, u32::from(page.runs), planes);
        let sides = self.planes.sides16(self.kernel, planes, &boxes.boxes);
        let seen = page.used() & !sides.behind;
        // The box of a run of one polygon is the polygon's own box, so the polygon is tested already.
        let exact = u32::from(page.exact);
        self.tested += u64::from((seen & exact).count_ones());
        self.answer.lanes(self.kernel, page, seen & (exact | !sides.cut));
        let cut = seen & sides.cut & !exact;
        let once = sides.cut_once(planes);
        let mut left = planes;
        while left != 0 {
            let plane = left.trailing_zeros() as usize % 8;
            left &= left - 1;
            self.enqueue_cut_by_one(plane, page, boxes, cut & once & sides.cut_by(plane));
        }
        let mut several = cut & !once;
        while several != 0 {
            let i = several.trailing_zeros() as usize & 15;
            several &= several - 1;
            self.enqueue_cut_by_several(page, boxes, i, sides.planes_at(planes, i));
        }
    }

    /// Appends runs of a page to the list of one plane.
    #[inline(always)]
    fn enqueue_cut_by_one(&mut self, plane: usize, page: &Page, of: &PageBoxes, runs: u32) {
        let prepared = self.planes.plane(plane);
        let list = &mut self.cut[plane];
        let mut left = runs;
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            // SAFETY: `i` is a run of several polygons in a page of the tree.
            let boxes = unsafe { store_of(self.osp, of.store[i]) };
            prepared.prefetch(boxes);
            list.push(CutRun { boxes, first: page.first[i], mask: page.masks[i], planes: 0 });
        }
        self.full |= u32::from(list.len >= LIST) << plane;
    }

    #[inline(always)]
    fn enqueue_cut_by_several(&mut self, page: &Page, of: &PageBoxes, i: usize, planes: u8) {
        // SAFETY: `i` is a run of several polygons in a page of the tree.
        let boxes = unsafe { store_of(self.osp, of.store[i]) };
        prefetch_lines::<6, _>(boxes);
        let run = CutRun { boxes, first: page.first[i], mask: page.masks[i], planes };
        let list = &mut self.cut[SEVERAL];
        list.push(run);
        self.full |= u32::from(list.len >= LIST) << SEVERAL;
    }

    /// Tests the polygons of the runs that one plane cuts.
    #[inline(always)]
    fn cut_by_one(&mut self, list: usize) {
        let plane = self.planes.plane(list);
        let mut tested = 0;
        for run in self.cut[list].as_slice() {
            let lanes = u32::from(run.mask) << (run.first % 16);
            let behind = self.kernel.behind(&plane, run.boxes);
            self.answer.run(self.kernel, run.first & !15, lanes & !behind);
            tested += u64::from((lanes & !behind).count_ones());
            count(&mut self.work, lanes.count_ones(), 1 << list);
        }
        self.cut[list].len = 0;
        self.tested += tested;
    }

    /// Tests the polygons of the runs that several planes cut.
    #[inline(always)]
    fn cut_by_several(&mut self) {
        let mut tested = 0;
        for run in self.cut[SEVERAL].as_slice() {
            let lanes = u32::from(run.mask) << (run.first % 16);
            count(&mut self.work, lanes.count_ones(), run.planes);
            let behind = self.planes.behind(self.kernel, run.planes, run.boxes);
            self.answer.run(self.kernel, run.first & !15, lanes & !behind);
            tested += u64::from((lanes & !behind).count_ones());
        }
        self.cut[SEVERAL].len = 0;
        self.tested += tested;
    }
}

/// Counts tests of `boxes` boxes against each plane of `planes`.
#[inline(always)]
pub(super) fn count(work: &mut WorkCounts, boxes: u32, planes: u8) {
    work.boxes += u64::from(boxes);
    work.planes += u64::from(boxes * planes.count_ones());
}

/// The exact boxes of the polygons of a run.
///
/// # Safety
/// `number` is the `store` of a run that is in the tree and has several polygons.
#[inline(always)]
pub(super) unsafe fn store_of(osp: &Osp, number: u32) -> &Boxes<16> {
    // SAFETY: the store of a run of several polygons is in use; `validate` checks it.
    unsafe { osp.store.known_boxes(number) }
}
