//! A tree of boxes in one array, for any builder. Nodes are stored depth first, each with the number of the node that
//! follows its whole subtree. Polygons are stored in the order of the leaves, so a subtree's polygons are one slice.
//!
//! The layout with skip numbers is from Brian Smits, "Efficiency Issues for Ray Tracing" (1998). Skipping planes that
//! have a whole node in front of them ("plane masking") is from Lee Bishop et al., "Designing a PC Game Engine" (1998).

mod near;
mod ray;
mod wide;
mod wide_node;

use wide_node::WideNode;

use super::{
    by_id::NO_POLYGON,
    item::Item,
    lanes::BoxLanes,
    sink::{Gather, Sink, VisitorSink},
};
use osp::{
    index::{Node, Visit, Visitor, WorkCounts},
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

/// Largest depth of a node. Builders halve the number of polygons from [`COUNTED_DEPTH`] on, so no tree is deeper.
pub(super) const MAX_DEPTH: usize = 96;

/// From this depth on a builder must halve the number of polygons at every split, so that 32 more levels suffice for all
/// polygons.
pub(super) const COUNTED_DEPTH: usize = 60;

/// A node, 32 bytes.
#[derive(Clone, Copy, Debug)]
struct FlatNode {
    bounds: Aabb,
    /// Number of polygons, and holes, of the leaves below.
    polygons: u32,
    /// The number of the next node outside the subtree; for a leaf, the node's own number plus 1.
    skip: u32,
}

/// The tree. A builder calls [`FlatTree::start`], then [`FlatTree::inner`] and [`FlatTree::leaf`] in depth-first order,
/// then [`FlatTree::finish`].
#[derive(Clone, Debug, Default)]
pub(super) struct FlatTree {
    nodes: Vec<FlatNode>,
    lanes: BoxLanes,
    /// Number of polygons removed since the tree was built.
    holes: usize,
    /// Working memory of a build: the nodes whose subtrees are not complete, from the top.
    open: Vec<u32>,
    /// The same tree with eight children a node, for the frustum query.
    wide: Vec<WideNode>,
}

impl FlatTree {
    /// Empties the tree, and reserves memory for `polygons` polygons.
    pub(super) fn start(&mut self, polygons: usize) {
        self.clear();
        self.lanes.reserve(polygons);
    }

    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.lanes.clear();
        self.open.clear();
        self.wide.clear();
        self.holes = 0;
    }

    /// Adds the next node in depth-first order: an inner node with two to eight children. The top has depth 0.
    pub(super) fn inner(&mut self, depth: usize) {
        self.close(depth);
        self.open.push(self.nodes.len() as u32);
        self.nodes.push(FlatNode { bounds: Aabb::EMPTY, polygons: 0, skip: 0 });
    }

    /// Adds the next node in depth-first order: a leaf with these polygons.
    pub(super) fn leaf(&mut self, depth: usize, items: &[Item]) {
        self.close(depth);
        let at = self.nodes.len() as u32;
        let bounds = items.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
        self.lanes.append(items);
        self.nodes.push(FlatNode { bounds, polygons: items.len() as u32, skip: at + 1 });
    }

    /// Completes the nodes of this depth and deeper, because later nodes are not below them.
    fn close(&mut self, depth: usize) {
        let next = self.nodes.len() as u32;
        for node in self.open.drain(depth.min(self.open.len())..) {
            self.nodes[node as usize].skip = next;
        }
    }

    /// Completes the tree: computes boxes and counts of the inner nodes.
    pub(super) fn finish(&mut self) {
        self.close(0);
        for at in (0..self.nodes.len()).rev() {
            self.gather_children(at);
        }
        self.widen();
    }

    fn is_leaf(&self, at: usize) -> bool {
        self.nodes[at].skip as usize == at + 1
    }

    fn children(&self, at: usize) -> impl Iterator<Item = usize> + '_ {
        let end = self.nodes[at].skip as usize;
        let mut next = at + 1;
        std::iter::from_fn(move || {
            let child = next;
            (child < end).then(|| {
                next = self.nodes[child].skip as usize;
                child
            })
        })
    }

    fn gather_children(&mut self, at: usize) {
        if !self.is_leaf(at) {
            let (mut bounds, mut polygons) = (Aabb::EMPTY, 0);
            for child in self.children(at) {
                bounds = bounds.union(&self.nodes[child].bounds);
                polygons += self.nodes[child].polygons;
            }
            (self.nodes[at].bounds, self.nodes[at].polygons) = (bounds, polygons);
        }
    }

    pub(super) fn holes(&self) -> usize {
        self.holes
    }

    /// The polygons in the order of the leaves; [`NO_POLYGON`] for a hole.
    pub(super) fn ids(&self) -> &[PolygonId] {
        self.lanes.ids()
    }

    /// Replaces the box of the polygon at position `at` of [`FlatTree::ids`]. The next [`FlatTree::refit`] updates the
    /// nodes.
    pub(super) fn set_box(&mut self, at: usize, bounds: &Aabb) {
        self.lanes.set(at, bounds);
    }

    /// Removes the polygon at position `at` of [`FlatTree::ids`]; the boxes above keep their size.
    pub(super) fn vacate(&mut self, at: usize) {
        self.lanes.vacate(at);
        self.holes += 1;
    }

    /// Makes all node boxes tight again, from the leaves up: O(nodes).
    pub(super) fn refit(&mut self) {
        let mut end = self.lanes.len();
        for at in (0..self.nodes.len()).rev() {
            if self.is_leaf(at) {
                let first = end - self.nodes[at].polygons as usize;
                self.nodes[at].bounds = self.lanes.bounds(first..end);
                end = first;
            } else {
                self.gather_children(at);
            }
        }
        self.widen();
    }

    /// The sum of the surfaces of all nodes as a multiple of the top's surface, a measure of a query's work. 0 if the top
    /// has no surface.
    pub(super) fn relative_area(&self) -> f64 {
        let Some(top) = self.nodes.first() else { return 0.0 };
        let all: f64 = self.nodes.iter().map(|node| area(&node.bounds)).sum();
        if area(&top.bounds) > 0.0 { all / area(&top.bounds) } else { 0.0 }
    }

    fn cull(&self, part: Part, frustum: &Frustum, sink: &mut impl Sink) -> WorkCounts {
        let mut work = WorkCounts::default();
        let Part { start: mut at, end, mut first, mask } = part;
        let mut above = Ancestors::new(end, mask);
        while at < end {
            let mask = above.mask_at(at);
            let node = &self.nodes[at];
            let next = node.skip as usize;
            let behind_it = first + node.polygons as usize;
            work.nodes += 1;
            work.boxes += 1;
            let (containment, mask, planes) = frustum.classify_masked(&node.bounds, mask);
            work.planes += u64::from(planes);
            match containment {
                Containment::Outside => {}
                Containment::Inside => self.take(first, behind_it, sink, &mut work),
                Containment::Intersects if next == at + 1 => {
                    self.cull_leaf(first..behind_it, (frustum, mask), sink, &mut work);
                }
                Containment::Intersects => {
                    above.push(next, mask);
                    at += 1;
                    continue;
                }
            }
            (at, first) = (next, behind_it);
        }
        work
    }

    fn take(&self, first: usize, end: usize, sink: &mut impl Sink, work: &mut WorkCounts) {
        let ids = &self.lanes.ids()[first..end];
        let mut taken = ids.len();
        if self.holes == 0 {
            sink.put(ids);
        } else {
            let mut seen = Gather::new();
            for &id in ids {
                if id == NO_POLYGON {
                    taken -= 1;
                } else {
                    seen.push(id, sink);
                }
            }
            seen.flush(sink);
        }
        work.taken_whole += taken as u64;
        work.reported += taken as u64;
    }

    pub(super) fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut above = Ancestors::new(self.nodes.len(), PlaneMask::ALL);
        let (mut at, mut first) = (0, 0);
        while at < self.nodes.len() {
            let mask = above.mask_at(at);
            let node = &self.nodes[at];
            let next = node.skip as usize;
            let behind_it = first + node.polygons as usize;
            work.nodes += 1;
            work.boxes += 1;
            let (containment, inner_mask, planes) = frustum.classify_masked(&node.bounds, mask);
            work.planes += u64::from(planes);
            if containment != Containment::Outside {
                let is_leaf = next == at + 1;
                let decision = visitor.node(&Node {
                    bounds: &node.bounds,
                    depth: above.len() as u32,
                    containment,
                    polygons: node.polygons as usize,
                    is_leaf,
                });
                let sink = &mut VisitorSink { visitor, decision };
                match decision {
                    Visit::Skip => {}
                    Visit::Descend if !is_leaf => {
                        above.push(next, inner_mask);
                        at += 1;
                        continue;
                    }
                    _ if containment == Containment::Inside => self.take(first, behind_it, sink, &mut work),
                    _ if is_leaf => {
                        self.cull_leaf(first..behind_it, (frustum, inner_mask), sink, &mut work);
                    }
                    _ => {
                        let part = Part { start: at + 1, end: next, first, mask: inner_mask };
                        work += self.cull(part, frustum, sink);
                    }
                }
            }
            (at, first) = (next, behind_it);
        }
        work
    }

    /// Number of nodes, including leaves.
    pub(super) fn node_count(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<FlatNode>()
            + self.lanes.bytes()
            + self.open.capacity() * size_of::<u32>()
            + self.wide.capacity() * size_of::<WideNode>()
    }
}

/// Half the surface of a box, in `f64`, because the squares of `f32` numbers overflow.
#[inline]
pub(super) fn area(bounds: &Aabb) -> f64 {
    if bounds.is_empty() { 0.0 } else { joined_area(bounds, bounds) }
}

/// Half the surface of the smallest box around two boxes that are not empty.
#[inline]
pub(super) fn joined_area(a: &Aabb, b: &Aabb) -> f64 {
    let (min, max) = (a.min.min(b.min), a.max.max(b.max));
    let x = f64::from(max.x) - f64::from(min.x);
    let y = f64::from(max.y) - f64::from(min.y);
    let z = f64::from(max.z) - f64::from(min.z);
    x * y + y * z + z * x
}

/// A range of node numbers, from `start` up to, but excluding, `end`: some consecutive children of one node, with their
/// subtrees.
#[derive(Clone, Copy, Debug)]
struct Part {
    start: usize,
    end: usize,
    /// Position of the first polygon of these nodes.
    first: usize,
    /// The planes that cut the parent of these nodes.
    mask: PlaneMask,
}

/// The ancestors of the current node: the end of each ancestor's subtree, and the planes that cut the ancestor.
struct Ancestors {
    ends: [(u32, PlaneMask); MAX_DEPTH + 1],
    len: usize,
}

impl Ancestors {
    fn new(end: usize, mask: PlaneMask) -> Self {
        Self { ends: [(end as u32, mask); MAX_DEPTH + 1], len: 1 }
    }

    /// The planes to test for node `at`. Drops the ancestors whose subtrees end before it.
    #[inline]
    fn mask_at(&mut self, at: usize) -> PlaneMask {
        while self.len > 1 && self.ends[self.len - 1].0 as usize <= at {
            self.len -= 1;
        }
        self.ends[self.len - 1].1
    }

    #[inline]
    fn push(&mut self, end: usize, mask: PlaneMask) {
        // In a tree that is too deep, the mask of a higher ancestor would only repeat some plane tests.
        if self.len < self.ends.len() {
            self.ends[self.len] = (end as u32, mask);
            self.len += 1;
        }
    }

    fn len(&self) -> usize {
        self.len - 1
    }
}
