//! The walk that passes nodes, leaves, pages and runs to a visitor.

use super::{index::Osp, layout::Target, pool::NONE, unfiled::Group};
use crate::{
    index::{Node, Visit, Visitor, WorkCounts},
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
        for group in self.store.unfiled_groups() {
            walk.group(group);
        }
        let (bounds, polygons) = (self.node_box(self.top), self.store.filed());
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

    /// Visits a group of blocks that are not in the tree: a node of depth 0, with the blocks as its leaves.
    fn group(&mut self, group: Group<'_>) {
        let polygons = group.blocks().map(|(_, lanes, _)| lanes.count_ones() as usize).sum();
        let stale = || group.blocks().map(|(_, lanes, boxes)| boxes.around(lanes.into()));
        let around = || stale().fold(Aabb::EMPTY, |all, of_block| all.union(&of_block));
        let bounds = group.bounds().unwrap_or_else(around);
        let part = Part { bounds, depth: 0, polygons, is_leaf: false };
        let Some((mask, answer)) = self.decide(&part, PlaneMask::ALL, Visit::Descend) else { return };
        for (block, lanes, boxes) in group.blocks() {
            let (bounds, polygons) = (boxes.around(lanes.into()), lanes.count_ones() as usize);
            let part = Part { bounds, depth: 1, polygons, is_leaf: true };
            if let Some((mask, answer)) = self.decide(&part, mask, answer) {
                self.polygons(block, u32::from(lanes), mask, answer, |lane| boxes.get(lane));
            }
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
                self.polygons(first / 16, lanes, PlaneMask::NONE, answer, |_| bounds);
            } else {
                let boxes = self.osp.store.boxes(run.store);
                self.polygons(first / 16, lanes, mask, answer, |lane| boxes.get(lane));
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
                    self.polygons(first / 16, lanes, PlaneMask::NONE, Visit::Take, |_| bounds);
                } else {
                    let boxes = osp.store.boxes(run.store);
                    self.polygons(first / 16, lanes, mask, answer, |lane| boxes.get(lane));
                }
            }
        }
    }

    /// Passes to the visitor those polygons of a run that no remaining plane excludes.
    fn polygons(
        &mut self,
        block: u32,
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
                ids[count] = PolygonId(block * 16 + lane);
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
