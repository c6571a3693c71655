use super::{BucketTree, Partition, ROOT};
use crate::{
    lanes::Planes,
    plane_lanes::PlaneLanes,
    sink::{Sink, VisitorSink},
    walk_stack::WalkStack,
};
use osp::{
    index::{
        Backend, Node, Visit, Visitor, WorkCounts,
        kernels::{Kernel, Nearest, PlaneSet, WithKernel, is_wanted},
    },
    math::{Containment, Frustum, PlaneMask, Ray},
};

struct Cull<'a, P: Partition, S> {
    tree: &'a BucketTree<P>,
    top: u32,
    mask: PlaneMask,
    one: PlaneLanes,
    many: PlaneSet,
    sink: &'a mut S,
}

impl<P: Partition, S: Sink> WithKernel for Cull<'_, P, S> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WorkCounts {
        let Self { tree, sink, .. } = self;
        let mut work = WorkCounts::default();
        let mut stack = WalkStack::from((self.top, self.mask.bits()));
        while let Some((at, mask)) = stack.pop() {
            let node = tree.node(at);
            work.nodes += 1;
            let mut mask = mask;
            if mask != 0 {
                work.boxes += 1;
                work.planes += u64::from(mask.count_ones());
                let Some(cut) = self.one.cut(kernel, mask, &node.bounds) else { continue };
                mask = cut;
            }
            if !node.is_leaf() {
                tree.push_children(at, |child| stack.push((child, mask)));
            } else if mask == 0 {
                tree.buckets.take_all(node.chain, sink, &mut work);
            } else {
                tree.buckets.cull(node.chain, kernel, Planes { all: &self.many, mask }, sink, &mut work);
            }
        }
        work
    }
}

impl<P: Partition> BucketTree<P> {
    pub(super) fn frustum_cull_all(&self, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        if self.node(ROOT).polygons == 0 {
            return WorkCounts::default();
        }
        self.cull(ROOT, PlaneMask::ALL, frustum, sink)
    }

    fn cull(&self, top: u32, mask: PlaneMask, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let (one, many) = (PlaneLanes::new(frustum), PlaneSet::new(frustum));
        Backend::detect().run(Cull { tree: self, top, mask, one, many, sink })
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
            let decision =
                visitor.node(&Node { bounds: &node.bounds, depth, containment, polygons, is_leaf });
            let sink = &mut VisitorSink { visitor, decision };
            match decision {
                Visit::Skip => {}
                Visit::Descend if !is_leaf => {
                    self.push_children(at, |child| stack.push((child, mask, depth + 1)));
                }
                Visit::Descend | Visit::Take => work += self.cull(at, mask, frustum, sink),
            }
        }
        work
    }

    /// Passes the polygons along a ray to `nearest`, near children first.
    pub(super) fn test_along(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        let Some(t) = ray.enter_box(&self.node(ROOT).bounds, nearest.reach()) else { return };
        let mut stack = WalkStack::from((t, ROOT));
        while let Some((t, at)) = stack.pop() {
            if !is_wanted(t, nearest.reach()) {
                continue;
            }
            if self.node(at).is_leaf() {
                for (_, item) in self.buckets.items(self.node(at).chain) {
                    if ray.enter_box(&item.bounds, nearest.reach()).is_some() {
                        nearest.test(item.id);
                    }
                }
                continue;
            }
            // For at most four children, removing the farthest child repeatedly is the quickest sort.
            let mut hits: [Option<(f32, u32)>; 4] = [None; 4];
            for (hit, child) in hits.iter_mut().zip(self.children(at)) {
                *hit = ray.enter_box(&self.node(child).bounds, nearest.reach()).map(|t| (t, child));
            }
            let farther = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0);
            while let Some(hit) = hits.iter().flatten().copied().max_by(farther) {
                hits.iter_mut()
                    .filter(|other| other.is_some_and(|o| o.1 == hit.1))
                    .for_each(|other| *other = None);
                stack.push(hit);
            }
        }
    }
}
