use super::{CutNodes, Item, OctreePaper};
use crate::{
    exact::passes,
    sink::{Gather, Sink, VisitorSink},
    walk_stack::WalkStack,
};
use osp::{
    index::{Node, Visit, Visitor, WorkCounts},
    math::{Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

impl OctreePaper {
    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = WorkCounts::default();
        if !self.nodes.is_empty() {
            self.cull_below(0, frustum, draw_list, &mut work);
        }
        work
    }

    /// Culls as the paper's Fig. 6 does, from `top` downwards.
    fn cull_below(&self, top: u32, frustum: &Frustum, sink: &mut impl Sink, work: &mut WorkCounts) {
        let mut stack = WalkStack::from(top);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            work.nodes += 1;
            match classify(frustum, node, work) {
                Containment::Outside => {}
                Containment::Inside => {
                    let ids = &self.ids[node.all()];
                    work.taken_whole += ids.len() as u64;
                    work.reported += ids.len() as u64;
                    sink.put(ids);
                }
                Containment::Intersects => {
                    self.take_own(node, frustum, sink, work);
                    node.children().rev().for_each(|child| stack.push(child));
                }
            }
        }
    }

    /// Reports the own polygons of a node that a plane cuts.
    fn take_own(&self, node: &super::Node, frustum: &Frustum, sink: &mut impl Sink, work: &mut WorkCounts) {
        if self.cut_nodes == CutNodes::Drawn {
            let ids = &self.ids[node.own()];
            work.reported += ids.len() as u64;
            sink.put(ids);
            return;
        }
        let mut seen = Gather::new();
        for Item { bounds, id } in &self.items[node.own()] {
            if passes(frustum, PlaneMask::ALL, bounds, work) {
                work.reported += 1;
                seen.push(*id, sink);
            }
        }
        seen.flush(sink);
    }

    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.nodes.is_empty() {
            return work;
        }
        let mut stack = WalkStack::from(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            work.nodes += 1;
            let containment = classify(frustum, node, &mut work);
            if containment == Containment::Outside {
                continue;
            }
            let is_leaf = node.children().next().is_none();
            let polygons = node.all().len();
            let decision =
                visitor.node(&Node { bounds: &node.cell, depth: node.depth, containment, polygons, is_leaf });
            let sink = &mut VisitorSink { visitor, decision };
            match decision {
                Visit::Skip => {}
                Visit::Take => self.cull_below(at, frustum, sink, &mut work),
                Visit::Descend => {
                    self.take_own(node, frustum, sink, &mut work);
                    node.children().rev().for_each(|child| stack.push(child));
                }
            }
        }
        work
    }
}

fn classify(frustum: &Frustum, node: &super::Node, work: &mut WorkCounts) -> Containment {
    let (containment, _, planes) = frustum.classify_masked(&node.cell, PlaneMask::ALL);
    work.boxes += 1;
    work.planes += u64::from(planes);
    containment
}
