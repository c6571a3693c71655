use super::{LooseOctree, buckets, cell::Cell};
use crate::{
    index::{
        Node, Visit, Visitor, WorkCounts,
        sink::{Sink, VisitorSink},
        walk_stack::WalkStack,
    },
    math::{Aabb, Containment, Frustum, PlaneMask},
};

impl LooseOctree {
    pub(super) fn cull_all(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.slots[0].polygons > 0 {
            work += self.cull(Cell::ROOT, PlaneMask::ALL, frustum, sink);
        }
        self.buckets.cull(self.slots[self.outside()].chain, frustum, PlaneMask::ALL, sink, &mut work);
        work
    }

    fn cull(&self, top: Cell, mask: PlaneMask, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut stack = WalkStack::from((top, mask));
        while let Some((cell, mask)) = stack.pop() {
            work.nodes += 1;
            let mut mask = mask;
            if !mask.is_empty() {
                work.boxes += 1;
                let (containment, left, planes) = frustum.classify_masked(&self.grid.loose_box(&cell), mask);
                work.planes += u64::from(planes);
                if containment == Containment::Outside {
                    continue;
                }
                mask = left;
            }
            self.own(&cell, mask, frustum, sink, &mut work);
            self.for_children(&cell, |child| stack.push((child, mask)));
        }
        work
    }

    /// The polygons of a cell itself.
    fn own(
        &self,
        cell: &Cell,
        mask: PlaneMask,
        frustum: &Frustum,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        let chain = self.slots[cell.number as usize].chain;
        if mask.is_empty() {
            self.buckets.take_all(chain, sink, work);
        } else {
            self.buckets.cull(chain, frustum, mask, sink, work);
        }
    }

    /// Calls `each` for the children that hold anything, the last first.
    fn for_children(&self, cell: &Cell, mut each: impl FnMut(Cell)) {
        if cell.level < self.grid.max_depth {
            let first = cell.child(0).number as usize;
            let children = &self.slots[first..first + 8];
            for i in (0..8).rev().filter(|&i| children[i].polygons > 0) {
                each(cell.child(i as u32));
            }
        }
    }

    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut stack = WalkStack::from((Cell::ROOT, PlaneMask::ALL));
        while let Some((cell, mask)) = stack.pop() {
            let polygons = self.slots[cell.number as usize].polygons as usize;
            if polygons == 0 {
                continue; // Only an empty root: children without polygons are never pushed.
            }
            let bounds = self.grid.loose_box(&cell);
            work.nodes += 1;
            work.boxes += 1;
            let (containment, mask, planes) = frustum.classify_masked(&bounds, mask);
            work.planes += u64::from(planes);
            if containment == Containment::Outside {
                continue;
            }
            let mut is_leaf = true;
            self.for_children(&cell, |_| is_leaf = false);
            let asked =
                visitor.node(&Node { bounds: &bounds, depth: cell.level, containment, polygons, is_leaf });
            let sink = &mut VisitorSink { visitor, asked };
            match asked {
                Visit::Skip => {}
                Visit::Take => work += self.cull(cell, mask, frustum, sink),
                Visit::Descend => {
                    self.own(&cell, mask, frustum, sink, &mut work);
                    self.for_children(&cell, |child| stack.push((child, mask)));
                }
            }
        }
        self.visit_outside(frustum, visitor, &mut work);
        work
    }

    /// The list beside the tree as one more leaf at the top.
    fn visit_outside(&self, frustum: &Frustum, visitor: &mut dyn Visitor, work: &mut WorkCounts) {
        let chain = self.slots[self.outside()].chain;
        if chain == buckets::NONE {
            return;
        }
        let bounds: Aabb = self.buckets.bounds(chain);
        let containment = frustum.classify(&bounds);
        if containment == Containment::Outside {
            return;
        }
        work.nodes += 1;
        let polygons = self.outside_root();
        let asked = visitor.node(&Node { bounds: &bounds, depth: 0, containment, polygons, is_leaf: true });
        if asked != Visit::Skip {
            self.buckets.cull(chain, frustum, PlaneMask::ALL, &mut VisitorSink { visitor, asked }, work);
        }
    }
}
