#![expect(unsafe_code, reason = "numbers found in the tree are looked up without a check")]
//! The frustum query of two eyes in one walk.
//!
//! The walk is like the walk of `query.rs`. It reads a node, bucket, page or run once. It tests each box for both eyes,
//! against those planes of each eye that cut the parent's box. It tests nothing below a box inside all planes. Each eye
//! gets the same result as in a query of its own: the polygons whose boxes pass all its planes.
//!
//! Both eyes see nearly the same, so a polygon that both see is written once. The first set contains the polygons of the
//! first eye. During the walk, the second set contains the polygons that only one eye sees.
//!
//! The walls of a CAVE, the faces of a cube map and shadow cascades are culled one after the other, because they share
//! few nodes. A common walk would save less than the bookkeeping for several views costs.

use std::ops::Range;

use super::{
    index::Osp,
    layout::{Bucket, Page, PageBoxes, Target},
    pair_sets::{BOTH, Sets},
    pool::NONE,
    query::{BUCKETS_WAIT, LIST, List, PAGES_WAIT, QUEUE, SEVERAL, STACK, WorkQueue, count, store_of},
};
use crate::{
    index::{
        WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, WithKernel, prefetch_lines},
    },
    math::Frustum,
    polygon::{BLOCK, VisibleBlocks},
};

/// Least scalar product of the normals of two similar planes.
const ALIKE: f32 = 0.9;
/// Largest number of whole pages in the queue when a bucket adds its pages, at most sixteen.
const WHOLE_WAIT: usize = 14;
const _: () = assert!(WHOLE_WAIT + 16 <= QUEUE);
/// The distances between opposite planes are similar if neither is larger than the other by more than this factor.
const AS_WIDE: f32 = 1.25;

impl Osp {
    /// Culls one view for each set.
    pub(super) fn cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        let views = frusta.len().min(visible.len());
        let mut at = 0;
        while at < views {
            match (&frusta[at..views], &mut visible[at..views]) {
                ([a, b, ..], [first, second, ..]) if !self.store.are_scattered() && are_alike(a, b) => {
                    let planes = [PlaneSet::new(a), PlaneSet::new(b)];
                    if let Some(of_first) = self.cull_in_order(&planes[0], first) {
                        work += of_first;
                        work += self.cull_blocks(b, second);
                    } else {
                        work += self.cull_pair(&planes, [&mut *first, &mut *second]);
                        work += self.cull_unfiled(&planes[0], first);
                        work += self.cull_unfiled(&planes[1], second);
                    }
                    at += 2;
                }
                _ => {
                    work += self.cull_blocks(&frusta[at], &mut visible[at]);
                    at += 1;
                }
            }
        }
        work
    }

    fn cull_pair(&self, planes: &[PlaneSet; 2], visible: [&mut VisibleBlocks; 2]) -> WorkCounts {
        let mut same = 0;
        for plane in 0..6 {
            same |= u8::from(planes[0].plane(plane).has_normal_of(&planes[1].plane(plane))) << plane;
        }
        let end = self.store.ids_end();
        let [first, second] = visible;
        let masks = [first.masks_for(end), second.masks_for(end)];
        let (work, span, [of_first, of_second]) = self.backend.run(Pair { osp: self, planes, same, masks });
        first.note_filled(span.clone(), of_first);
        second.note_filled(span, of_second);
        work
    }
}

/// Whether two views see nearly the same: each plane of the first has nearly the normal of the second's plane, and the
/// distance between opposite planes is nearly equal.
fn are_alike(a: &Frustum, b: &Frustum) -> bool {
    let (a, b) = (a.planes(), b.planes());
    let slabs = (0..6).flat_map(|i| (0..i).map(move |j| (i, j)));
    a.iter().zip(b).all(|(a, b)| a.normal.dot(b.normal) > ALIKE)
        && slabs.filter(|&(i, j)| a[i].normal.dot(a[j].normal) < -ALIKE).all(|(i, j)| {
            let (wide, other) = (a[i].d + a[j].d, b[i].d + b[j].d);
            wide <= other * AS_WIDE && other <= wide * AS_WIDE
        })
}

struct Pair<'a> {
    osp: &'a Osp,
    planes: &'a [PlaneSet; 2],
    same: u8,
    masks: [&'a mut [u16]; 2],
}

impl WithKernel for Pair<'_> {
    /// Work, range of written blocks, and number of polygons that each eye sees.
    type Output = (WorkCounts, Range<usize>, [usize; 2]);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        let mut walk = Walk {
            osp: self.osp,
            planes: self.planes,
            same: self.same,
            kernel,
            answers: Sets::new(self.masks),
            work: WorkCounts::default(),
            tested: 0,
            buckets: WorkQueue::new(),
            whole: WorkQueue::new(),
            pages: WorkQueue::new(),
            cut: std::array::from_fn(|_| List::new()),
            full: 0,
        };
        walk.all();
        let mut work = walk.work;
        work.reported = walk.answers.count() as u64;
        work.taken_whole = work.reported.saturating_sub(walk.tested);
        let found = walk.answers.found;
        (work, walk.answers.finish(), found)
    }
}

/// Number of a node, bucket or page that the walk has found, the eyes that may see it, and the planes that cut it.
#[derive(Clone, Copy)]
struct Below {
    number: u32,
    planes: u8,
    eyes: u8,
}

/// A page inside every plane of the eyes that see it.
#[derive(Clone, Copy)]
struct Whole {
    number: u32,
    runs: u8,
    eyes: u8,
}

/// A run that planes cut.
#[derive(Clone, Copy)]
struct CutRun<'a> {
    boxes: &'a Boxes<16>,
    first: u32,
    mask: u16,
    planes: u8,
    eyes: u8,
}

/// Results of a test of boxes against the planes of both eyes, one bit for each box.
struct Seen {
    /// The boxes that each eye may see.
    by: [u32; 2],
    /// The boxes that an eye may see and that one of its planes cuts.
    cut: u32,
    /// The boxes of `cut` by plane, for the tested planes only.
    cut_by: [u32; 6],
}

impl Seen {
    #[inline(always)]
    fn by_any(&self) -> u32 {
        self.by[0] | self.by[1]
    }

    #[inline(always)]
    fn eyes(&self, lane: usize) -> u8 {
        (self.by[0] >> lane & 1 | (self.by[1] >> lane & 1) << 1) as u8
    }

    /// The planes of `mask` that cut the box in a lane.
    #[inline(always)]
    fn planes(&self, mask: u8, lane: usize) -> u8 {
        if mask & mask.wrapping_sub(1) == 0 {
            return if self.cut >> lane & 1 == 1 { mask } else { 0 };
        }
        let mut planes = 0;
        let mut left = mask;
        while left != 0 {
            let plane = left.trailing_zeros() as usize;
            left &= left - 1;
            planes |= ((self.cut_by[plane] >> lane & 1) as u8) << plane;
        }
        planes
    }
}

struct Walk<'a, K> {
    osp: &'a Osp,
    planes: &'a [PlaneSet; 2],
    /// The planes whose normals are equal for both eyes.
    same: u8,
    kernel: K,
    answers: Sets<'a>,
    work: WorkCounts,
    /// Number of polygons reported after a test of their own box.
    tested: u64,
    buckets: WorkQueue<Below, QUEUE>,
    whole: WorkQueue<Whole, QUEUE>,
    pages: WorkQueue<Below, QUEUE>,
    /// Runs that a single plane cuts, by plane. The last list has the runs that several planes cut.
    cut: [List<CutRun<'a>, QUEUE>; 7],
    /// Mask of the lists of `cut` that are ready to be tested.
    full: u32,
}

impl<'a, K: Kernel> Walk<'a, K> {
    /// Walks the tree. Each step processes the lowest level of the tree on which enough entries wait, as in
    /// `query.rs`.
    #[inline(always)]
    fn all(&mut self) {
        let mut nodes: List<Below, STACK> = List::new();
        // SAFETY: the top node is in the tree.
        let top = unsafe { self.osp.known_node(self.osp.top) };
        let below = Below { number: self.osp.top, planes: PlaneSet::ALL, eyes: BOTH };
        if !self.osp.is_flat {
            nodes.push(below);
        } else if top.own != NONE {
            self.enqueue_bucket(Below { number: top.own, ..below });
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
                    self.full |= u32::from(list.len() > 0) << i;
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

    /// Tests eight boxes against a plane of both eyes. For each eye, returns the boxes behind the plane and the boxes
    /// wholly inside it. If the normals are equal, the sums of products are equal, too, and the compiler computes them
    /// once.
    #[inline(always)]
    fn sides(&self, plane: usize, boxes: &Boxes<8>) -> [(u32, u32); 2] {
        let [first, second] = [self.planes[0].plane(plane), self.planes[1].plane(plane)];
        if self.same >> plane & 1 == 1 {
            let second = first.moved_to(&second);
            return [self.kernel.sides(&first, boxes, 0), self.kernel.sides(&second, boxes, 0)];
        }
        [self.kernel.sides(&first, boxes, 0), self.kernel.sides(&second, boxes, 0)]
    }

    /// Tests the boxes of `used` against `planes` of `eyes`; `halves` has one or two groups of eight boxes.
    #[inline(always)]
    fn test_boxes(&self, planes: u8, eyes: u8, halves: &[Boxes<8>], used: u32) -> Seen {
        let (mut behind, mut outside) = ([0; 2], [[0; 2]; 6]);
        let mut left = planes;
        while left != 0 {
            let plane = left.trailing_zeros() as usize;
            left &= left - 1;
            let mut inside = [0; 2];
            for (half, boxes) in halves.iter().enumerate() {
                let [first, second] = self.sides(plane, boxes);
                behind[0] |= first.0 << (8 * half);
                behind[1] |= second.0 << (8 * half);
                inside[0] |= first.1 << (8 * half);
                inside[1] |= second.1 << (8 * half);
            }
            outside[plane] = inside.map(|inside| !inside);
        }
        let wanted = [0u32.wrapping_sub(u32::from(eyes & 1)), 0u32.wrapping_sub(u32::from(eyes >> 1))];
        let by = [used & wanted[0] & !behind[0], used & wanted[1] & !behind[1]];
        let mut seen = Seen { by, cut: 0, cut_by: [0; 6] };
        let mut left = planes;
        while left != 0 {
            let plane = left.trailing_zeros() as usize;
            left &= left - 1;
            seen.cut_by[plane] = outside[plane][0] & by[0] | outside[plane][1] & by[1];
            seen.cut |= seen.cut_by[plane];
        }
        seen
    }

    #[inline(always)]
    fn node(&mut self, Below { number, planes, eyes }: Below, nodes: &mut List<Below, STACK>) {
        // SAFETY: every waiting entry is in the tree.
        let node = unsafe { self.osp.known_node(number) };
        self.work.nodes += 1;
        let seen = self.test_boxes(planes, eyes, std::slice::from_ref(&node.boxes), 0xFF);
        count(&mut self.work, 8 * eyes.count_ones(), planes);
        let mut left = seen.by_any();
        while left != 0 {
            let child = left.trailing_zeros() as usize & 7;
            left &= left - 1;
            let (planes, eyes) = (seen.planes(planes, child), seen.eyes(child));
            match node.children[child].target() {
                Target::Nothing => {}
                Target::Leaf(number) => self.enqueue_bucket(Below { number, planes, eyes }),
                Target::Node(number) => {
                    // SAFETY: the children of an entry in the tree are in the tree.
                    prefetch_lines::<4, _>(unsafe { self.osp.known_node(number) });
                    nodes.push(Below { number, planes, eyes });
                }
            }
        }
        if node.own != NONE {
            self.enqueue_bucket(Below { number: node.own, planes, eyes });
        }
    }

    #[inline(always)]
    fn enqueue_bucket(&mut self, below: Below) {
        // SAFETY: the caller found this bucket in the tree.
        let bucket: *const Bucket = unsafe { self.osp.known_bucket(below.number) };
        prefetch_lines::<3, _>(bucket);
        if below.planes != 0 {
            prefetch_lines::<6, _>(bucket.cast::<[u8; 192]>().wrapping_add(1));
        }
        self.buckets.push(below);
    }

    #[inline(always)]
    fn next_bucket(&mut self) {
        let Below { number, planes, eyes } = self.buckets.pop();
        // SAFETY: every waiting entry is in the tree.
        let bucket = unsafe { self.osp.known_bucket(number) };
        self.work.nodes += 1;
        if bucket.next != NONE {
            self.enqueue_bucket(Below { number: bucket.next, planes, eyes });
        }
        if planes == 0 {
            self.whole_bucket(bucket, eyes);
            return;
        }
        let seen = self.test_boxes(planes, eyes, &bucket.boxes.0, bucket.used());
        count(&mut self.work, bucket.page_count * eyes.count_ones(), planes);
        let mut left = seen.by_any();
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let (planes, eyes) = (seen.planes(planes, i), seen.eyes(i));
            self.enqueue_page(Below { number: bucket.pages[i], planes, eyes });
        }
    }

    #[inline(always)]
    fn whole_bucket(&mut self, bucket: &Bucket, eyes: u8) {
        let pages = &bucket.pages[..(bucket.page_count as usize).min(16)];
        self.work.nodes += pages.len() as u64;
        for (&number, &runs) in pages.iter().zip(&bucket.counts) {
            // SAFETY: the children of an entry in the tree are in the tree.
            let page: *const Page = unsafe { self.osp.known_page(number) };
            prefetch_lines::<2, _>(page);
            self.whole.push(Whole { number, runs, eyes });
        }
        while self.whole.len() > WHOLE_WAIT {
            self.next_whole();
        }
    }

    #[inline(always)]
    fn next_whole(&mut self) {
        let Whole { number, runs, eyes } = self.whole.pop();
        // SAFETY: every waiting entry is in the tree.
        self.answers.add_page(eyes, unsafe { self.osp.known_page(number) }, u32::from(runs));
    }

    #[inline(always)]
    fn enqueue_page(&mut self, below: Below) {
        // SAFETY: the caller found this page in the tree.
        prefetch_lines::<2, Page>(unsafe { self.osp.known_page(below.number) });
        if below.planes != 0 {
            // SAFETY: the page is in the tree.
            prefetch_lines::<7, PageBoxes>(unsafe { self.osp.known_page_boxes(below.number) });
        }
        self.pages.push(below);
    }

    #[inline(always)]
    fn next_page(&mut self) {
        let Below { number, planes, eyes } = self.pages.pop();
        // SAFETY: every waiting entry is in the tree.
        let page = unsafe { self.osp.known_page(number) };
        self.work.nodes += 1;
        if planes == 0 {
            self.answers.add_page(eyes, page, u32::from(page.runs));
            return;
        }
        // SAFETY: the page is in the tree.
        let boxes = unsafe { self.osp.known_page_boxes(number) };
        let seen = self.test_boxes(planes, eyes, &boxes.boxes.0, page.used());
        count(&mut self.work, u32::from(page.runs) * eyes.count_ones(), planes);
        // The box of a run of one polygon is the polygon's own box, so the polygon is tested already.
        let exact = u32::from(page.exact);
        self.tested += u64::from((seen.by[0] & exact).count_ones() + (seen.by[1] & exact).count_ones());
        let cut = seen.cut & !exact;
        let whole = seen.by.map(|by| by & !cut);
        self.answers.add_runs(BOTH, page, whole[0] & whole[1]);
        if whole[0] != whole[1] {
            self.answers.add_runs(0b01, page, whole[0] & !whole[1]);
            self.answers.add_runs(0b10, page, whole[1] & !whole[0]);
        }
        let mut left = cut;
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let (planes, eyes) = (seen.planes(planes, i), seen.eyes(i));
            // SAFETY: `i` is a run of several polygons in a page of the tree.
            let boxes = unsafe { store_of(self.osp, boxes.store[i]) };
            let run = CutRun { boxes, first: page.first[i], mask: page.masks[i], planes, eyes };
            let list = if planes.is_power_of_two() { planes.trailing_zeros() as usize } else { SEVERAL };
            if list < SEVERAL && self.same >> list & 1 == 1 {
                self.planes[0].plane(list).prefetch(boxes);
            } else {
                prefetch_lines::<6, _>(boxes);
            }
            let of = &mut self.cut[list];
            of.push(run);
            self.full |= u32::from(of.len() >= LIST) << list;
        }
    }

    /// Tests the polygons of the runs that one plane cuts.
    #[inline(always)]
    fn cut_by_one(&mut self, list: usize) {
        let [first, second] = [self.planes[0].plane(list), self.planes[1].plane(list)];
        let is_same = self.same >> list & 1 == 1;
        let before = self.answers.count();
        for at in 0..self.cut[list].len() {
            let run = self.cut[list].as_slice()[at];
            let behind = if is_same {
                let second = first.moved_to(&second);
                [self.kernel.behind(&first, run.boxes), self.kernel.behind(&second, run.boxes)]
            } else {
                [self.kernel.behind(&first, run.boxes), self.kernel.behind(&second, run.boxes)]
            };
            self.add_tested(&run, behind);
        }
        self.cut[list].clear();
        self.tested += (self.answers.count() - before) as u64;
    }

    /// Tests each polygon of the runs that several planes cut.
    #[inline(always)]
    fn cut_by_several(&mut self) {
        let before = self.answers.count();
        for at in 0..self.cut[SEVERAL].len() {
            let run = self.cut[SEVERAL].as_slice()[at];
            let behind = [
                self.planes[0].behind(self.kernel, run.planes, run.boxes),
                self.planes[1].behind(self.kernel, run.planes, run.boxes),
            ];
            self.add_tested(&run, behind);
        }
        self.cut[SEVERAL].clear();
        self.tested += (self.answers.count() - before) as u64;
    }

    #[inline(always)]
    fn add_tested(&mut self, run: &CutRun<'_>, behind: [u32; 2]) {
        let lanes = u32::from(run.mask) << (run.first % 16);
        count(&mut self.work, lanes.count_ones() * run.eyes.count_ones(), run.planes);
        let [first, second] =
            [run.eyes & 1, run.eyes >> 1].map(|eye| lanes & 0u32.wrapping_sub(u32::from(eye)));
        self.answers.add_each(run.first as usize / BLOCK, [first & !behind[0], second & !behind[1]]);
    }
}
