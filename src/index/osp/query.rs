#![expect(
    unsafe_code,
    reason = "numbers found in the tree are looked up without a check, and queues begin without contents"
)]
//! The frustum query of the tree, for one view or for two eyes. It tests eight children of a node, sixteen pages, sixteen
//! runs, and at last sixteen polygons at a time. The polygons of boxes inside every plane are reported without further
//! tests. For two eyes, it reads a node, bucket, page or run once and tests each box for both.
//!
//! Buckets and pages wait in short queues while their cache lines are prefetched. A query mostly waits for memory, so it
//! requests many lines at once. Runs that one plane cuts wait in that plane's list. A full list is tested with the plane in
//! registers.

use std::mem::MaybeUninit;

use super::{
    answer::Answer,
    index::Osp,
    layout::{Bucket, Node, Page, Target},
    pool::NONE,
};
use crate::index::{
    WorkCounts,
    simd::{Boxes, Kernel, PlaneSet, Sides, WithKernel, lanes_of, prefetch_lines},
};

/// A walk over the tree that finds the polygons inside the frustum of each view. The planes with the same number should
/// be alike.
pub(super) struct Cull<'a, A, const V: usize> {
    pub(super) osp: &'a Osp,
    pub(super) planes: &'a [PlaneSet; V],
    pub(super) answer: A,
}

impl<A: Answer<V>, const V: usize> WithKernel for Cull<'_, A, V> {
    type Output = (WorkCounts, A);

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
        let before = walk.answer.found();
        walk.all();
        let mut work = walk.work;
        work.reported = (walk.answer.found() - before) as u64;
        work.taken_whole = work.reported.saturating_sub(walk.tested);
        (work, walk.answer)
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
    /// `number` is the number of a node in the tree.
    #[inline(always)]
    pub(super) unsafe fn known_node(&self, number: u32) -> &Node {
        // SAFETY: every number in the tree belongs to an entry in use; `validate` checks this.
        unsafe { self.nodes.known(number) }
    }
}

/// A queue of fixed capacity. Unused entries are not initialised, because this would cost a small query more than all
/// its tests.
struct WorkQueue<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    pushed: usize,
    popped: usize,
}

impl<T: Copy, const N: usize> WorkQueue<T, N> {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], pushed: 0, popped: 0 }
    }

    #[inline(always)]
    fn len(&self) -> usize {
        self.pushed - self.popped
    }

    /// Appends an entry to a queue that is not full. The limits below ensure this at compile time.
    #[inline(always)]
    fn push(&mut self, entry: T) {
        debug_assert!(self.len() < N, "the queue is full");
        self.entries[self.pushed % N] = MaybeUninit::new(entry);
        self.pushed += 1;
    }

    /// The first entry of a queue that is not empty.
    #[inline(always)]
    fn pop(&mut self) -> T {
        assert!(self.popped < self.pushed, "the queue is empty");
        // SAFETY: entries from `popped` to `pushed` have been written, and are overwritten only by other entries.
        let entry = unsafe { self.entries[self.popped % N].assume_init() };
        self.popped += 1;
        entry
    }
}

/// A list of fixed capacity. Unused entries are not initialised, as in [`WorkQueue`].
struct List<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    len: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], len: 0 }
    }

    /// Appends an entry to a list that is not full.
    #[inline(always)]
    fn push(&mut self, entry: T) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: the places below the length have been written.
        Some(unsafe { self.entries[self.len].assume_init() })
    }

    #[inline(always)]
    fn as_slice(&self) -> &[T] {
        // SAFETY: the places below the length have been written.
        unsafe { std::slice::from_raw_parts(self.entries.as_ptr().cast(), self.len) }
    }
}

/// Number of a node, bucket or page that the walk has found, and the planes that cut it.
#[derive(Clone, Copy)]
struct Below {
    number: u32,
    planes: u8,
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
const SEVERAL: usize = 6;

/// A list with at least this number of runs is tested. A page adds at most sixteen runs.
const LIST: usize = 16;

/// Largest number of buckets that stay queued while the walk can still find more. A step adds at most nine buckets.
const BUCKETS_WAIT: usize = 8;
/// The same limit for pages. A step adds at most sixteen pages.
const PAGES_WAIT: usize = 12;

/// Capacity of each queue of buckets or pages, and of each list of runs.
const QUEUE: usize = 32;
const _: () = assert!(BUCKETS_WAIT + 9 <= QUEUE && PAGES_WAIT + 16 <= QUEUE && LIST - 1 + 16 <= QUEUE);

/// Number of buckets wholly in view that wait in their queue while the cache lines of their pages are loaded.
const WHOLE_WAIT: usize = 1;

/// Largest number of waiting nodes: seven at each level, and the chain of levels on top.
const STACK: usize = 8 * (super::grid::TOP_SHIFT as usize + 1);

struct Walk<'a, K, A, const V: usize> {
    osp: &'a Osp,
    planes: &'a [PlaneSet; V],
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

impl<'a, K: Kernel, A: Answer<V>, const V: usize> Walk<'a, K, A, V> {
    /// Walks the tree from its top. Each step processes the lowest level of the tree on which enough entries
    /// wait. Each kind of entry is processed at one point of this loop, so that the compiler inlines all functions.
    #[inline(always)]
    fn all(&mut self) {
        let mut nodes = List::new();
        nodes.push(Below { number: self.osp.top, planes: PlaneSet::ALL });
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

    /// Adds the tests for the other views to the result for the first. Returns the boxes behind a plane of each view. A box
    /// that a view does not see stays cut by the plane before it, so all that lies below is tested against that plane.
    #[inline(always)]
    fn join_views<const B: usize>(&self, sides: &mut Sides, mask: u8, boxes: &Boxes<B>) -> [u32; V] {
        let mut behind = [sides.behind; V];
        for (behind, view) in behind.iter_mut().zip(self.planes).skip(1) {
            let other = view.sides(self.kernel, mask, boxes);
            *behind = other.behind;
            sides.join(&other);
        }
        behind
    }

    #[inline(always)]
    fn node(&mut self, Below { number, planes: mask }: Below, nodes: &mut List<Below, STACK>) {
        // SAFETY: every waiting entry is in the tree.
        let node = unsafe { self.osp.known_node(number) };
        self.work.nodes += 1;
        let mut sides = self.planes[0].sides(self.kernel, mask, &node.boxes);
        self.join_views(&mut sides, mask, &node.boxes);
        count(&mut self.work, 8 * V as u32, mask);
        for child in lanes_of(!sides.behind & 0xFF) {
            let planes = sides.planes_at(mask, child);
            match node.children[child % 8].target() {
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
        let bucket = unsafe { self.osp.known_bucket(below.number) };
        prefetch_lines::<3, Bucket>(bucket);
        if below.planes != 0 {
            prefetch_lines::<6, _>(&raw const bucket.boxes);
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
        let mut sides = self.planes[0].sides(self.kernel, planes, &bucket.boxes);
        self.join_views(&mut sides, planes, &bucket.boxes);
        count(&mut self.work, bucket.page_count * V as u32, planes);
        for i in lanes_of(bucket.used() & !sides.behind) {
            let singles = if bucket.single >> i & 1 == 1 { bucket.counts[i % 16] } else { 0 };
            let planes = sides.planes_at(planes, i);
            self.enqueue_page(BelowPage { number: bucket.pages[i % 16], planes, singles });
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
            self.whole_page(page, u32::from(bucket.counts[i]), bucket.single >> i & 1 == 1);
        }
    }

    /// Reports a page inside every plane. `is_single` tells whether all its runs have one polygon.
    #[inline(always)]
    fn whole_page(&mut self, page: &Page, runs: u32, is_single: bool) {
        if is_single {
            self.answer.single(self.kernel, page, runs);
        } else {
            self.answer.page(self.kernel, page, runs);
        }
    }

    #[inline(always)]
    fn enqueue_page(&mut self, below: BelowPage) {
        // SAFETY: the caller found this page in the tree.
        let page = unsafe { self.osp.known_page(below.number) };
        // Only the ids and boxes of a page of single polygons are read.
        match below.singles {
            0 => prefetch_lines::<2, Page>(page),
            _ => prefetch_lines::<1, Page>(page),
        }
        match (below.planes, below.singles) {
            (0, _) => {}
            (_, 0) => prefetch_lines::<7, _>(&raw const page.boxes),
            _ => prefetch_lines::<6, _>(&raw const page.boxes),
        }
        self.pages.push(below);
    }

    #[inline(always)]
    fn next_page(&mut self) {
        let BelowPage { number, planes, singles } = self.pages.pop();
        // SAFETY: every waiting entry is in the tree.
        let page = unsafe { self.osp.known_page(number) };
        self.work.nodes += 1;
        let runs = if singles != 0 { singles } else { page.runs };
        if planes == 0 {
            self.whole_page(page, u32::from(runs), singles != 0);
            return;
        }
        count(&mut self.work, u32::from(runs) * V as u32, planes);
        if singles != 0 {
            let mut lanes = [(1 << runs) - 1; V];
            for (lanes, view) in lanes.iter_mut().zip(self.planes) {
                *lanes &= !view.behind(self.kernel, planes, &page.boxes);
                self.tested += u64::from(lanes.count_ones());
            }
            self.answer.singles(self.kernel, page, lanes);
            return;
        }
        let mut sides = self.planes[0].sides(self.kernel, planes, &page.boxes);
        let behind = self.join_views(&mut sides, planes, &page.boxes);
        // The box of a run of one polygon is the polygon's own box, so the polygon is tested already.
        let exact = u32::from(page.exact);
        let mut lanes = [page.used(); V];
        for (lanes, behind) in lanes.iter_mut().zip(behind) {
            *lanes &= !behind & (exact | !sides.cut);
            self.tested += u64::from((*lanes & exact).count_ones());
        }
        self.answer.lanes(self.kernel, page, lanes);
        let cut = page.used() & !sides.behind & sides.cut & !exact;
        let once = sides.cut_once(planes);
        for plane in lanes_of(planes) {
            self.enqueue_cut_by_one(plane, page, cut & once & sides.cut_by(plane));
        }
        for i in lanes_of(cut & !once) {
            self.enqueue_cut_by_several(page, i % 16, sides.planes_at(planes, i));
        }
    }

    /// Appends runs of a page to the list of one plane.
    #[inline(always)]
    fn enqueue_cut_by_one(&mut self, plane: usize, page: &Page, runs: u32) {
        let prepared = self.planes[0].plane(plane);
        let list = &mut self.cut[plane];
        for i in lanes_of(runs) {
            let i = i % 16;
            // SAFETY: `i` is a run of several polygons in a page of the tree.
            let boxes = unsafe { store_of(self.osp, page.store[i]) };
            // The planes of the other views mostly read the same rows.
            prepared.prefetch(boxes);
            list.push(CutRun { boxes, first: page.first[i], mask: page.masks[i], planes: 0 });
        }
        self.full |= u32::from(list.len >= LIST) << plane;
    }

    #[inline(always)]
    fn enqueue_cut_by_several(&mut self, page: &Page, i: usize, planes: u8) {
        // SAFETY: `i` is a run of several polygons in a page of the tree.
        let boxes = unsafe { store_of(self.osp, page.store[i]) };
        prefetch_lines::<6, _>(boxes);
        let run = CutRun { boxes, first: page.first[i], mask: page.masks[i], planes };
        let list = &mut self.cut[SEVERAL];
        list.push(run);
        self.full |= u32::from(list.len >= LIST) << SEVERAL;
    }

    /// Tests the polygons of the runs that one plane cuts.
    #[inline(always)]
    fn cut_by_one(&mut self, list: usize) {
        // A copy of the plane stays in registers.
        let plane = self.planes[0].plane(list);
        let mut tested = 0;
        for run in self.cut[list].as_slice() {
            let lanes = u32::from(run.mask) << (run.first % 16);
            let mut seen = [lanes & !self.kernel.behind(&plane, run.boxes); V];
            tested += u64::from(seen[0].count_ones());
            for (seen, view) in seen.iter_mut().zip(self.planes).skip(1) {
                *seen = lanes & !self.kernel.behind(&view.planes[list], run.boxes);
                tested += u64::from(seen.count_ones());
            }
            self.answer.run(self.kernel, run.first & !15, seen);
            count(&mut self.work, lanes.count_ones() * V as u32, 1 << list);
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
            let mut seen = [lanes; V];
            for (seen, view) in seen.iter_mut().zip(self.planes) {
                *seen &= !view.behind(self.kernel, run.planes, run.boxes);
                tested += u64::from(seen.count_ones());
            }
            self.answer.run(self.kernel, run.first & !15, seen);
            count(&mut self.work, lanes.count_ones() * V as u32, run.planes);
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
unsafe fn store_of(osp: &Osp, number: u32) -> &Boxes<16> {
    // SAFETY: the store of a run of several polygons is in use; `validate` checks it.
    unsafe { osp.store.known_boxes(number) }
}
