use super::{LooseOctree, buckets, cell::Cell};
use crate::{
    lanes::Planes,
    plane_lanes::PlaneLanes,
    sink::{Sink, VisitorSink},
    walk_stack::WalkStack,
};
use osp::{
    index::{
        Backend, Node, Visit, Visitor, WorkCounts,
        kernels::{Kernel, PlaneSet, WithKernel},
    },
    math::{Aabb, Containment, Frustum, PlaneMask},
};

/// A frustum query of a part of the tree, to run on a kernel.
struct Cull<'a, S> {
    tree: &'a LooseOctree,
    one: PlaneLanes,
    many: PlaneSet,
    sink: &'a mut S,
    from: From,
}

/// The part of the tree to cull.
#[derive(Clone, Copy)]
enum From {
    /// A cell with everything below, against these planes.
    Cell(Cell, PlaneMask),
    /// The polygons of a cell itself, against these planes.
    Own(Cell, PlaneMask),
    Outside,
}

impl<S: Sink> WithKernel for Cull<'_, S> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> WorkCounts {
        let mut work = WorkCounts::default();
        let (top, mask) = match self.from {
            From::Cell(top, mask) => (top, mask),
            From::Own(cell, mask) => {
                self.chain(kernel, cell.number as usize, mask.bits(), &mut work);
                return work;
            }
            From::Outside => {
                self.chain(kernel, self.tree.outside(), PlaneSet::ALL, &mut work);
                return work;
            }
        };
        let mut stack = WalkStack::from((top, mask.bits()));
        while let Some((cell, mask)) = stack.pop() {
            work.nodes += 1;
            let mut mask = mask;
            if mask != 0 {
                work.boxes += 1;
                work.planes += u64::from(mask.count_ones());
                let Some(cut) = self.one.cut(kernel, mask, &self.tree.grid.loose_box(&cell)) else {
                    continue;
                };
                mask = cut;
            }
            self.chain(kernel, cell.number as usize, mask, &mut work);
            self.tree.for_children(&cell, |child| stack.push((child, mask)));
        }
        work
    }
}

impl<S: Sink> Cull<'_, S> {
    #[inline(always)]
    fn chain<K: Kernel>(&mut self, kernel: K, slot: usize, mask: u8, work: &mut WorkCounts) {
        let chain = self.tree.slots[slot].chain;
        if mask == 0 {
            self.tree.buckets.take_all(chain, self.sink, work);
        } else {
            self.tree.buckets.cull(chain, kernel, Planes { all: &self.many, mask }, self.sink, work);
        }
    }
}

impl LooseOctree {
    pub(super) fn cull_all(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.slots[0].polygons > 0 {
            work += self.cull(From::Cell(Cell::ROOT, PlaneMask::ALL), frustum, sink);
        }
        work += self.cull(From::Outside, frustum, sink);
        work
    }

    fn cull(&self, from: From, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let (one, many) = (PlaneLanes::new(frustum), PlaneSet::new(frustum));
        Backend::detect().run(Cull { tree: self, one, many, sink, from })
    }

    /// Calls `each` for the children that contain polygons, the last child first.
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
                continue; // Only an empty root, because children without polygons are never pushed.
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
            let decision =
                visitor.node(&Node { bounds: &bounds, depth: cell.level, containment, polygons, is_leaf });
            let sink = &mut VisitorSink { visitor, decision };
            match decision {
                Visit::Skip => {}
                Visit::Take => work += self.cull(From::Cell(cell, mask), frustum, sink),
                Visit::Descend => {
                    work += self.cull(From::Own(cell, mask), frustum, sink);
                    self.for_children(&cell, |child| stack.push((child, mask)));
                }
            }
        }
        self.visit_outside(frustum, visitor, &mut work);
        work
    }

    /// Visits the list of polygons outside the tree as an additional leaf of depth 0.
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
        let polygons = self.slots[self.outside()].polygons as usize;
        let decision =
            visitor.node(&Node { bounds: &bounds, depth: 0, containment, polygons, is_leaf: true });
        if decision != Visit::Skip {
            *work += self.cull(From::Outside, frustum, &mut VisitorSink { visitor, decision });
        }
    }
}
