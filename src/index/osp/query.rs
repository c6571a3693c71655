//! The frustum query: from the top down, eight children, sixteen pages, sixteen runs and at last sixteen polygons at
//! a time. What lies inside every plane is taken without another test; the polygons of a run that a plane cuts are
//! looked at a little later, when their boxes have come from memory.

use super::{
    index::Osp,
    layout::{Page, Target},
    pool::NONE,
};
use crate::{
    index::{
        DrawList, WorkCounts,
        simd::{Boxes, IdWriter, Kernel, PlaneSet, WithKernel},
    },
    math::Frustum,
};

/// Where the answer goes.
pub(super) trait Answer {
    /// Polygons `first + bit` of a mask that is not empty.
    fn take<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32);
}

/// The answer as ids.
struct Ids<'a>(IdWriter<'a>);

impl Answer for Ids<'_> {
    #[inline(always)]
    fn take<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.0.push(kernel, first, mask);
    }
}

impl Osp {
    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts {
        let answer = Ids(IdWriter::new(draw_list.ids_mut()));
        self.backend.run(Cull { osp: self, planes: PlaneSet::new(frustum), answer })
    }
}

struct Cull<'a, A> {
    osp: &'a Osp,
    planes: PlaneSet,
    answer: A,
}

impl<A: Answer> WithKernel for Cull<'_, A> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WorkCounts {
        let mut walk = Walk {
            osp: self.osp,
            planes: self.planes,
            kernel,
            answer: self.answer,
            work: WorkCounts::default(),
            cut: [CutRun::default(); QUEUE],
            pushed: 0,
            popped: 0,
        };
        walk.all();
        walk.work
    }
}

/// A run that planes cut, waiting for its boxes.
#[derive(Clone, Copy, Default)]
struct CutRun {
    first: u32,
    mask: u16,
    planes: u8,
}

/// Runs that wait for their boxes at most: long enough for memory, short enough for the first-level cache.
const QUEUE: usize = 32;

/// Nodes that wait at most: seven at each level, and the chain of levels on top.
const STACK: usize = 8 * (super::grid::TOP_SHIFT as usize + 1);

struct Walk<'a, K, A> {
    osp: &'a Osp,
    planes: PlaneSet,
    kernel: K,
    answer: A,
    work: WorkCounts,
    cut: [CutRun; QUEUE],
    pushed: usize,
    popped: usize,
}

impl<K: Kernel, A: Answer> Walk<'_, K, A> {
    #[inline(always)]
    fn all(&mut self) {
        self.open_block();
        let mut stack = [(0u32, 0u8); STACK];
        let mut depth = 1;
        stack[0] = (self.osp.top, PlaneSet::ALL);
        while depth > 0 {
            depth -= 1;
            let (node, mask) = stack[depth];
            let node = &self.osp.nodes[node];
            self.work.nodes += 1;
            let mut present = 0;
            for (i, link) in node.children.iter().enumerate() {
                present |= u32::from(link.target() != Target::Nothing) << i;
            }
            let sides = self.planes.sides8(self.kernel, mask, &node.boxes);
            let seen = present & !sides.behind;
            self.count(present, mask);
            let mut todo = seen;
            while todo != 0 {
                let child = todo.trailing_zeros() as usize;
                todo &= todo - 1;
                let below = sides.planes_at(mask, child);
                match node.children[child].target() {
                    Target::Nothing => {}
                    Target::Leaf(head) => self.chain(head, below),
                    Target::Node(_) if depth == STACK => {}
                    Target::Node(number) => {
                        stack[depth] = (number, below);
                        depth += 1;
                    }
                }
            }
            if node.own != NONE {
                self.chain(node.own, mask);
            }
        }
        while self.popped < self.pushed {
            self.pop();
        }
    }

    #[inline(always)]
    fn count(&mut self, lanes: u32, planes: u8) {
        let boxes = u64::from(lanes.count_ones());
        self.work.boxes += if planes == 0 { 0 } else { boxes };
        self.work.planes += boxes * u64::from(planes.count_ones());
    }

    #[inline(always)]
    fn open_block(&mut self) {
        let lanes = u32::from(self.osp.open.lanes());
        if lanes != 0 {
            let seen = lanes & !self.behind(PlaneSet::ALL, self.osp.open.boxes(), lanes);
            self.give(self.osp.open.block() * 16, seen);
        }
    }

    /// The lanes behind one of the planes.
    #[inline(always)]
    fn behind(&mut self, mask: u8, boxes: &Boxes<16>, lanes: u32) -> u32 {
        self.count(lanes, mask);
        self.planes.behind(self.kernel, mask, boxes)
    }

    #[inline(always)]
    fn give(&mut self, first: u32, mask: u32) {
        if mask != 0 {
            self.work.reported += u64::from(mask.count_ones());
            self.answer.take(self.kernel, first, mask);
        }
    }

    #[inline(always)]
    fn chain(&mut self, head: u32, mask: u8) {
        let mut at = head;
        while at != NONE {
            let bucket = &self.osp.buckets[at];
            self.work.nodes += 1;
            let sides = self.planes.sides(self.kernel, mask, &bucket.boxes);
            let mut seen = bucket.used() & !sides.behind;
            self.count(bucket.used(), mask);
            while seen != 0 {
                let i = seen.trailing_zeros() as usize;
                seen &= seen - 1;
                let page = &self.osp.pages[bucket.pages[i]];
                let below = sides.planes_at(mask, i);
                if below == 0 {
                    self.whole(page, page.used());
                } else {
                    self.page(page, below);
                }
            }
            at = bucket.next;
        }
    }

    /// Takes runs of a page without a test.
    #[inline(always)]
    fn whole(&mut self, page: &Page, runs: u32) {
        let mut left = runs;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let mask = u32::from(page.masks[i]);
            self.work.taken_whole += u64::from(mask.count_ones());
            self.give(page.first[i], mask);
        }
    }

    #[inline(always)]
    fn page(&mut self, page: &Page, mask: u8) {
        self.work.nodes += 1;
        let sides = self.planes.sides(self.kernel, mask, &page.boxes);
        let seen = page.used() & !sides.behind;
        self.count(page.used(), mask);
        // A run of one has its polygon's own box: it has had its test.
        let exact = u32::from(page.exact);
        self.whole(page, seen & (exact | !sides.cut));
        let mut wait = seen & sides.cut & !exact;
        while wait != 0 {
            let i = wait.trailing_zeros() as usize;
            wait &= wait - 1;
            self.push(CutRun { first: page.first[i], mask: page.masks[i], planes: sides.planes_at(mask, i) });
        }
    }

    #[inline(always)]
    fn push(&mut self, run: CutRun) {
        if self.pushed - self.popped == QUEUE {
            self.pop();
        }
        if let Some(store) = self.osp.ids.store(run.first / 16) {
            for row in &store.boxes.rows {
                self.kernel.prefetch(row);
            }
        }
        self.cut[self.pushed % QUEUE] = run;
        self.pushed += 1;
    }

    /// Tests the polygons of the run that has waited longest.
    #[inline(always)]
    fn pop(&mut self) {
        let run = self.cut[self.popped % QUEUE];
        self.popped += 1;
        let lanes = u32::from(run.mask);
        let behind = match self.osp.ids.store(run.first / 16) {
            Some(store) => self.behind(run.planes, &store.boxes, lanes),
            None => 0,
        };
        self.give(run.first, lanes & !behind);
    }
}
