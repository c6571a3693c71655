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
    pub(super) fn cull(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.counts[0] > 0 {
            self.cull_below(Cell::ROOT, PlaneMask::ALL, frustum, sink, &mut work);
        }
        self.buckets.cull(self.chains[self.outside()], frustum, PlaneMask::ALL, sink, &mut work);
        work
    }

    fn cull_below(
        &self,
        top: Cell,
        mask: PlaneMask,
        frustum: &Frustum,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
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
            self.own(&cell, mask, frustum, sink, work);
            self.for_children(&cell, |child| stack.push((child, mask)));
        }
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
        let chain = self.chains[self.grid.number(cell)];
        if mask.is_empty() {
            self.buckets.take_all(chain, sink, work);
        } else {
            self.buckets.cull(chain, frustum, mask, sink, work);
        }
    }

    /// Calls `each` for the children that hold anything, the last first.
    fn for_children(&self, cell: &Cell, mut each: impl FnMut(Cell)) {
        if cell.level < self.grid.max_depth {
            for child in (0..8).rev().map(|i| cell.child(i)) {
                if self.counts[self.grid.number(&child)] > 0 {
                    each(child);
                }
            }
        }
    }

    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut stack = WalkStack::from((Cell::ROOT, PlaneMask::ALL));
        while let Some((cell, mask)) = stack.pop() {
            let number = self.grid.number(&cell);
            if self.counts[number] == 0 {
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
            let asked = visitor.node(&Node {
                bounds: &bounds,
                depth: cell.level,
                containment,
                polygons: self.counts[number] as usize,
                is_leaf,
            });
            let sink = &mut VisitorSink { visitor, asked };
            match asked {
                Visit::Skip => {}
                Visit::Take => self.cull_below(cell, mask, frustum, sink, &mut work),
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
        let chain = self.chains[self.outside()];
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
