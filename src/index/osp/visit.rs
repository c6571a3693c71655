//! The walk that a visitor guides through nodes, leaves, pages and runs. A traversal passes the polygons that the frustum
//! sees to the visitor. Thinning removes skipped polygons from a query's result. It tests only nodes in the frustum
//! whose parents are partly hidden. It reads nothing below nodes that are taken.

use super::{
    index::Osp,
    layout::{Bucket, Target},
    pool::NONE,
    residence::Demand,
    unfiled::Group,
};
use crate::{
    index::{
        Node, Visit, Visitor, WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, Sides, WithKernel, lanes_of},
    },
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::{PolygonId, VisibleBlocks},
};

/// Greatest number of polygons of a run, and of runs of a page.
const RUN: usize = 16;

impl Osp {
    /// Passes the seen polygons to the visitor. With `visible`, removes the polygons that the visitor skips from it
    /// instead.
    pub(super) fn walk(
        &self,
        frustum: &Frustum,
        visitor: &mut dyn Visitor,
        visible: Option<&mut VisibleBlocks>,
    ) -> WorkCounts {
        let least = if visible.is_some() { visitor.least_polygons().max(1) } else { 1 };
        // The result of a query tells which runs, blocks and polygons the planes let through.
        let (lists, planes) = if visible.is_some() { (Visit::Skip, 0) } else { (Visit::Take, PlaneSet::ALL) };
        let (set, work) = (PlaneSet::new(frustum), WorkCounts::default());
        let mut walk = Walk { osp: self, frustum, set, visitor, visible, least, lists, planes, work };
        self.residence.demand.note(Demand::YES);
        for group in self.store.unfiled_groups() {
            walk.group(group);
        }
        let (bounds, polygons) = (self.node_box(self.top), self.store.filed());
        let part = Part { bounds, depth: 0, polygons, is_leaf: false };
        if let Some(below) = walk.decide_one(Below { planes: PlaneSet::ALL, is_whole: false }, part) {
            walk.node(self.top, polygons, 1, below);
        }
        walk.work
    }
}

/// Boxes of children, or of pages, runs or polygons.
enum Many<'a> {
    Children(&'a Boxes<8>),
    Sixteen(&'a Boxes<16>),
}

/// A test of boxes against some of the planes.
struct Test<'a>(&'a PlaneSet, u8, Many<'a>);

impl WithKernel for Test<'_> {
    type Output = Sides;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Sides {
        match self.2 {
            Many::Children(boxes) => self.0.sides(kernel, self.1, boxes),
            Many::Sixteen(boxes) => self.0.sides(kernel, self.1, boxes),
        }
    }
}

struct Walk<'a> {
    osp: &'a Osp,
    frustum: &'a Frustum,
    /// The planes of the frustum.
    set: PlaneSet,
    visitor: &'a mut dyn Visitor,
    /// The result of a query that is thinned; `None` if polygons are passed to the visitor.
    visible: Option<&'a mut VisibleBlocks>,
    /// Nodes with fewer polygons are not tested, and their polygons are not listed, unless a node above is listed whole.
    least: usize,
    /// The decision that lists all polygons of a node: [`Visit::Take`] in a traversal, [`Visit::Skip`] in thinning. To
    /// list means to pass or to remove.
    lists: Visit,
    /// The planes that are tested for groups, runs, blocks and polygons: all in a traversal, none in thinning.
    planes: u8,
    work: WorkCounts,
}

/// A node, leaf, page or run: its box, depth and content.
struct Part {
    bounds: Aabb,
    depth: u32,
    polygons: usize,
    is_leaf: bool,
}

/// What is known about all that lies below a part.
#[derive(Clone, Copy)]
struct Below {
    /// The planes that are left to test.
    planes: u8,
    /// The visitor has decided: all polygons below that pass `planes` are listed.
    is_whole: bool,
}

impl Walk<'_> {
    /// Tests boxes against planes. Returns the lanes of `used` that the planes let through, too.
    fn sides(&mut self, planes: u8, used: u32, boxes: Many<'_>) -> (Sides, u16) {
        if planes == 0 {
            return (Sides::NONE, used as u16);
        }
        self.work.boxes += u64::from(used.count_ones());
        self.work.planes += u64::from(used.count_ones() * planes.count_ones());
        let sides = self.osp.backend.run(Test(&self.set, planes, boxes));
        (sides, (used & !sides.behind) as u16)
    }

    /// Tests a part against the planes, and decides about it.
    fn decide_one(&mut self, below: Below, part: Part) -> Option<Below> {
        if part.bounds.is_empty() {
            return None;
        }
        let mask = PlaneMask::from_bits(below.planes);
        let (containment, mask, planes) = self.frustum.classify_masked(&part.bounds, mask);
        self.work.boxes += u64::from(below.planes != 0);
        self.work.planes += u64::from(planes);
        if containment == Containment::Outside {
            return None;
        }
        self.work.nodes += 1;
        self.decide(Below { planes: mask.bits(), ..below }, || part)
    }

    /// Asks the visitor about a part that no plane excludes. Does not ask if a part above is listed whole.
    #[inline]
    fn decide(&mut self, below: Below, part: impl FnOnce() -> Part) -> Option<Below> {
        if below.is_whole {
            return Some(below);
        }
        let Part { bounds, depth, polygons, is_leaf } = part();
        // A node that has become empty may still be queued for upkeep.
        if polygons < self.least || bounds.is_empty() {
            return None;
        }
        let containment = if below.planes == 0 { Containment::Inside } else { Containment::Intersects };
        let node = Node { bounds: &bounds, depth, containment, polygons, is_leaf };
        let decision = self.visitor.node(&node);
        self.after(decision, below)
    }

    /// What remains to do below a part after a decision; `None`: nothing.
    fn after(&self, decision: Visit, below: Below) -> Option<Below> {
        match decision {
            Visit::Descend => Some(below),
            _ => (decision == self.lists)
                .then_some(Below { planes: below.planes & self.planes, is_whole: true }),
        }
    }

    /// Whether a polygon of these is still in `visible`; in a traversal, whether there is one.
    fn may_list(&self, (block, lanes): (u32, u16)) -> bool {
        lanes & self.visible.as_ref().map_or(lanes, |visible| visible.mask(block as usize)) != 0
    }

    /// Visits a group of blocks that are not in the tree: a node of depth 0, with the blocks as its leaves.
    fn group(&mut self, group: Group<'_>) {
        let (mut rest, top) = (group.around().unfiled, Below { planes: self.planes, is_whole: false });
        let Some(below) = self.blocks(group, rest, 0, top) else { return };
        // Neighbouring blocks share a test, so that it covers `least` polygons.
        let together = self.least.div_ceil(RUN).min(RUN).next_power_of_two();
        while rest != 0 {
            let mut these = rest;
            (0..together).for_each(|_| rest &= rest.wrapping_sub(1));
            these &= !rest;
            match self.blocks(group, these, 1, below) {
                Some(below) if below.is_whole || together == 1 => {
                    group.blocks(these).for_each(|(block, lanes, boxes)| {
                        self.block((block, lanes), boxes, below);
                    });
                }
                _ => {}
            }
        }
    }

    /// Decides about blocks of a group: all of them (depth 0), or neighbours that share a test (depth 1).
    fn blocks(&mut self, group: Group<'_>, these: u16, depth: u32, below: Below) -> Option<Below> {
        let blocks = group.blocks(these);
        if !blocks.clone().any(|(block, lanes, _)| self.may_list((block, lanes))) {
            return None;
        }
        if below.is_whole && below.planes == 0 {
            return Some(below);
        }
        let polygons = blocks.clone().map(|(_, lanes, _)| lanes.count_ones() as usize).sum();
        let around =
            || blocks.fold(Aabb::EMPTY, |all, (_, lanes, boxes)| all.union(&boxes.around(lanes.into())));
        let bounds = group.bounds().filter(|_| depth == 0).unwrap_or_else(around);
        self.decide_one(below, Part { bounds, depth, polygons, is_leaf: depth == 1 })
    }

    fn node(&mut self, number: u32, polygons: usize, depth: u32, below: Below) {
        let osp = self.osp;
        let node = &osp.nodes[number];
        let (sides, seen) = self.sides(below.planes, node.used(), Many::Children(&node.boxes));
        self.work.nodes += u64::from(seen.count_ones());
        for slot in lanes_of(seen) {
            let below = Below { planes: sides.planes_at(below.planes, slot), ..below };
            let target = node.children[slot].target();
            let polygons = match target {
                Target::Leaf(head) => osp.buckets[head].polygons as usize,
                _ => polygons,
            };
            let part = || Part { bounds: node.boxes.get(slot), depth, polygons, is_leaf: false };
            let Some(below) = self.decide(below, part) else { continue };
            match target {
                Target::Nothing => {}
                Target::Leaf(head) => self.chain(head, depth + 1, below),
                Target::Node(child) => self.node(child, polygons, depth + 1, below),
            }
        }
        self.chain(node.own, depth, below);
    }

    fn chain(&mut self, head: u32, depth: u32, below: Below) {
        let osp = self.osp;
        let mut at = head;
        while at != NONE {
            let bucket = &osp.buckets[at];
            let (sides, seen) = self.sides(below.planes, bucket.used(), Many::Sixteen(&bucket.boxes));
            self.work.nodes += u64::from(seen.count_ones());
            for i in lanes_of(seen) {
                let planes = sides.planes_at(below.planes, i);
                self.page((bucket, i), depth, Below { planes, ..below });
            }
            at = bucket.next;
        }
    }

    /// Visits a page of a bucket and what lies in it. The planes let the page through.
    fn page(&mut self, (bucket, i): (&Bucket, usize), depth: u32, below: Below) {
        // A page that is too small is not read.
        if !below.is_whole && usize::from(bucket.counts[i]) * RUN < self.least {
            return;
        }
        let (osp, number) = (self.osp, bucket.pages[i]);
        let page = &osp.pages[number];
        let runs = usize::from(page.runs);
        let ids = |run: usize| (page.first[run] / 16, page.masks[run] << (page.first[run] % 16));
        let part = || {
            let polygons = page.masks[..runs].iter().map(|mask| mask.count_ones() as usize).sum();
            Part { bounds: bucket.boxes.get(i), depth, polygons, is_leaf: false }
        };
        let Some(below) = self.decide(below, part) else { return };
        if below.is_whole && below.planes == 0 {
            (0..runs).for_each(|run| self.list(ids(run), below, |_| Aabb::EMPTY));
            return;
        }
        if self.least > RUN {
            return;
        }
        let planes = below.planes & self.planes;
        let boxes = &page.boxes;
        let (sides, mut seen) = self.sides(planes, page.used(), Many::Sixteen(boxes));
        self.work.nodes += u64::from(seen.count_ones());
        for run in lanes_of(seen) {
            let is_small = (page.masks[run].count_ones() as usize) < self.least;
            seen &= !(u16::from(is_small || !self.may_list(ids(run))) << run);
        }
        let is_together = !below.is_whole && seen != 0 && self.visitor.tests_together();
        let mut answers = [Visit::Descend; RUN];
        if is_together {
            let (mut bounds, mut polygons, mut count) = ([Aabb::EMPTY; RUN], [0; RUN], 0);
            for run in lanes_of(seen) {
                (bounds[count], polygons[count]) = (boxes.get(run), page.masks[run].count_ones() as u8);
                count += 1;
            }
            self.visitor.leaves(&bounds[..count], &polygons[..count], &mut answers[..count]);
        }
        for (lane, answer) in lanes_of(seen).zip(answers) {
            let (run, bounds) = page.run(lane);
            let below = Below { planes: sides.planes_at(planes, lane), ..below };
            let polygons = run.mask.count_ones() as usize;
            let part = || Part { bounds, depth: depth + 1, polygons, is_leaf: true };
            let decided = if is_together { self.after(answer, below) } else { self.decide(below, part) };
            let Some(below) = decided else { continue };
            if run.is_exact() {
                // The planes and the visitor have got the polygon's box, which is the run's box.
                let is_whole = below.is_whole || is_together && self.visible.is_none();
                self.list(ids(lane), Below { planes: 0, is_whole }, |_| bounds);
            } else {
                self.block(ids(lane), osp.store.boxes(run.store), below);
            }
        }
    }

    /// Lists those polygons of a leaf that no remaining plane excludes.
    fn block(&mut self, (block, lanes): (u32, u16), boxes: &Boxes<16>, below: Below) {
        let (_, seen) = self.sides(below.planes, lanes.into(), Many::Sixteen(boxes));
        self.list((block, seen), below, |lane| boxes.get(lane));
    }

    /// Passes these polygons to the visitor. In thinning, removes them: all if `is_whole`, otherwise those that
    /// [`Visitor::hidden_of`] finds.
    fn list(&mut self, (block, lanes): (u32, u16), below: Below, boxes: impl Fn(usize) -> Aabb) {
        let Some(visible) = &mut self.visible else {
            let (mut ids, mut count) = ([PolygonId(0); RUN], 0);
            for lane in lanes_of(lanes) {
                (ids[count], count) = (PolygonId(block * 16 + lane as u32), count + 1);
            }
            self.work.reported += count as u64;
            self.work.taken_whole += if below.planes == 0 { count as u64 } else { 0 };
            if count > 0 {
                let decision = if below.is_whole { Visit::Take } else { Visit::Descend };
                self.visitor.polygons(&ids[..count], decision);
            }
            return;
        };
        let mut hidden = lanes;
        if !below.is_whole {
            if !self.visitor.tests_polygons() {
                return;
            }
            let seen = lanes_of(lanes & visible.mask(block as usize));
            let (mut tested, mut count) = ([Aabb::EMPTY; RUN], 0);
            for lane in seen.clone() {
                (tested[count], count) = (boxes(lane), count + 1);
            }
            let found = self.visitor.hidden_of(&tested[..count]);
            hidden = seen.enumerate().fold(0, |all, (i, lane)| all | (found >> i & 1) << lane);
        }
        visible.remove_block(block as usize, hidden);
    }
}
