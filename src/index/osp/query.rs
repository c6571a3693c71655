#![expect(
    unsafe_code,
    reason = "numbers found in the tree are looked up without a check, and queues begin without contents"
)]
//! The frustum query: from the top down, eight children, sixteen pages, sixteen runs and at last sixteen polygons at
//! a time. What lies inside every plane is taken without another test.
//!
//! Buckets and pages wait in a short queue each, after their cache lines have been asked for: most of the time of a
//! query is memory, and so it is spent on many lines at once. Runs that one plane cuts wait in that plane's list, and
//! a full list is worked off with the plane in registers.

use std::mem::MaybeUninit;

use super::{
    answer::{Answer, Blocks, Ids},
    index::Osp,
    layout::{Bucket, Node, Page, PageBoxes, Target},
    linear::Pass,
    pool::NONE,
};
use crate::{
    index::{
        DrawList, WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, WithKernel, prefetch_lines},
    },
    math::Frustum,
    polygon::{BLOCK, VisibleBlocks},
};

impl Osp {
    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts {
        self.answer(frustum, Ids::new(draw_list)).0
    }

    fn answer<A: Answer>(&self, frustum: &Frustum, answer: A) -> (WorkCounts, A::Done) {
        if self.is_linear {
            self.backend.run(Pass { linear: &self.linear, frustum, answer })
        } else {
            self.backend.run(Cull { osp: self, planes: &PlaneSet::new(frustum), answer })
        }
    }

    /// The numbers of all polygons lie below, those of the open block, too.
    fn ids_end(&self) -> usize {
        if self.is_linear {
            return self.linear.ids_end();
        }
        let open = if self.open.lanes() == 0 { 0 } else { (self.open.block() as usize + 1) * BLOCK };
        self.ids.ids_end().max(open)
    }

    pub(super) fn cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let answer = Blocks::new(visible.masks_for(self.ids_end()));
        let (work, (blocks, found)) = self.answer(frustum, answer);
        visible.note_filled(blocks, found);
        work
    }
}

struct Cull<'a, A> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    answer: A,
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
            buckets: Waiting::new(),
            whole: Waiting::new(),
            pages: Waiting::new(),
            cut: std::array::from_fn(|_| List::new()),
            full: 0,
        };
        let before = walk.answer.count();
        walk.all();
        let mut work = walk.work;
        work.reported = (walk.answer.count() - before) as u64;
        work.taken_whole = work.reported.saturating_sub(walk.tested);
        (work, walk.answer.finish())
    }
}

/// A queue of fixed length. What is not in it has never been written: filling the queues would cost a small query more than
/// all its tests.
struct Waiting<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    pushed: usize,
    popped: usize,
}

impl<T: Copy, const N: usize> Waiting<T, N> {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], pushed: 0, popped: 0 }
    }

    #[inline(always)]
    fn len(&self) -> usize {
        self.pushed - self.popped
    }

    /// Appends an entry to a queue that is not full.
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
        // SAFETY: places from `popped` to `pushed` have been written; a place is overwritten by entries only.
        let entry = unsafe { self.entries[self.popped % N].assume_init() };
        self.popped += 1;
        entry
    }
}

/// A list of fixed length; as [`Waiting`].
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
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts(self.entries.as_ptr().cast(), self.len) }
    }
}

/// A node, bucket or page by its number, and the planes that cut it.
#[derive(Clone, Copy)]
struct Below {
    number: u32,
    planes: u8,
}

/// A page inside every plane.
#[derive(Clone, Copy)]
struct Whole {
    number: u32,
    runs: u8,
    single: bool,
}

/// A run that planes cut.
#[derive(Clone, Copy)]
struct CutRun<'a> {
    boxes: &'a Boxes<16>,
    first: u32,
    mask: u16,
    planes: u8,
}

/// The list of runs that several planes cut.
const SEVERAL: usize = 6;

/// A list is worked off when it is this long; a page adds sixteen at most.
const LIST: usize = 16;

/// How many wait while more can be found. The next step adds nine buckets or sixteen pages at most, which still fit
/// into a queue of 32.
const BUCKETS_WAIT: usize = 8;
const PAGES_WAIT: usize = 12;

/// Whole pages that wait; a bucket adds sixteen at most, which still fit into a queue of 32.
const WHOLE_WAIT: usize = 14;

/// Nodes that wait at most: seven at each level, and the chain of levels on top.
const STACK: usize = 8 * (super::grid::TOP_SHIFT as usize + 1);

struct Walk<'a, K, A> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    kernel: K,
    answer: A,
    work: WorkCounts,
    /// Polygons reported after a test of their own.
    tested: u64,
    buckets: Waiting<Below, 32>,
    whole: Waiting<Whole, 32>,
    pages: Waiting<Below, 32>,
    /// The runs that one plane cuts, by plane, and those that several cut.
    cut: [List<CutRun<'a>, 32>; 7],
    /// The lists that are long enough.
    full: u32,
}

impl<'a, K: Kernel, A: Answer> Walk<'a, K, A> {
    #[inline(always)]
    fn bucket(&self, number: u32) -> &'a Bucket {
        // SAFETY: every number that hangs in the tree is of a bucket in use; `validate` checks it.
        unsafe { self.osp.buckets.known(number) }
    }

    #[inline(always)]
    fn page(&self, number: u32) -> &'a Page {
        // SAFETY: as for buckets.
        unsafe { self.osp.pages.known(number) }
    }

    #[inline(always)]
    fn page_boxes(&self, number: u32) -> &'a PageBoxes {
        // SAFETY: as for buckets.
        unsafe { self.osp.pages.known_boxes(number) }
    }

    #[inline(always)]
    fn node_of(&self, number: u32) -> &'a Node {
        // SAFETY: as for buckets.
        unsafe { self.osp.nodes.known(number) }
    }

    /// Works off what lies lowest first, as long as more waits there than is worth waiting for; each kind of work has
    /// one place in this loop, so that all of it is compiled in line.
    #[inline(always)]
    fn all(&mut self) {
        self.open_block();
        let mut nodes = List::new();
        let top = Below { number: self.osp.top, planes: PlaneSet::ALL };
        let node = self.node_of(top.number);
        if self.osp.ids.entries() <= self.osp.len && self.holds_all(node) {
            // The order of ids is the order of memory, and nothing of the tree has to be read.
            self.answer.all(self.kernel, &self.osp.ids);
        } else if !self.osp.is_flat {
            nodes.push(top);
        } else if node.own != NONE {
            self.wait_for_bucket(Below { number: node.own, ..top });
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
        let node = self.node_of(number);
        self.work.nodes += 1;
        let sides = self.planes.sides8(self.kernel, mask, &node.boxes);
        count(&mut self.work, 8, mask);
        let mut seen = !sides.behind & 0xFF;
        while seen != 0 {
            let child = seen.trailing_zeros() as usize;
            seen &= seen - 1;
            let planes = sides.planes_at(mask, child);
            match node.children[child].target() {
                Target::Nothing => {}
                Target::Leaf(number) => self.wait_for_bucket(Below { number, planes }),
                Target::Node(number) => {
                    prefetch_lines::<4, _>(self.node_of(number));
                    nodes.push(Below { number, planes });
                }
            }
        }
        if node.own != NONE {
            self.wait_for_bucket(Below { number: node.own, planes: mask });
        }
    }

    /// Whether all that is in the tree lies inside every plane; looks no further than to the first plane that says no.
    #[inline(always)]
    fn holds_all(&mut self, top: &Node) -> bool {
        self.work.nodes += 1;
        let used = top.used();
        if used != 0 {
            count(&mut self.work, 8, PlaneSet::ALL);
            if !self.planes.hold(self.kernel, &top.boxes, used) {
                return false;
            }
        }
        let mut at = top.own;
        while at != NONE {
            let bucket = self.bucket(at);
            count(&mut self.work, bucket.page_count, PlaneSet::ALL);
            let [low, high] = &bucket.boxes.0;
            let used = bucket.used();
            if !(self.planes.hold(self.kernel, low, used & 0xFF)
                && self.planes.hold(self.kernel, high, used >> 8))
            {
                return false;
            }
            at = bucket.next;
        }
        true
    }

    #[inline(always)]
    fn open_block(&mut self) {
        let lanes = u32::from(self.osp.open.lanes());
        if lanes != 0 {
            count(&mut self.work, lanes.count_ones(), PlaneSet::ALL);
            let seen = lanes & !self.planes.behind_any(self.kernel, self.osp.open.rows());
            self.answer.run(self.kernel, self.osp.open.block() * 16, seen);
            self.tested += u64::from(seen.count_ones());
        }
    }

    #[inline(always)]
    fn wait_for_bucket(&mut self, below: Below) {
        let bucket: *const Bucket = self.bucket(below.number);
        prefetch_lines::<3, _>(bucket);
        if below.planes != 0 {
            prefetch_lines::<6, _>(bucket.cast::<[u8; 192]>().wrapping_add(1));
        }
        self.buckets.push(below);
    }

    #[inline(always)]
    fn next_bucket(&mut self) {
        let Below { number, planes } = self.buckets.pop();
        let bucket = self.bucket(number);
        self.work.nodes += 1;
        if bucket.next != NONE {
            self.wait_for_bucket(Below { number: bucket.next, planes });
        }
        if planes == 0 {
            self.whole_bucket(bucket);
            return;
        }
        let sides = self.planes.sides16(self.kernel, planes, &bucket.boxes);
        count(&mut self.work, bucket.page_count, planes);
        let mut seen = bucket.used() & !sides.behind;
        while seen != 0 {
            let i = seen.trailing_zeros() as usize & 15;
            seen &= seen - 1;
            let below = Below { number: bucket.pages[i], planes: sides.planes_at(planes, i) };
            self.wait_for_page(below);
        }
    }

    /// Takes all pages of a bucket without a test, when they have come from memory. Of pages of single polygons only
    /// the ids are read.
    #[inline(always)]
    fn whole_bucket(&mut self, bucket: &Bucket) {
        let pages = &bucket.pages[..(bucket.page_count as usize).min(16)];
        self.work.nodes += pages.len() as u64;
        for (i, &number) in pages.iter().enumerate() {
            let single = bucket.single >> i & 1 == 1;
            let page: *const Page = self.page(number);
            if single {
                prefetch_lines::<1, _>(page)
            } else {
                prefetch_lines::<2, _>(page)
            }
            self.whole.push(Whole { number, runs: bucket.counts[i], single });
        }
        while self.whole.len() > WHOLE_WAIT {
            self.next_whole();
        }
    }

    #[inline(always)]
    fn next_whole(&mut self) {
        let Whole { number, runs, single } = self.whole.pop();
        let page = self.page(number);
        if single {
            self.answer.single(self.kernel, page, u32::from(runs));
        } else {
            self.answer.page(self.kernel, page, u32::from(runs));
        }
    }

    #[inline(always)]
    fn wait_for_page(&mut self, below: Below) {
        prefetch_lines::<2, Page>(self.page(below.number));
        if below.planes != 0 {
            prefetch_lines::<7, PageBoxes>(self.page_boxes(below.number));
        }
        self.pages.push(below);
    }

    #[inline(always)]
    fn next_page(&mut self) {
        let Below { number, planes } = self.pages.pop();
        let page = self.page(number);
        self.work.nodes += 1;
        if planes == 0 {
            self.answer.page(self.kernel, page, u32::from(page.runs));
            return;
        }
        let boxes = self.page_boxes(number);
        let sides = self.planes.sides16(self.kernel, planes, &boxes.boxes);
        count(&mut self.work, u32::from(page.runs), planes);
        let seen = page.used() & !sides.behind;
        // A run of one has its polygon's own box: it has had its test.
        let exact = u32::from(page.exact);
        self.tested += u64::from((seen & exact).count_ones());
        self.answer.lanes(self.kernel, page, seen & (exact | !sides.cut));
        let cut = seen & sides.cut & !exact;
        let once = sides.cut_once(planes);
        let mut left = planes;
        while left != 0 {
            let plane = left.trailing_zeros() as usize % 8;
            left &= left - 1;
            self.wait_for_one(plane, page, boxes, cut & once & sides.cut_by(plane));
        }
        let mut several = cut & !once;
        while several != 0 {
            let i = several.trailing_zeros() as usize & 15;
            several &= several - 1;
            self.wait_for_several(page, boxes, i, sides.planes_at(planes, i));
        }
    }

    /// Appends runs of a page to the list of one plane.
    #[inline(always)]
    fn wait_for_one(&mut self, plane: usize, page: &Page, of: &PageBoxes, runs: u32) {
        let prepared = self.planes.plane(plane);
        let list = &mut self.cut[plane];
        let mut left = runs;
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let boxes = store_of(self.osp, of.store[i]);
            prepared.prefetch(boxes);
            list.push(CutRun { boxes, first: page.first[i], mask: page.masks[i], planes: 0 });
        }
        self.full |= u32::from(list.len >= LIST) << plane;
    }

    #[inline(always)]
    fn wait_for_several(&mut self, page: &Page, of: &PageBoxes, i: usize, planes: u8) {
        let boxes = store_of(self.osp, of.store[i]);
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
        let before = self.answer.count();
        for run in self.cut[list].as_slice() {
            let lanes = u32::from(run.mask) << (run.first % 16);
            let seen = lanes & !self.kernel.behind(&plane, run.boxes);
            self.answer.run(self.kernel, run.first & !15, seen);
            count(&mut self.work, lanes.count_ones(), 1 << list);
        }
        self.cut[list].len = 0;
        self.tested += (self.answer.count() - before) as u64;
    }

    /// Tests the polygons of the runs that several planes cut.
    #[inline(always)]
    fn cut_by_several(&mut self) {
        let before = self.answer.count();
        for run in self.cut[SEVERAL].as_slice() {
            let lanes = u32::from(run.mask) << (run.first % 16);
            count(&mut self.work, lanes.count_ones(), run.planes);
            let seen = lanes & !self.planes.behind(self.kernel, run.planes, run.boxes);
            self.answer.run(self.kernel, run.first & !15, seen);
        }
        self.cut[SEVERAL].len = 0;
        self.tested += (self.answer.count() - before) as u64;
    }
}

/// Notes that so many boxes are tested against each of these planes.
#[inline(always)]
fn count(work: &mut WorkCounts, boxes: u32, planes: u8) {
    work.boxes += u64::from(boxes);
    work.planes += u64::from(boxes * planes.count_ones());
}

/// The exact boxes of a run of several.
#[inline(always)]
fn store_of(osp: &Osp, number: u32) -> &Boxes<16> {
    // SAFETY: only runs of several are cut, and theirs is in use; `validate` checks it.
    unsafe { osp.ids.known_boxes(number) }
}
