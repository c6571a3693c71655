use glam::Vec3;

use super::{grid::MAX_MAX_DEPTH, node::OspNode, tree::OspPaper};
use crate::{
    as_printed::CutNodes,
    exact::passes,
    sink::{Gather, Sink, VisitorSink},
};
use osp::{
    index::{Node, Visit, Visitor, WorkCounts},
    math::{Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

/// Largest number of nodes on the stack: one for each level.
const STACK: usize = MAX_MAX_DEPTH as usize + 2;

/// The frustum and, for each of its planes, the corner of a box that lies farthest along the plane's normal.
struct EightPointTest<'a> {
    frustum: &'a Frustum,
    farthest_along: [usize; 6],
}

impl<'a> EightPointTest<'a> {
    fn new(frustum: &'a Frustum) -> Self {
        // The bits of a corner's number select max on x, y, z; see `Aabb::corners`.
        let farthest_along = frustum.planes().map(|plane| {
            let n = plane.normal;
            usize::from(n.x >= 0.0) | usize::from(n.y >= 0.0) << 1 | usize::from(n.z >= 0.0) << 2
        });
        Self { frustum, farthest_along }
    }

    /// Position of the eight points relative to the planes. Equals [`Frustum::classify`] of the node's box.
    fn test(&self, points: &[Vec3; 8], work: &mut WorkCounts) -> Containment {
        work.boxes += 1;
        let mut all_inside = true;
        for (plane, &along) in self.frustum.planes().iter().zip(&self.farthest_along) {
            work.planes += 1;
            if plane.signed_distance(points[along]) < 0.0 {
                return Containment::Outside;
            }
            // The opposite corner lies farthest against the normal.
            all_inside &= plane.signed_distance(points[7 - along]) >= 0.0;
        }
        if all_inside { Containment::Inside } else { Containment::Intersects }
    }
}

/// Nodes still to be visited.
struct Stack {
    nodes: [u32; STACK],
    len: usize,
}

impl Stack {
    fn from(node: u32) -> Self {
        let mut stack = Self { nodes: [0; STACK], len: 0 };
        stack.push(node);
        stack
    }

    fn push(&mut self, node: u32) {
        self.nodes[self.len] = node;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        Some(self.nodes[self.len])
    }
}

impl OspPaper {
    /// Culls as Fig. 6 does, and then tests the polygons outside the cube.
    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let mut work = WorkCounts::default();
        if self.nodes[0].holds_any() {
            self.cull_below(0, &EightPointTest::new(frustum), draw_list, &mut work);
        }
        self.test_each(&self.outside, frustum, draw_list, &mut work);
        work
    }

    /// Culls as Fig. 6 does, from `top` downwards. If all points of a node are inside, the node and its children are
    /// drawn. If all are behind one plane, nothing is drawn. If a plane cuts the node, its own polygons are drawn (here
    /// after a test of each), and both children are tested.
    fn cull_below(&self, top: u32, test: &EightPointTest<'_>, sink: &mut impl Sink, work: &mut WorkCounts) {
        let mut stack = Stack::from(top);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            work.nodes += 1;
            match test.test(&node.osp_box, work) {
                Containment::Outside => {}
                Containment::Inside => self.take_all(at, sink, work),
                Containment::Intersects => {
                    self.take_own(&node.tri_names, test.frustum, sink, work);
                    self.push_children(node, &mut stack);
                }
            }
        }
    }

    fn take_all(&self, top: u32, sink: &mut impl Sink, work: &mut WorkCounts) {
        let mut stack = Stack::from(top);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            work.nodes += u64::from(at != top);
            work.taken_whole += node.tri_names.len() as u64;
            work.reported += node.tri_names.len() as u64;
            sink.put(&node.tri_names);
            self.push_children(node, &mut stack);
        }
    }

    fn push_children(&self, node: &OspNode, stack: &mut Stack) {
        if node.is_subnode {
            for child in [node.back, node.front] {
                if self.nodes[child as usize].holds_any() {
                    stack.push(child);
                }
            }
        }
    }

    /// Reports the own polygons of a node that a plane cuts.
    fn take_own(&self, ids: &[PolygonId], frustum: &Frustum, sink: &mut impl Sink, work: &mut WorkCounts) {
        match self.cut_nodes {
            CutNodes::Tested => self.test_each(ids, frustum, sink, work),
            CutNodes::Drawn => {
                work.reported += ids.len() as u64;
                sink.put(ids);
            }
        }
    }

    fn test_each(&self, ids: &[PolygonId], frustum: &Frustum, sink: &mut impl Sink, work: &mut WorkCounts) {
        let mut seen = Gather::new();
        for &id in ids {
            if passes(frustum, PlaneMask::ALL, &self.boxes.get(id), work) {
                work.reported += 1;
                seen.push(id, sink);
            }
        }
        seen.flush(sink);
    }

    /// Does the same traversal, and calls `visitor` at every node. The visitor gets the polygons outside the cube as an
    /// additional leaf of depth 0.
    pub(super) fn visit(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        let test = EightPointTest::new(frustum);
        let mut stack = Stack::from(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.holds_any() {
                continue; // Only an empty root, because children without polygons are never pushed.
            }
            work.nodes += 1;
            let containment = test.test(&node.osp_box, &mut work);
            if containment == Containment::Outside {
                continue;
            }
            let decision = visitor.node(&Node {
                bounds: &node.bounds(),
                depth: node.depth,
                containment,
                polygons: node.polygons as usize,
                is_leaf: !node.is_subnode,
            });
            let sink = &mut VisitorSink { visitor, decision };
            match decision {
                Visit::Skip => {}
                Visit::Take => self.cull_below(at, &test, sink, &mut work),
                Visit::Descend => {
                    self.take_own(&node.tri_names, frustum, sink, &mut work);
                    self.push_children(node, &mut stack);
                }
            }
        }
        self.visit_outside(frustum, visitor, &mut work);
        work
    }

    fn visit_outside(&self, frustum: &Frustum, visitor: &mut dyn Visitor, work: &mut WorkCounts) {
        let (_, bounds) = self.outside();
        let containment = frustum.classify(&bounds);
        if self.outside.is_empty() || containment == Containment::Outside {
            return;
        }
        work.nodes += 1;
        let polygons = self.outside.len();
        let decision =
            visitor.node(&Node { bounds: &bounds, depth: 0, containment, polygons, is_leaf: true });
        if decision != Visit::Skip {
            self.test_each(&self.outside, frustum, &mut VisitorSink { visitor, decision }, work);
        }
    }
}
