//! The frustum query of a [`FlatTree`]: eight children and sixteen polygons at a time.
//!
//! The tree is collapsed to nodes of eight children by repeatedly opening the child with the largest surface: Ingo
//! Wald, Carsten Benthin and Solomon Boulos, "Getting Rid of Packets" (2008), section 3.

use std::ops::Range;

use super::{
    FlatTree, MAX_DEPTH, area,
    wide_node::{LEAF, WIDTH, WideNode},
};
use crate::{
    lanes::{BoxLanes, Planes},
    sink::Sink,
};
use osp::{
    index::{
        Backend, WorkCounts,
        kernels::{Boxes, IdWriter, Kernel, PlaneSet, WithKernel, prefetch_lines},
    },
    math::{Frustum, PlaneMask},
    polygon::PolygonId,
};

/// Nodes that become children of one wide node: their numbers, and the positions of their first polygons.
struct Children {
    entries: [(usize, usize); WIDTH],
    count: usize,
}

impl Children {
    fn replace(&mut self, at: usize, by: impl Iterator<Item = (usize, usize)>, count: usize) {
        self.entries.copy_within(at + 1..self.count, at + count);
        for (place, entry) in self.entries[at..at + count].iter_mut().zip(by) {
            *place = entry;
        }
        self.count += count - 1;
    }
}

impl FlatTree {
    /// Computes the wide nodes again: O(nodes).
    pub(super) fn widen(&mut self) {
        let mut wide = std::mem::take(&mut self.wide);
        wide.clear();
        if !self.nodes.is_empty() {
            self.widen_below(0, 0, &mut wide);
        }
        self.wide = wide;
    }

    /// Appends the wide node of node `at`, and the wide nodes below it. Returns the number of the first.
    fn widen_below(&self, at: usize, first: usize, wide: &mut Vec<WideNode>) -> u32 {
        assert!(self.children(at).count() <= WIDTH, "builders make at most eight children");
        let mut children = Children { entries: [(at, first); WIDTH], count: 1 };
        loop {
            let open = (0..children.count).filter_map(|i| {
                let (node, _) = children.entries[i];
                let arity = self.children(node).count();
                (arity > 0 && children.count + arity - 1 <= WIDTH).then_some((i, arity, node))
            });
            let largest =
                open.max_by(|a, b| area(&self.nodes[a.2].bounds).total_cmp(&area(&self.nodes[b.2].bounds)));
            let Some((i, arity, node)) = largest else { break };
            let mut first = children.entries[i].1;
            let below = self.children(node).map(|child| {
                let entry = (child, first);
                first += self.nodes[child].polygons as usize;
                entry
            });
            children.replace(i, below, arity);
        }
        let number = wide.len();
        wide.push(WideNode {
            boxes: Boxes::EMPTY,
            children: [LEAF; WIDTH],
            first: [0; WIDTH],
            polygons: [0; WIDTH],
            used: (1 << children.count) - 1,
        });
        for (lane, &(node, first)) in children.entries[..children.count].iter().enumerate() {
            let below = if self.is_leaf(node) { LEAF } else { self.widen_below(node, first, wide) };
            let place = &mut wide[number];
            place.boxes.set(lane, &self.nodes[node].bounds);
            place.children[lane] = below;
            place.first[lane] = first as u32;
            place.polygons[lane] = self.nodes[node].polygons;
        }
        number as u32
    }

    pub(crate) fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let planes = PlaneSet::new(frustum);
        IdWriter::append(draw_list, |out| Backend::detect().run(Cull { tree: self, planes, out }))
    }

    /// Tests the polygons of a leaf against the planes of a mask.
    pub(super) fn cull_leaf(
        &self,
        range: Range<usize>,
        (frustum, mask): (&Frustum, PlaneMask),
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        let (lanes, planes) = (&self.lanes, PlaneSet::new(frustum));
        Backend::detect().run(CullLeaf { lanes, range, planes, mask: mask.bits(), sink, work });
    }
}

struct CullLeaf<'a, S> {
    lanes: &'a BoxLanes,
    range: Range<usize>,
    planes: PlaneSet,
    mask: u8,
    sink: &'a mut S,
    work: &'a mut WorkCounts,
}

impl<S: Sink> WithKernel for CullLeaf<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let planes = Planes { all: &self.planes, mask: self.mask };
        self.lanes.cull(self.range, kernel, planes, self.sink, self.work);
    }
}

struct Cull<'a, 'b> {
    tree: &'a FlatTree,
    planes: PlaneSet,
    out: &'a mut IdWriter<'b>,
}

impl WithKernel for Cull<'_, '_> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WorkCounts {
        let mut work = WorkCounts::default();
        // The stack has at most seven siblings of each visited node.
        let mut stack = [(0u32, 0u8); (WIDTH - 1) * MAX_DEPTH + 1];
        stack[0] = (0, PlaneSet::ALL);
        let mut waiting = usize::from(!self.tree.wide.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let (number, mask) = stack[waiting];
            let node = &self.tree.wide[number as usize];
            work.nodes += 1;
            let sides = self.planes.sides(kernel, mask, &node.boxes);
            work.boxes += u64::from(node.used.count_ones());
            work.planes += u64::from(node.used.count_ones() * mask.count_ones());
            let mut seen = node.used & !sides.behind;
            while seen != 0 {
                let lane = seen.ilog2() as usize;
                seen &= !(1 << lane);
                let planes = sides.planes_at(mask, lane);
                let first = node.first[lane] as usize;
                let range = first..first + node.polygons[lane] as usize;
                if planes == 0 {
                    self.tree.take(range.start, range.end, self.out, &mut work);
                } else if node.children[lane] == LEAF {
                    let planes = Planes { all: &self.planes, mask: planes };
                    self.tree.lanes.cull(range, kernel, planes, self.out, &mut work);
                } else {
                    prefetch_lines::<5, _>(&raw const self.tree.wide[node.children[lane] as usize]);
                    stack[waiting] = (node.children[lane], planes);
                    waiting += 1;
                }
            }
        }
        work
    }
}
