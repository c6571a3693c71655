use super::{BucketTree, Partition, ROOT};
use crate::{
    index::{
        Node, Visit, Visitor, WorkCounts,
        sink::{Sink, VisitorSink},
        walk_stack::WalkStack,
    },
    math::{Containment, Frustum, PlaneMask},
};

impl<P: Partition> BucketTree<P> {
    pub(super) fn cull(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.node(ROOT).polygons > 0 {
            self.cull_below(ROOT, PlaneMask::ALL, frustum, sink, &mut work);
        }
        work
    }

    fn cull_below(
        &self,
        top: u32,
        mask: PlaneMask,
        frustum: &Frustum,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        let mut stack = WalkStack::from((top, mask));
        while let Some((at, mask)) = stack.pop() {
            let node = self.node(at);
            work.nodes += 1;
            let mut mask = mask;
            if !mask.is_empty() {
                work.boxes += 1;
                let (containment, left, planes) = frustum.classify_masked(&node.bounds, mask);
                work.planes += u64::from(planes);
                if containment == Containment::Outside {
                    continue;
                }
                mask = left;
            }
            if !node.is_leaf() {
                self.push_children(at, |child| stack.push((child, mask)));
            } else if mask.is_empty() {
                self.buckets.take_all(node.chain, sink, work);
            } else {
                self.buckets.cull(node.chain, frustum, mask, sink, work);
            }
        }
    }

    fn push_children(&self, at: u32, mut push: impl FnMut(u32)) {
        self.children(at).rev().filter(|&child| self.node(child).polygons > 0).for_each(&mut push);
    }

    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.node(ROOT).polygons == 0 {
            return work;
        }
        let mut stack = WalkStack::from((ROOT, PlaneMask::ALL, 0));
        while let Some((at, mask, depth)) = stack.pop() {
            let node = self.node(at);
            work.nodes += 1;
            work.boxes += 1;
            let (containment, mask, planes) = frustum.classify_masked(&node.bounds, mask);
            work.planes += u64::from(planes);
            if containment == Containment::Outside {
                continue;
            }
            let is_leaf = node.is_leaf();
            let polygons = node.polygons as usize;
            let asked = visitor.node(&Node { bounds: &node.bounds, depth, containment, polygons, is_leaf });
            let sink = &mut VisitorSink { visitor, asked };
            match asked {
                Visit::Skip => {}
                Visit::Descend if !is_leaf => {
                    self.push_children(at, |child| stack.push((child, mask, depth + 1)));
                }
                Visit::Descend | Visit::Take => self.cull_below(at, mask, frustum, sink, &mut work),
            }
        }
        work
    }
}
