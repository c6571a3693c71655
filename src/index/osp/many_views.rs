#![expect(unsafe_code, reason = "numbers found in the tree are looked up without a check")]
//! The frustum query of two eyes in one walk.
//!
//! It goes down as `query` does. A node, bucket, page or run is read once and tested for both eyes together, against the
//! planes that cut it of either; what lies inside them all is not tested below. Each eye gets the answer that it would get
//! alone, as a polygon is seen if its own box passes all planes of the eye.
//!
//! Both see nearly the same. So a polygon that both see is written once: the first eye's set is written as it is, the second
//! one's holds in what it differs from the first, until the walk ends.
//!
//! Walls, faces of a cube and cascades are asked one after the other: they share few nodes, and to test those together saves
//! less than it costs to keep the views apart on the way down.

use std::ops::Range;

use super::{
    answer::{Answer, Blocks, Filling},
    index::Osp,
    layout::{Bucket, Page, PageBoxes, Target},
    pair_sets::{BOTH, Sets},
    plan::{Plan, holds_all},
    pool::NONE,
    query::{BUCKETS_WAIT, LIST, List, PAGES_WAIT, SEVERAL, STACK, Waiting, count, store_of},
};
use crate::{
    index::{
        WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, WithKernel, prefetch_lines},
    },
    math::Frustum,
    polygon::{BLOCK, VisibleBlocks},
};

/// Planes of two eyes whose normals have a smaller scalar product do not lie alike.
const ALIKE: f32 = 0.9;
/// Whole pages that wait; a bucket adds sixteen at most, which still fit into a queue of 32.
const WHOLE_WAIT: usize = 14;
/// Two slabs of the views lie alike if neither is wider by this factor.
const AS_WIDE: f32 = 1.25;

impl Osp {
    /// As many views as there are sets.
    pub(super) fn cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        let views = frusta.len().min(visible.len());
        let mut at = 0;
        while at < views {
            match (&frusta[at..views], &mut visible[at..views]) {
                // A plain list is so short that it is looked through once for each.
                ([a, b, ..], [first, second, ..]) if !self.is_linear && are_alike(a, b) => {
                    let planes = PlaneSet::new(a);
                    let planned = self.plan(a, &planes);
                    if planned.1 == Plan::Outside {
                        // Where most is seen, each eye has a shorter way of its own.
                        work += self.cull_blocks_by(&planes, planned, first);
                        at += 1;
                    } else {
                        work += planned.2;
                        work += self.cull_pair([planes, PlaneSet::new(b)], [first, second]);
                        at += 2;
                    }
                }
                _ => {
                    work += self.cull_blocks(&frusta[at], &mut visible[at]);
                    at += 1;
                }
            }
        }
        work
    }

    fn cull_pair(&self, planes: [PlaneSet; 2], visible: [&mut VisibleBlocks; 2]) -> WorkCounts {
        let mut same = 0;
        for plane in 0..6 {
            same |= u8::from(planes[0].plane(plane).has_normal_of(&planes[1].plane(plane))) << plane;
        }
        let end = self.ids_end();
        let [first, second] = visible;
        let masks = [first.masks_for(end), second.masks_for(end)];
        let (work, span, [of_first, of_second]) =
            self.backend.run(Pair { osp: self, planes: &planes, same, masks });
        first.note_filled(span.clone(), of_first);
        second.note_filled(span, of_second);
        work
    }
}

/// Whether two views see nearly the same: each plane of one lies as that of the other does, and where two planes of a view
/// face each other, they are as far apart as in the other.
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
    /// The blocks that were set, and how many polygons each eye sees.
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
            buckets: Waiting::new(),
            whole: Waiting::new(),
            pages: Waiting::new(),
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

/// The number of a node, bucket or page found in the tree, the eyes that may see it, and the planes of each eye that cut it.
#[derive(Clone, Copy)]
struct Below {
    number: u32,
    planes: u8,
    eyes: u8,
}

/// A page inside every plane of its eyes, found in the tree.
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

/// How some boxes lie to the planes of both eyes: a bit a box.
struct Seen {
    by: [u32; 2],
    /// Seen by an eye one of whose planes cuts it; the same by plane, only for the planes asked for.
    cut: u32,
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

    /// The planes of `mask` that cut a box.
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
    /// The planes whose normals are the same for both eyes.
    same: u8,
    kernel: K,
    answers: Sets<'a>,
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

impl<'a, K: Kernel> Walk<'a, K> {
    /// As in `query`: what lies lowest first, as long as more waits there than is worth waiting for.
    #[inline(always)]
    fn all(&mut self) {
        self.open_block();
        let mut nodes: List<Below, STACK> = List::new();
        // SAFETY: it is the top.
        let top = unsafe { self.osp.known_node(self.osp.top) };
        let is_dense = self.osp.ids.entries() <= self.osp.len;
        let [first, second] = self.planes;
        if is_dense
            && holds_all(self.osp, self.kernel, first, top, &mut self.work)
            && holds_all(self.osp, self.kernel, second, top, &mut self.work)
        {
            // The order of ids is the order of memory, and nothing of the tree has to be read.
            let mut all = Blocks::new(self.answers.masks[0]);
            all.all(self.kernel, &self.osp.ids);
            let (blocks, polygons) = all.finish();
            self.answers.note(blocks.start, blocks.end);
            self.answers.found.iter_mut().for_each(|found| *found += polygons);
            return;
        }
        let below = Below { number: self.osp.top, planes: PlaneSet::ALL, eyes: BOTH };
        if !self.osp.is_flat {
            nodes.push(below);
        } else if top.own != NONE {
            self.wait_for_bucket(Below { number: top.own, ..below });
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

    #[inline(always)]
    fn open_block(&mut self) {
        let lanes = u32::from(self.osp.open.lanes());
        if lanes != 0 {
            count(&mut self.work, 2 * lanes.count_ones(), PlaneSet::ALL);
            let rows = self.osp.open.rows();
            // No closures around the kernel: they would not be compiled for its instruction set.
            let behind =
                [self.planes[0].behind_any(self.kernel, rows), self.planes[1].behind_any(self.kernel, rows)];
            let seen = [lanes & !behind[0], lanes & !behind[1]];
            self.answers.add_each(self.osp.open.block() as usize, seen);
            self.tested = self.answers.count() as u64;
        }
    }

    /// How eight boxes lie to a plane of both eyes: for each those behind it, and those not wholly inside. Where the
    /// normals are the same, so are the sums of products, which the compiler then computes once.
    #[inline(always)]
    fn sides(&self, plane: usize, boxes: &Boxes<8>) -> [(u32, u32); 2] {
        let [first, second] = [self.planes[0].plane(plane), self.planes[1].plane(plane)];
        if self.same >> plane & 1 == 1 {
            let second = first.moved_to(&second);
            return [self.kernel.sides(&first, boxes, 0), self.kernel.sides(&second, boxes, 0)];
        }
        [self.kernel.sides(&first, boxes, 0), self.kernel.sides(&second, boxes, 0)]
    }

    /// How the boxes of `used` lie to some planes of some eyes; `halves` are one or two times eight.
    #[inline(always)]
    fn look(&self, planes: u8, eyes: u8, halves: &[Boxes<8>], used: u32) -> Seen {
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
        let asked = [0u32.wrapping_sub(u32::from(eyes & 1)), 0u32.wrapping_sub(u32::from(eyes >> 1))];
        let by = [used & asked[0] & !behind[0], used & asked[1] & !behind[1]];
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
        // SAFETY: every waiting entry was found in the tree.
        let node = unsafe { self.osp.known_node(number) };
        self.work.nodes += 1;
        let seen = self.look(planes, eyes, std::slice::from_ref(&node.boxes), 0xFF);
        count(&mut self.work, 8 * eyes.count_ones(), planes);
        let mut left = seen.by_any();
        while left != 0 {
            let child = left.trailing_zeros() as usize & 7;
            left &= left - 1;
            let (planes, eyes) = (seen.planes(planes, child), seen.eyes(child));
            match node.children[child].target() {
                Target::Nothing => {}
                Target::Leaf(number) => self.wait_for_bucket(Below { number, planes, eyes }),
                Target::Node(number) => {
                    // SAFETY: it is a child of an entry found in the tree.
                    prefetch_lines::<4, _>(unsafe { self.osp.known_node(number) });
                    nodes.push(Below { number, planes, eyes });
                }
            }
        }
        if node.own != NONE {
            self.wait_for_bucket(Below { number: node.own, planes, eyes });
        }
    }

    #[inline(always)]
    fn wait_for_bucket(&mut self, below: Below) {
        // SAFETY: the caller has found it in the tree.
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
        // SAFETY: every waiting entry was found in the tree.
        let bucket = unsafe { self.osp.known_bucket(number) };
        self.work.nodes += 1;
        if bucket.next != NONE {
            self.wait_for_bucket(Below { number: bucket.next, planes, eyes });
        }
        if planes == 0 {
            self.whole_bucket(bucket, eyes);
            return;
        }
        let seen = self.look(planes, eyes, &bucket.boxes.0, bucket.used());
        count(&mut self.work, bucket.page_count * eyes.count_ones(), planes);
        let mut left = seen.by_any();
        while left != 0 {
            let i = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let (planes, eyes) = (seen.planes(planes, i), seen.eyes(i));
            self.wait_for_page(Below { number: bucket.pages[i], planes, eyes });
        }
    }

    #[inline(always)]
    fn whole_bucket(&mut self, bucket: &Bucket, eyes: u8) {
        let pages = &bucket.pages[..(bucket.page_count as usize).min(16)];
        self.work.nodes += pages.len() as u64;
        for (&number, &runs) in pages.iter().zip(&bucket.counts) {
            // SAFETY: it is a child of an entry found in the tree.
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
        // SAFETY: every waiting entry was found in the tree.
        self.answers.add_page(eyes, unsafe { self.osp.known_page(number) }, u32::from(runs));
    }

    #[inline(always)]
    fn wait_for_page(&mut self, below: Below) {
        // SAFETY: the caller has found it in the tree.
        prefetch_lines::<2, Page>(unsafe { self.osp.known_page(below.number) });
        if below.planes != 0 {
            // SAFETY: as above.
            prefetch_lines::<7, PageBoxes>(unsafe { self.osp.known_page_boxes(below.number) });
        }
        self.pages.push(below);
    }

    #[inline(always)]
    fn next_page(&mut self) {
        let Below { number, planes, eyes } = self.pages.pop();
        // SAFETY: every waiting entry was found in the tree.
        let page = unsafe { self.osp.known_page(number) };
        self.work.nodes += 1;
        if planes == 0 {
            self.answers.add_page(eyes, page, u32::from(page.runs));
            return;
        }
        // SAFETY: as above.
        let boxes = unsafe { self.osp.known_page_boxes(number) };
        let seen = self.look(planes, eyes, &boxes.boxes.0, page.used());
        count(&mut self.work, u32::from(page.runs) * eyes.count_ones(), planes);
        // A run of one has its polygon's own box: it has had its test.
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
            // SAFETY: `i` is a run of several of a page in the tree.
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
            self.take_tested(&run, behind);
        }
        self.cut[list].clear();
        self.tested += (self.answers.count() - before) as u64;
    }

    /// Tests the polygons of the runs that several planes cut.
    #[inline(always)]
    fn cut_by_several(&mut self) {
        let before = self.answers.count();
        for at in 0..self.cut[SEVERAL].len() {
            let run = self.cut[SEVERAL].as_slice()[at];
            let behind = [
                self.planes[0].behind(self.kernel, run.planes, run.boxes),
                self.planes[1].behind(self.kernel, run.planes, run.boxes),
            ];
            self.take_tested(&run, behind);
        }
        self.cut[SEVERAL].clear();
        self.tested += (self.answers.count() - before) as u64;
    }

    #[inline(always)]
    fn take_tested(&mut self, run: &CutRun<'_>, behind: [u32; 2]) {
        let lanes = u32::from(run.mask) << (run.first % 16);
        count(&mut self.work, lanes.count_ones() * run.eyes.count_ones(), run.planes);
        let [first, second] =
            [run.eyes & 1, run.eyes >> 1].map(|eye| lanes & 0u32.wrapping_sub(u32::from(eye)));
        self.answers.add_each(run.first as usize / BLOCK, [first & !behind[0], second & !behind[1]]);
    }
}
