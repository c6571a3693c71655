use glam::{DVec3, Vec3};

use super::plane::SplitPlane;
use crate::walk_stack::WalkStack;
use osp::{
    math::{Aabb, clip_convex},
    polygon::PolygonId,
};

/// Number of a node that does not exist.
pub(super) const NO_NODE: u32 = u32::MAX;

/// The size of a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BspCounts {
    pub nodes: usize,
    /// Number of pieces of all polygons; the number of polygons if nothing was cut.
    pub pieces: usize,
    /// Number of pieces in leaves with several pieces, because a limit was reached or the pieces have no plane. Such
    /// pieces are ordered by distance, and this order may be wrong.
    pub unordered: usize,
    pub depth: usize,
}

/// A node: the pieces in its plane, and the nodes in front of the plane and behind it. A leaf has no plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrderNode {
    pub(super) plane: SplitPlane,
    pub(super) front: u32,
    pub(super) back: u32,
    /// The node's own pieces.
    pub(super) first: u32,
    pub(super) count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Piece {
    id: PolygonId,
    first: u32,
    corners: u32,
}

#[derive(Clone, Copy, Debug)]
pub struct BspNode<'a> {
    tree: &'a OrderTree,
    node: &'a OrderNode,
}

impl<'a> BspNode<'a> {
    pub(super) fn at(tree: &'a OrderTree, number: u32) -> Option<Self> {
        Some(Self { tree, node: tree.nodes.get(number as usize)? })
    }

    /// The node in front of this node's plane.
    pub fn front(self) -> Option<Self> {
        Self::at(self.tree, self.node.front)
    }

    /// The node behind this node's plane.
    pub fn back(self) -> Option<Self> {
        Self::at(self.tree, self.node.back)
    }

    /// The pieces in this node's plane, or all pieces of a leaf: the polygon of each, and the corners in order, world space.
    pub fn pieces(self) -> impl Iterator<Item = (PolygonId, &'a [Vec3])> {
        self.tree.own(self.node).iter().map(move |piece| (piece.id, self.tree.corners(piece)))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    BackToFront,
    FrontToBack,
}

/// Polygons that are cut so that they have an order from every eye. Nodes are stored depth first, the node behind a plane
/// first.
#[derive(Clone, Debug, Default)]
pub(super) struct OrderTree {
    pub(super) nodes: Vec<OrderNode>,
    pieces: Vec<Piece>,
    points: Vec<Vec3>,
    depth: usize,
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Below(u32),
    Own(u32),
}

impl OrderTree {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.pieces.clear();
        self.points.clear();
        self.depth = 0;
    }

    /// Adds the next node in depth-first order, without pieces; returns its number.
    pub(super) fn node(&mut self, plane: SplitPlane, depth: usize) -> u32 {
        let first = self.pieces.len() as u32;
        self.nodes.push(OrderNode { plane, front: NO_NODE, back: NO_NODE, first, count: 0 });
        self.depth = self.depth.max(depth);
        self.nodes.len() as u32 - 1
    }

    /// Adds a piece to the last node.
    pub(super) fn piece(&mut self, id: PolygonId, corners: &[Vec3]) {
        let first = self.points.len() as u32;
        self.points.extend_from_slice(corners);
        self.pieces.push(Piece { id, first, corners: corners.len() as u32 });
        if let Some(node) = self.nodes.last_mut() {
            node.count += 1;
        }
    }

    fn own(&self, node: &OrderNode) -> &[Piece] {
        &self.pieces[node.first as usize..(node.first + node.count) as usize]
    }

    fn corners(&self, piece: &Piece) -> &[Vec3] {
        &self.points[piece.first as usize..(piece.first + piece.corners) as usize]
    }

    /// Calls `draw` with all pieces in this order from `eye`.
    pub(super) fn walk(&self, eye: Vec3, order: Order, draw: &mut impl FnMut(PolygonId, &[Vec3])) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = WalkStack::from(Step::Below(0));
        while let Some(step) = stack.pop() {
            match step {
                Step::Own(at) => self.draw_own(&self.nodes[at as usize], eye, order, draw),
                Step::Below(NO_NODE) => {}
                Step::Below(at) => {
                    let node = &self.nodes[at as usize];
                    let in_front = node.plane.distance(eye) >= 0.0;
                    let front_is_last = in_front == (order == Order::BackToFront);
                    let (first, last) =
                        if front_is_last { (node.back, node.front) } else { (node.front, node.back) };
                    stack.push(Step::Below(last));
                    stack.push(Step::Own(at));
                    stack.push(Step::Below(first));
                }
            }
        }
    }

    /// See [`Bsp::splits`](super::Bsp::splits).
    pub(super) fn splits(&self, bounds: &Aabb, most: usize, draw: &mut impl FnMut(u32, &[Vec3])) {
        let (center, reach) = (bounds.center().as_dvec3(), f64::from(bounds.extent().length()));
        let sides: Vec<_> = (0..3)
            .flat_map(|axis| {
                let (min, max) = (bounds.min[axis], bounds.max[axis]);
                [(SplitPlane::across(axis, min), 1.0), (SplitPlane::across(axis, max), -1.0)]
            })
            .collect();
        // Draws the planes level by level, so that the limit omits the lowest levels.
        let mut queue = std::collections::VecDeque::from([(0u32, 0u32, sides)]);
        let mut drawn = 0;
        while let Some((at, depth, sides)) = queue.pop_front() {
            let Some(node) = self.nodes.get(at as usize).filter(|node| !node.plane.is_none()) else {
                continue;
            };
            if drawn == most {
                return;
            }
            drawn += 1;
            let mut outline = node.plane.square(center, reach);
            for (plane, sign) in &sides {
                let mut kept = Vec::with_capacity(outline.len() + 1);
                clip_convex(&outline, |p: DVec3| sign * plane.distance_of(p), |p| kept.push(p));
                outline = kept;
            }
            let corners: Vec<Vec3> = outline.iter().map(|p| p.as_vec3()).collect();
            if corners.len() > 2 {
                draw(depth, &corners);
            }
            for (below, sign) in [(node.front, 1.0), (node.back, -1.0)] {
                let mut sides = sides.clone();
                sides.push((node.plane, sign));
                queue.push_back((below, depth + 1, sides));
            }
        }
    }

    fn draw_own(&self, node: &OrderNode, eye: Vec3, order: Order, draw: &mut impl FnMut(PolygonId, &[Vec3])) {
        let own = self.own(node);
        if own.len() < 2 || !node.plane.is_none() {
            own.iter().for_each(|piece| draw(piece.id, self.corners(piece)));
            return;
        }
        let distance = |piece: &Piece| {
            let corners = self.corners(piece);
            let sum: f64 = corners.iter().map(|p| p.as_dvec3().distance_squared(eye.as_dvec3())).sum();
            sum / corners.len().max(1) as f64
        };
        let mut by_distance: Vec<(f64, &Piece)> = own.iter().map(|piece| (distance(piece), piece)).collect();
        by_distance.sort_by(|a, b| match order {
            Order::BackToFront => b.0.total_cmp(&a.0),
            Order::FrontToBack => a.0.total_cmp(&b.0),
        });
        by_distance.iter().for_each(|(_, piece)| draw(piece.id, self.corners(piece)));
    }

    pub(super) fn counts(&self) -> BspCounts {
        let several = self.nodes.iter().filter(|node| node.plane.is_none() && node.count > 1);
        BspCounts {
            nodes: self.nodes.len(),
            pieces: self.pieces.len(),
            unordered: several.map(|node| node.count as usize).sum(),
            depth: self.depth,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<OrderNode>()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.points.capacity() * size_of::<Vec3>()
    }
}
