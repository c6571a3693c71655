use super::tree::{Below, BoxTree, NONE};
use crate::{
    plane_lanes::PlaneLanes,
    sink::{Gather, Sink, VisitorSink},
    walk_stack::WalkStack,
};
use osp::{
    index::{
        Backend, Node, Visit, Visitor, WorkCounts,
        kernels::{Kernel, Nearest, WithKernel, is_wanted},
    },
    math::{Containment, Frustum, PlaneMask, Ray},
    polygon::PolygonId,
};

struct Cull<'a, S> {
    tree: &'a BoxTree,
    top: u32,
    mask: PlaneMask,
    planes: PlaneLanes,
    sink: &'a mut S,
}

impl<S: Sink> WithKernel for Cull<'_, S> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WorkCounts {
        let Self { tree, sink, .. } = self;
        let mut work = WorkCounts::default();
        let mut seen = Gather::new();
        let mut stack = WalkStack::from((self.top, self.mask.bits()));
        while let Some((at, mask)) = stack.pop() {
            work.nodes += 1;
            let mut mask = mask;
            if mask != 0 {
                work.boxes += 1;
                work.planes += u64::from(mask.count_ones());
                let Some(cut) = self.planes.cut(kernel, mask, &tree.node(at).bounds) else { continue };
                mask = cut;
            }
            match tree.below(at) {
                Below::Leaf(id) => {
                    work.reported += 1;
                    seen.push(id, sink);
                }
                Below::Inner(_) if mask == 0 => tree.take_below(at, &mut seen, sink, &mut work),
                Below::Inner([a, b]) => {
                    stack.push((b, mask));
                    stack.push((a, mask));
                }
            }
        }
        seen.flush(sink);
        work
    }
}

impl BoxTree {
    pub(crate) fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        if self.root == NONE {
            return WorkCounts::default();
        }
        self.cull(self.root, PlaneMask::ALL, frustum, draw_list)
    }

    fn cull(&self, top: u32, mask: PlaneMask, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        Backend::detect().run(Cull { tree: self, top, mask, planes: PlaneLanes::new(frustum), sink })
    }

    /// Reports all polygons below an inner node without a test.
    fn take_below(&self, top: u32, seen: &mut Gather, sink: &mut impl Sink, work: &mut WorkCounts) {
        let mut stack = WalkStack::from(top);
        let mut taken = 0;
        while let Some(mut at) = stack.pop() {
            loop {
                match self.below(at) {
                    Below::Leaf(id) => {
                        taken += 1;
                        seen.push(id, sink);
                        break;
                    }
                    Below::Inner([a, b]) => {
                        stack.push(b);
                        at = a;
                    }
                }
            }
        }
        // The number of nodes of a binary tree, except its top.
        work.nodes += 2 * taken - 2;
        work.taken_whole += taken;
        work.reported += taken;
    }

    pub(crate) fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
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
            let below = self.below(at);
            let decision = visitor.node(&Node {
                bounds: &node.bounds,
                depth,
                containment,
                polygons: node.polygons as usize,
                is_leaf: matches!(below, Below::Leaf(_)),
            });
            let sink = &mut VisitorSink { visitor, decision };
            match (decision, below) {
                (Visit::Skip, _) => {}
                (_, Below::Leaf(id)) => {
                    work.reported += 1;
                    sink.put(&[id]);
                }
                (Visit::Descend, Below::Inner([a, b])) => {
                    stack.push((b, mask, depth + 1));
                    stack.push((a, mask, depth + 1));
                }
                (Visit::Take, Below::Inner(_)) => work += self.cull(at, mask, frustum, sink),
            }
        }
        work
    }

    /// Passes the polygons along a ray to `nearest`, the nearer child first.
    pub(crate) fn ray_nearest(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        if self.root == NONE {
            return;
        }
        let Some(t) = ray.enter_box(&self.node(self.root).bounds, nearest.reach()) else { return };
        let mut stack = WalkStack::from((t, self.root));
        while let Some((t, at)) = stack.pop() {
            if !is_wanted(t, nearest.reach()) {
                continue;
            }
            match self.below(at) {
                Below::Leaf(id) => nearest.test(id),
                Below::Inner([a, b]) => {
                    let enter = |child| ray.enter_box(&self.node(child).bounds, nearest.reach());
                    match (enter(a), enter(b)) {
                        (Some(to_a), Some(to_b)) if to_a <= to_b => {
                            stack.push((to_b, b));
                            stack.push((to_a, a));
                        }
                        (to_a, to_b) => {
                            to_a.into_iter().for_each(|t| stack.push((t, a)));
                            to_b.into_iter().for_each(|t| stack.push((t, b)));
                        }
                    }
                }
            }
        }
    }
}
