use super::tree::{BoxTree, NONE};
use crate::{
    index::{
        Node, Visit, Visitor, WorkCounts,
        sink::{Gather, Sink, VisitorSink},
        walk_stack::WalkStack,
    },
    math::{Containment, Frustum, PlaneMask},
};

impl BoxTree {
    pub(in crate::index) fn frustum_cull(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.root != NONE {
            self.cull_below(self.root, PlaneMask::ALL, frustum, sink, &mut work);
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
        let mut seen = Gather::new();
        let mut stack = WalkStack::from((top, mask));
        while let Some((at, mask)) = stack.pop() {
            let node = self.node(at);
            work.nodes += 1;
            let mut mask = mask;
            if mask.is_empty() {
                work.taken_whole += u64::from(node.is_leaf());
            } else {
                work.boxes += 1;
                let (containment, left, planes) = frustum.classify_masked(&node.bounds, mask);
                work.planes += u64::from(planes);
                if containment == Containment::Outside {
                    continue;
                }
                mask = left;
            }
            if node.is_leaf() {
                work.reported += 1;
                seen.push(node.id, sink);
            } else {
                let [a, b] = node.children;
                stack.push((b, mask));
                stack.push((a, mask));
            }
        }
        seen.flush(sink);
    }

    pub(in crate::index) fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.root == NONE {
            return work;
        }
        let mut stack = WalkStack::from((self.root, PlaneMask::ALL, 0));
        while let Some((at, mask, depth)) = stack.pop() {
            let node = self.node(at);
            work.nodes += 1;
            work.boxes += 1;
            let (containment, mask, planes) = frustum.classify_masked(&node.bounds, mask);
            work.planes += u64::from(planes);
            if containment == Containment::Outside {
                continue;
            }
            let asked = visitor.node(&Node {
                bounds: &node.bounds,
                depth,
                containment,
                polygons: node.polygons as usize,
                is_leaf: node.is_leaf(),
            });
            let sink = &mut VisitorSink { visitor, asked };
            match asked {
                Visit::Skip => {}
                Visit::Descend | Visit::Take if node.is_leaf() => {
                    work.reported += 1;
                    sink.put(&[node.id]);
                }
                Visit::Descend => {
                    let [a, b] = node.children;
                    stack.push((b, mask, depth + 1));
                    stack.push((a, mask, depth + 1));
                }
                Visit::Take => self.cull_below(at, mask, frustum, sink, &mut work),
            }
        }
        work
    }
}
