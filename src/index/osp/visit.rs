//! The walk that passes nodes, leaves, pages and runs to a visitor.

use super::{
    groups::{Group, GroupIds},
    index::Osp,
    layout::Target,
    pool::NONE,
};
use crate::{
    index::{Node, Visit, Visitor, WorkCounts, simd::Boxes},
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

/// Greatest number of runs that are passed to the visitor together.
const TOGETHER: usize = 16;

struct Walk<'a> {
    osp: &'a Osp,
    frustum: &'a Frustum,
    visitor: &'a mut dyn Visitor,
    work: WorkCounts,
}

/// A node, leaf, page or run: its box, depth and content.
struct Part {
    bounds: Aabb,
    depth: u32,
    polygons: usize,
    is_leaf: bool,
}

impl Osp {
    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut walk = Walk { osp: self, frustum, visitor, work: WorkCounts::default() };
        for Group { boxes, lanes, ids } in self.movers.groups() {
            walk.block(ids, lanes, boxes.around(u32::from(lanes)), boxes);
        }
        if self.is_linear {
            for (at, (number, lanes, boxes)) in self.linear.rows().blocks().enumerate() {
                walk.block(GroupIds::Block(number), lanes, self.linear.rows().around(at), boxes);
            }
            return walk.work;
        }
        let lanes = self.open.lanes();
        if lanes != 0 {
            let bounds = self.open.rows().around(u32::from(lanes));
            walk.block(GroupIds::Block(self.open.block()), lanes, bounds, self.open.rows());
        }
        let bounds = self.node_box(self.top);
        let polygons = self.len - self.open.lanes().count_ones() as usize;
        let part = Part { bounds, depth: 0, polygons, is_leaf: false };
        walk.node(self.top, &part, PlaneMask::ALL, Visit::Descend);
        walk.work
    }
}

impl Walk<'_> {
    /// Tests a part of the index against the frustum and passes it to the visitor. Returns the planes left to test and
    /// the visitor's decision; `None` if the part is outside the frustum or skipped.
    fn decide(&mut self, part: &Part, mask: PlaneMask, decision: Visit) -> Option<(PlaneMask, Visit)> {
        if part.polygons == 0 || part.bounds.is_empty() {
            // A node that has become empty may still be queued for upkeep.
            return None;
        }
        self.work.nodes += 1;
        self.work.boxes += 1;
        let (containment, mask, planes) = self.frustum.classify_masked(&part.bounds, mask);
        self.work.planes += u64::from(planes);
        if containment == Containment::Outside {
            return None;
        }
        if decision == Visit::Take {
            return Some((mask, Visit::Take));
        }
        let Part { bounds, depth, polygons, is_leaf } = part;
        let node = Node { bounds, depth: *depth, containment, polygons: *polygons, is_leaf: *is_leaf };
        match self.visitor.node(&node) {
            Visit::Skip => None,
            answer => Some((mask, answer)),
        }
    }

    /// Visits polygons that are not in the tree, as a leaf of depth 0.
    fn block(&mut self, ids: GroupIds<'_>, lanes: u16, bounds: Aabb, boxes: &Boxes<16>) {
        let polygons = lanes.count_ones() as usize;
        let part = Part { bounds, depth: 0, polygons, is_leaf: true };
        if let Some((mask, answer)) = self.decide(&part, PlaneMask::ALL, Visit::Descend) {
            self.polygons(ids, u32::from(lanes), mask, answer, |lane| boxes.get(lane));
        }
    }

    fn node(&mut self, number: u32, part: &Part, mask: PlaneMask, decision: Visit) {
        let Some((mask, answer)) = self.decide(part, mask, decision) else { return };
        let node = &self.osp.nodes[number];
        let depth = part.depth + 1;
        for (slot, link) in node.children.iter().enumerate() {
            let bounds = node.boxes.get(slot);
            match link.target() {
                Target::Nothing => {}
                Target::Leaf(head) => {
                    let polygons = self.osp.buckets[head].polygons as usize;
                    let part = Part { bounds, depth, polygons, is_leaf: false };
                    if let Some((mask, answer)) = self.decide(&part, mask, answer) {
                        self.chain(head, depth + 1, mask, answer);
                    }
                }
                Target::Node(below) => {
                    let polygons = part.polygons;
                    self.node(below, &Part { bounds, depth, polygons, is_leaf: false }, mask, answer);
                }
            }
        }
        self.chain(node.own, depth, mask, answer);
    }

    fn chain(&mut self, head: u32, depth: u32, mask: PlaneMask, decision: Visit) {
        let mut at = head;
        while at != NONE {
            let bucket = &self.osp.buckets[at];
            for i in 0..bucket.page_count as usize {
                let number = bucket.pages[i];
                let page = &self.osp.pages[number];
                let polygons =
                    page.masks[..usize::from(page.runs)].iter().map(|m| m.count_ones() as usize).sum();
                let part = Part { bounds: bucket.boxes.get(i), depth, polygons, is_leaf: false };
                self.page(number, &part, mask, decision);
            }
            at = bucket.next;
        }
    }

    fn page(&mut self, number: u32, part: &Part, mask: PlaneMask, decision: Visit) {
        let Some((mask, answer)) = self.decide(part, mask, decision) else { return };
        if answer == Visit::Descend && self.visitor.tests_together() {
            self.runs_together(number, mask);
            return;
        }
        for i in 0..usize::from(self.osp.pages[number].runs) {
            let (run, bounds) = self.osp.pages.run(number, i);
            let lanes = u32::from(run.lanes());
            let first = run.first & !15;
            let polygons = lanes.count_ones() as usize;
            let part = Part { bounds, depth: part.depth + 1, polygons, is_leaf: true };
            let Some((mask, answer)) = self.decide(&part, mask, answer) else { continue };
            if run.is_exact() {
                self.polygons(GroupIds::Block(first / 16), lanes, PlaneMask::NONE, answer, |_| bounds);
            } else {
                let boxes = self.osp.ids.boxes(run.store);
                self.polygons(GroupIds::Block(first / 16), lanes, mask, answer, |lane| boxes.get(lane));
            }
        }
    }

    /// Passes the runs of a page that the frustum may see to the visitor, up to [`TOGETHER`] at once.
    fn runs_together(&mut self, number: u32, mask: PlaneMask) {
        let osp = self.osp;
        let runs = usize::from(osp.pages[number].runs);
        for start in (0..runs).step_by(TOGETHER) {
            let (mut boxes, mut polygons) = ([Aabb::EMPTY; TOGETHER], [0_u8; TOGETHER]);
            let (mut seen, mut count) = ([(0, mask); TOGETHER], 0);
            for i in start..runs.min(start + TOGETHER) {
                let (run, bounds) = osp.pages.run(number, i);
                let lanes = run.lanes();
                if lanes == 0 || bounds.is_empty() {
                    continue;
                }
                self.work.nodes += 1;
                self.work.boxes += 1;
                let (containment, mask, planes) = self.frustum.classify_masked(&bounds, mask);
                self.work.planes += u64::from(planes);
                if containment != Containment::Outside {
                    (boxes[count], polygons[count]) = (bounds, lanes.count_ones() as u8);
                    (seen[count], count) = ((i, mask), count + 1);
                }
            }
            let mut answers = [Visit::Take; TOGETHER];
            self.visitor.leaves(&boxes[..count], &polygons[..count], &mut answers[..count]);
            for (&(i, mask), &answer) in seen[..count].iter().zip(&answers) {
                if answer == Visit::Skip {
                    continue;
                }
                let (run, bounds) = osp.pages.run(number, i);
                let (lanes, first) = (u32::from(run.lanes()), run.first & !15);
                if run.is_exact() {
                    // The run's box, which the visitor got, is the polygon's box.
                    self.polygons(GroupIds::Block(first / 16), lanes, PlaneMask::NONE, Visit::Take, |_| {
                        bounds
                    });
                } else {
                    let boxes = osp.ids.boxes(run.store);
                    self.polygons(GroupIds::Block(first / 16), lanes, mask, answer, |lane| boxes.get(lane));
                }
            }
        }
    }

    /// Passes to the visitor those polygons of a run that no remaining plane excludes.
    fn polygons(
        &mut self,
        of: GroupIds<'_>,
        lanes: u32,
        mask: PlaneMask,
        decision: Visit,
        bounds: impl Fn(usize) -> Aabb,
    ) {
        let mut ids = [PolygonId(0); 16];
        let mut count = 0;
        let mut left = lanes;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            let seen = mask.is_empty() || {
                let (containment, _, planes) = self.frustum.classify_masked(&bounds(lane as usize), mask);
                self.work.boxes += 1;
                self.work.planes += u64::from(planes);
                containment != Containment::Outside
            };
            if seen {
                ids[count] = of.id(lane as usize);
                count += 1;
            }
        }
        if mask.is_empty() {
            self.work.taken_whole += count as u64;
        }
        self.work.reported += count as u64;
        if count > 0 {
            self.visitor.polygons(&ids[..count], decision);
        }
    }
}
