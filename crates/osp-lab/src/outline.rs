//! The tree of any structure, as its traversal reports it. One implementation traverses all structures in two orders,
//! and counts the work.

use std::{collections::BinaryHeap, ops::Range};

use osp::{
    index::{
        Node, SpatialIndex, Visit, Visitor,
        kernels::{Nearest, SearchEntry, is_wanted},
    },
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// Order in which the nodes that a ray enters are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Depth first, the nearest child first.
    InOrder,
    /// Best first: always the nearest of all waiting nodes.
    BestFirst,
}

impl Order {
    pub const ALL: [Self; 2] = [Self::InOrder, Self::BestFirst];

    pub fn name(self) -> &'static str {
        match self {
            Self::InOrder => "in-order",
            Self::BestFirst => "best-first",
        }
    }
}

/// Work of ray traversal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    pub nodes: u64,
    /// Number of boxes of nodes and of polygons that were tested.
    pub boxes: u64,
    pub exact_tests: u64,
}

/// A ball that moves along a ray.
#[derive(Clone, Copy, Debug)]
pub struct WideRay {
    /// The ray along which the ball's centre moves.
    pub ray: Ray,
    /// Radius of the ball, metres, at least 0.
    pub radius_m: f32,
}

impl WideRay {
    /// Lower bound of the `t` at which the ball meets an object in the box; `None` beyond the nearest hit. A ball lies
    /// in the cube around it, so the box is enlarged by its radius.
    fn enter_box(&self, bounds: &Aabb, nearest: &Nearest<'_>) -> Option<f32> {
        let enlarged = Aabb::new(bounds.min - self.radius_m, bounds.max + self.radius_m);
        self.ray.enter_box(&enlarged, nearest.reach())
    }
}

#[derive(Clone, Debug)]
struct OutlineNode {
    bounds: Aabb,
    /// Index after the last node of the subtree; nodes are stored depth first.
    end: u32,
    /// Range of the node's own polygons in `ids`.
    polygons: Range<u32>,
}

/// The nodes and polygons of a structure. The first node does not belong to the structure; it contains all other nodes.
#[derive(Clone, Debug)]
pub struct Outline {
    nodes: Vec<OutlineNode>,
    ids: Vec<PolygonId>,
    boxes: Vec<Aabb>,
}

/// Collects the nodes of a traversal.
struct Gatherer<'a> {
    boxes: &'a [Aabb],
    nodes: Vec<OutlineNode>,
    parents: Vec<u32>,
    depths: Vec<u32>,
    /// Index of the current node.
    at: u32,
    owners: Vec<(u32, PolygonId)>,
}

impl Visitor for Gatherer<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        // The additional first node has depth 0, so the structure's nodes are one level deeper.
        let depth = node.depth + 1;
        let mut parent = self.at;
        while self.depths[parent as usize] >= depth {
            parent = self.parents[parent as usize];
        }
        self.at = self.nodes.len() as u32;
        self.nodes.push(OutlineNode { bounds: *node.bounds, end: 0, polygons: 0..0 });
        self.parents.push(parent);
        self.depths.push(depth);
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
        for &id in ids {
            // Some structures report the polygons of a node after those of its descendants.
            let mut owner = self.at as usize;
            while owner > 0 && !self.nodes[owner].bounds.contains(&self.boxes[id.index()]) {
                owner = self.parents[owner] as usize;
            }
            self.owners.push((owner as u32, id));
        }
    }
}

impl Outline {
    /// The outline of a structure that contains polygons with these boxes, which are indexed by id.
    pub fn of(index: &dyn SpatialIndex, boxes: &[Aabb]) -> Self {
        let around = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
        let top = OutlineNode { bounds: around, end: 0, polygons: 0..0 };
        let mut gatherer = Gatherer {
            boxes,
            nodes: vec![top],
            parents: vec![0],
            depths: vec![0],
            at: 0,
            owners: Vec::with_capacity(boxes.len()),
        };
        index.traverse(&Frustum::everything(), &mut gatherer);
        let Gatherer { mut nodes, parents, mut owners, .. } = gatherer;
        for at in (0..nodes.len()).rev() {
            let end = nodes[at].end.max(at as u32 + 1);
            nodes[at].end = end;
            let parent = &mut nodes[parents[at] as usize];
            parent.end = parent.end.max(end);
        }
        owners.sort_by_key(|&(owner, _)| owner);
        for (i, &(owner, _)) in owners.iter().enumerate() {
            let polygons = &mut nodes[owner as usize].polygons;
            if polygons.start == polygons.end {
                polygons.start = i as u32;
            }
            polygons.end = i as u32 + 1;
        }
        let ids: Vec<PolygonId> = owners.into_iter().map(|(_, id)| id).collect();
        let boxes = ids.iter().map(|id| boxes[id.index()]).collect();
        Self { nodes, ids, boxes }
    }

    #[cfg(all(test, feature = "bench"))]
    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    fn children(&self, at: u32) -> impl Iterator<Item = u32> + '_ {
        let end = self.nodes[at as usize].end;
        let mut next = at + 1;
        std::iter::from_fn(move || {
            let child = (next < end).then_some(next)?;
            next = self.nodes[child as usize].end;
            Some(child)
        })
    }

    /// Sets the polygons' boxes, indexed by id, and refits the boxes of the nodes from below. The structure of the tree
    /// does not change.
    pub fn refit(&mut self, boxes: &[Aabb]) {
        for (bounds, id) in self.boxes.iter_mut().zip(&self.ids) {
            *bounds = boxes[id.index()];
        }
        for at in (0..self.nodes.len()).rev() {
            let own = self.nodes[at].polygons.clone();
            let own = self.boxes[own.start as usize..own.end as usize].iter();
            let below = self.children(at as u32).map(|child| &self.nodes[child as usize].bounds);
            self.nodes[at].bounds = own.chain(below).fold(Aabb::EMPTY, |all, b| all.union(b));
        }
    }

    /// The nearest hit of a ray, by traversal in the given order.
    pub fn nearest(
        &self,
        order: Order,
        ray: &Ray,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
        steps: &mut Steps,
    ) -> Option<(PolygonId, f32)> {
        self.nearest_around(order, &WideRay { ray: *ray, radius_m: 0.0 }, hit, steps)
    }

    /// The first polygon that a ball meets as it moves along a ray. `hit` returns the `t` at which the ball meets a
    /// polygon.
    pub fn nearest_around(
        &self,
        order: Order,
        ray: &WideRay,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
        steps: &mut Steps,
    ) -> Option<(PolygonId, f32)> {
        let mut asked = 0;
        let mut count = |id| {
            asked += 1;
            hit(id)
        };
        let mut nearest = Nearest::new(f32::INFINITY, &mut count);
        match order {
            Order::InOrder => self.in_order(ray, &mut nearest, steps),
            Order::BestFirst => self.best_first(ray, &mut nearest, steps),
        }
        let found = nearest.found();
        steps.exact_tests += asked;
        found
    }

    fn in_order(&self, ray: &WideRay, nearest: &mut Nearest<'_>, steps: &mut Steps) {
        let mut stack = Vec::with_capacity(64);
        stack.push(SearchEntry { t: 0.0, place: 0 });
        while let Some(SearchEntry { t, place: node }) = stack.pop() {
            if is_wanted(t, nearest.reach()) {
                let before = stack.len();
                self.expand(node, ray, nearest, steps, |waiting| stack.push(waiting));
                stack[before..].sort_unstable();
            }
        }
    }

    fn best_first(&self, ray: &WideRay, nearest: &mut Nearest<'_>, steps: &mut Steps) {
        let mut heap = BinaryHeap::with_capacity(64);
        heap.push(SearchEntry { t: 0.0, place: 0 });
        while let Some(SearchEntry { t, place: node }) = heap.pop() {
            // All other waiting nodes are farther away.
            if !is_wanted(t, nearest.reach()) {
                return;
            }
            self.expand(node, ray, nearest, steps, |waiting| heap.push(waiting));
        }
    }

    /// Tests the polygons of a node and queues its children.
    fn expand(
        &self,
        at: u32,
        ray: &WideRay,
        nearest: &mut Nearest<'_>,
        steps: &mut Steps,
        mut wait: impl FnMut(SearchEntry<u32>),
    ) {
        // The first node does not count, because it does not belong to the structure.
        steps.nodes += u64::from(at > 0);
        let own = &self.nodes[at as usize].polygons;
        let own = own.start as usize..own.end as usize;
        steps.boxes += own.len() as u64;
        for (bounds, &id) in self.boxes[own.clone()].iter().zip(&self.ids[own]) {
            if ray.enter_box(bounds, nearest).is_some() {
                nearest.test(id);
            }
        }
        for child in self.children(at) {
            steps.boxes += 1;
            if let Some(t) = ray.enter_box(&self.nodes[child as usize].bounds, nearest) {
                wait(SearchEntry { t, place: child });
            }
        }
    }
}
