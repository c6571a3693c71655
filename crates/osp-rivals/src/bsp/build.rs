use glam::Vec3;

use super::{
    order::{NO_NODE, OrderTree},
    plane::{MAX_CORNERS, Side, SplitPlane},
};
use crate::{
    bvh::{
        Median,
        top_down::{InPlaceBuilder, LEAF_CAPACITY, longest_axis},
    },
    by_id::ById,
    flat_tree::{COUNTED_DEPTH, FlatTree},
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};

/// Depth up to which the culling tree follows the planes. Deeper nodes halve the number of polygons.
pub(super) const MAX_DEPTH: usize = COUNTED_DEPTH;

/// Largest number of pieces on which a candidate plane is tested to rate it.
const TRIED_ON: usize = 48;

/// If a plane leaves at least this share of the pieces on one side, the builder also tries a plane across an axis. A
/// smaller share makes shallower trees with more cuts.
const LOPSIDED: f64 = 0.75;

/// For nodes with fewer pieces, the builder tries no plane across an axis. Such nodes may become chains.
const SMALL: usize = 16;

/// Largest number of pieces of a tree with few polygons.
const FEWEST_PIECES: usize = 4096;

/// Largest average number of corners of a piece.
const CORNERS_PER_PIECE: usize = 8;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BspConfig {
    /// Number of polygons of a node whose planes the builder rates. A larger number makes better trees and slower
    /// builds.
    pub candidates: usize,
    /// Cost of a cut, as a number of polygons by which the sides differ. A larger weight makes deeper trees with fewer
    /// pieces.
    pub cut_weight: f32,
    /// Largest number of pieces for each polygon, over the whole tree. Beyond this limit, nodes become leaves.
    pub max_pieces_per_polygon: usize,
}

impl Default for BspConfig {
    fn default() -> Self {
        Self { candidates: 8, cut_weight: 8.0, max_pieces_per_polygon: 8 }
    }
}

#[derive(Clone, Copy, Debug)]
struct Part {
    /// The piece's polygon, as an index of the items.
    item: u32,
    first: u32,
    corners: u32,
    /// Whether the node of this piece culls the polygon. True for the largest piece.
    is_culled_here: bool,
}

/// A plane that can split a node.
#[derive(Clone, Copy, Debug)]
struct Choice {
    plane: SplitPlane,
    /// The polygon that has this plane; `None` for a plane across an axis.
    own: Option<u32>,
    cost: f64,
    /// Share of the rated pieces that lie on the larger side.
    larger_share: f64,
}

/// A node still to be made. Its pieces are at the end of [`BspBuilder::waiting`].
#[derive(Clone, Copy, Debug)]
struct Pending {
    start: u32,
    depth: u32,
    parent: u32,
    is_front: bool,
}

#[derive(Debug)]
pub(super) struct BspBuilder {
    config: BspConfig,
    /// The polygons whose corners are known. A rectangle replaces each other polygon (see [`plate`]).
    shapes: ById<Option<ConvexPolygon>>,
    order: OrderTree,
    // Scratch of a build.
    planes: Vec<Option<SplitPlane>>,
    parts: Vec<Part>,
    points: Vec<Vec3>,
    waiting: Vec<u32>,
    pending: Vec<Pending>,
    here: Vec<u32>,
    front: Vec<u32>,
    back: Vec<u32>,
    cut: [Vec<Vec3>; 2],
    /// The boxes of the culling tree, in the order of their nodes.
    cull_items: Vec<Item>,
    /// For each node its boxes in `cull_items`.
    cull_ranges: Vec<CullRange>,
    halves: InPlaceBuilder<Median>,
}

/// The boxes of a node in the culling tree.
#[derive(Clone, Copy, Debug)]
struct CullRange {
    first: u32,
    /// Number of boxes of the node itself.
    own: u32,
    /// Number of boxes in the subtree.
    all: u32,
}

impl BspBuilder {
    pub(super) fn new(config: BspConfig) -> Self {
        Self {
            config,
            shapes: ById::new(None),
            order: OrderTree::default(),
            planes: Vec::new(),
            parts: Vec::new(),
            points: Vec::new(),
            waiting: Vec::new(),
            pending: Vec::new(),
            here: Vec::new(),
            front: Vec::new(),
            back: Vec::new(),
            cut: [Vec::new(), Vec::new()],
            cull_items: Vec::new(),
            cull_ranges: Vec::new(),
            halves: InPlaceBuilder::new(Median(LEAF_CAPACITY)),
        }
    }

    pub(super) fn order(&self) -> &OrderTree {
        &self.order
    }

    /// Drops the tree of the last build.
    pub(super) fn clear_order(&mut self) {
        self.order.clear();
    }

    pub(super) fn clear(&mut self) {
        self.shapes.clear();
        self.order.clear();
    }

    /// Sets the corners of a polygon, or drops them.
    pub(super) fn set_shape(&mut self, id: PolygonId, shape: Option<ConvexPolygon>) {
        if shape.is_some() || self.shapes.get(id).is_some() {
            self.shapes.set(id, shape);
        }
    }

    fn corners(&self, part: u32) -> &[Vec3] {
        let part = &self.parts[part as usize];
        &self.points[part.first as usize..(part.first + part.corners) as usize]
    }

    fn add_part(&mut self, item: u32, corners: &[Vec3], is_culled_here: bool) -> u32 {
        let first = self.points.len() as u32;
        self.points.extend_from_slice(corners);
        self.parts.push(Part { item, first, corners: corners.len() as u32, is_culled_here });
        self.parts.len() as u32 - 1
    }

    fn take_in(&mut self, items: &[Item]) {
        self.planes.clear();
        self.parts.clear();
        self.points.clear();
        self.waiting.clear();
        self.cull_items.clear();
        self.cull_ranges.clear();
        self.order.clear();
        for (at, item) in items.iter().enumerate() {
            let shape = self.shapes.get(item.id).unwrap_or_else(|| plate(&item.bounds));
            self.planes.push(SplitPlane::of(shape.vertices()));
            let part = self.add_part(at as u32, shape.vertices(), true);
            self.waiting.push(part);
        }
    }

    /// Rates a plane for the current pieces, and stores it in `best` if it is better. `own` is the polygon that has this
    /// plane.
    fn consider(&self, plane: SplitPlane, own: Option<u32>, best: &mut Option<Choice>) {
        let (mut front, mut back, mut both) = (0.0, 0.0, 0.0);
        let step = self.here.len().div_ceil(TRIED_ON).max(1);
        for &part in self.here.iter().step_by(step) {
            if own == Some(self.parts[part as usize].item) {
                continue;
            }
            match plane.side(self.corners(part)) {
                Side::On => {}
                Side::Front => front += 1.0,
                Side::Back => back += 1.0,
                Side::Both => both += 1.0,
            }
        }
        let cost = f64::abs(front - back) + f64::from(self.config.cut_weight) * both;
        if best.is_none_or(|choice| cost < choice.cost) {
            let tried = self.here.len().div_ceil(step) as f64;
            let larger_share = (f64::max(front, back) + both) / tried;
            *best = Some(Choice { plane, own, cost, larger_share });
        }
    }

    /// The plane that splits the current pieces.
    fn choose(&self) -> Option<Choice> {
        let mut best = None;
        let step = self.here.len().div_ceil(self.config.candidates.max(1)).max(1);
        // Samples the middle of each step, because the first and the last piece are often the ends of a stroke.
        for &part in self.here.iter().skip(step / 2).step_by(step) {
            let item = self.parts[part as usize].item;
            if let Some(plane) = self.planes[item as usize] {
                self.consider(plane, Some(item), &mut best);
            }
        }
        if best.is_none() {
            // None of the sampled polygons has a plane, but another may have one.
            let mut items = self.here.iter().map(|&part| self.parts[part as usize].item);
            if let Some((item, plane)) = items.find_map(|item| Some((item, self.planes[item as usize]?))) {
                self.consider(plane, Some(item), &mut best);
            }
        }
        let is_lopsided = best.is_none_or(|choice| choice.larger_share > LOPSIDED);
        if is_lopsided && self.here.len() >= SMALL {
            let mut middles = [Vec3::ZERO; TRIED_ON];
            let step = self.here.len().div_ceil(TRIED_ON);
            let sample = self.here.iter().step_by(step).map(|&part| middle(self.corners(part)));
            let count = middles.iter_mut().zip(sample).map(|(at, middle)| *at = middle).count();
            let middles = &mut middles[..count];
            let bounds = Aabb::from_points(middles);
            let axis = longest_axis(&bounds);
            if bounds.min[axis] < bounds.max[axis] {
                middles.sort_unstable_by(|a, b| a[axis].total_cmp(&b[axis]));
                let mut across = None;
                self.consider(SplitPlane::across(axis, middles[count / 2][axis]), None, &mut across);
                let better = |choice: &Choice| {
                    choice.larger_share <= LOPSIDED || best.is_none_or(|best| choice.cost < best.cost)
                };
                best = across.filter(better).or(best);
            }
        }
        // Refuses a plane across an axis that leaves all pieces on one side. The next node would choose it again.
        best.filter(|choice| choice.own.is_some() || choice.larger_share < 1.0)
    }

    /// Whether the limits allow a split of the current pieces.
    fn has_room(&self, polygons: usize) -> bool {
        let pieces = polygons.saturating_mul(self.config.max_pieces_per_polygon.max(1)).max(FEWEST_PIECES);
        let points = pieces.saturating_mul(CORNERS_PER_PIECE);
        self.parts.len() + 2 * self.here.len() <= pieces.min(u32::MAX as usize)
            && self.points.len() + 16 * self.here.len() <= points.min(u32::MAX as usize)
    }

    fn build_order(&mut self, items: &[Item]) {
        self.take_in(items);
        self.pending.clear();
        self.pending.push(Pending { start: 0, depth: 0, parent: NO_NODE, is_front: false });
        while let Some(Pending { start, depth, parent, is_front }) = self.pending.pop() {
            self.here.clear();
            self.here.extend(self.waiting.drain(start as usize..));
            let may_split = self.here.len() > 1 && (depth as usize) < MAX_DEPTH && self.has_room(items.len());
            let split = if may_split { self.choose() } else { None };
            let (plane, own) = split.map_or((SplitPlane::NONE, None), |choice| (choice.plane, choice.own));
            let node = self.order.node(plane, depth as usize);
            if let Some(parent) = self.order.nodes.get_mut(parent as usize) {
                *(if is_front { &mut parent.front } else { &mut parent.back }) = node;
            }
            let first = self.cull_items.len() as u32;
            self.front.clear();
            self.back.clear();
            for i in 0..self.here.len() {
                let part = self.here[i];
                let item = self.parts[part as usize].item;
                let stays = split.is_none() || own == Some(item);
                match if stays { Side::On } else { plane.side(self.corners(part)) } {
                    Side::On => self.keep(part, items),
                    Side::Front => self.front.push(part),
                    Side::Back => self.back.push(part),
                    Side::Both => self.split(part, &plane),
                }
            }
            self.cull_ranges.push(CullRange { first, own: self.cull_items.len() as u32 - first, all: 0 });
            // The builder makes the last pending node first: the node behind the plane.
            for (is_front, parts) in [(true, &self.front), (false, &self.back)] {
                if !parts.is_empty() {
                    let start = self.waiting.len() as u32;
                    self.waiting.extend_from_slice(parts);
                    self.pending.push(Pending { start, depth: depth + 1, parent: node, is_front });
                }
            }
        }
    }

    /// Makes a part a piece of the current node.
    fn keep(&mut self, part: u32, items: &[Item]) {
        let Part { item, first, corners, is_culled_here } = self.parts[part as usize];
        let item = items[item as usize];
        self.order.piece(item.id, &self.points[first as usize..(first + corners) as usize]);
        if is_culled_here {
            self.cull_items.push(item);
        }
    }

    /// Cuts a part into two parts.
    fn split(&mut self, part: u32, plane: &SplitPlane) {
        let Part { item, corners, is_culled_here, .. } = self.parts[part as usize];
        let larger = plane.larger_side(self.corners(part));
        let [mut front, mut back] = std::mem::take(&mut self.cut);
        plane.cut(self.corners(part), &mut front, &mut back);
        let fits = |piece: &[Vec3]| (3..=MAX_CORNERS).contains(&piece.len());
        if (corners as usize) < MAX_CORNERS && fits(&front) && fits(&back) {
            let part = self.add_part(item, &front, is_culled_here && larger == Side::Front);
            self.front.push(part);
            let part = self.add_part(item, &back, is_culled_here && larger == Side::Back);
            self.back.push(part);
        } else if larger == Side::Front {
            self.front.push(part);
        } else {
            self.back.push(part);
        }
        self.cut = [front, back];
    }

    /// Builds the culling tree from the nodes that cull polygons. Nodes with few polygons become leaves.
    fn build_cull(&mut self, tree: &mut FlatTree) {
        let all = |ranges: &[CullRange], node: u32| ranges.get(node as usize).map_or(0, |range| range.all);
        for at in (0..self.order.nodes.len()).rev() {
            let node = &self.order.nodes[at];
            self.cull_ranges[at].all = self.cull_ranges[at].own
                + all(&self.cull_ranges, node.front)
                + all(&self.cull_ranges, node.back);
        }
        let mut waiting = vec![(0, 0)];
        while let Some((mut at, depth)) = waiting.pop() {
            let (range, node) = loop {
                let (range, node) = (self.cull_ranges[at as usize], self.order.nodes[at as usize]);
                let [front, back] = [node.front, node.back].map(|node| all(&self.cull_ranges, node));
                match (range.own, front, back) {
                    (0, 0, 1..) => at = node.back,
                    (0, 1.., 0) => at = node.front,
                    _ => break (range, node),
                }
            };
            if range.all == 0 {
                continue;
            }
            let first = range.first as usize;
            if range.all as usize <= LEAF_CAPACITY || range.own == range.all {
                self.group(first, range.all as usize, depth, tree);
                continue;
            }
            tree.inner(depth);
            if range.own > 0 {
                self.group(first, range.own as usize, depth + 1, tree);
            }
            let below = [node.front, node.back];
            let has_some = |node: &u32| all(&self.cull_ranges, *node) > 0;
            waiting.extend(below.into_iter().filter(has_some).map(|node| (node, depth + 1)));
        }
    }

    /// Adds consecutive polygons. Halves their number until each half fits into a leaf.
    fn group(&mut self, first: usize, count: usize, depth: usize, tree: &mut FlatTree) {
        self.halves.build_below(&mut self.cull_items[first..first + count], depth, tree);
    }
}

impl TreeBuilder for BspBuilder {
    const NAME: &'static str = "bsp";
    const ON_UPDATE: OnUpdate = OnUpdate::Rebuild;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        self.build_order(items);
        self.build_cull(tree);
    }

    fn bytes(&self) -> usize {
        let cut: usize = self.cut.iter().map(Vec::capacity).sum();
        let lists = [&self.waiting, &self.here, &self.front, &self.back];
        self.shapes.bytes()
            + self.order.bytes()
            + self.planes.capacity() * size_of::<Option<SplitPlane>>()
            + self.parts.capacity() * size_of::<Part>()
            + (self.points.capacity() + cut) * size_of::<Vec3>()
            + lists.iter().map(|list| list.capacity()).sum::<usize>() * size_of::<u32>()
            + self.pending.capacity() * size_of::<Pending>()
            + self.cull_items.capacity() * size_of::<Item>()
            + self.cull_ranges.capacity() * size_of::<CullRange>()
            + self.halves.bytes()
    }
}

/// The middle of some points. The computation does not overflow.
fn middle(points: &[Vec3]) -> Vec3 {
    let bounds = Aabb::from_points(points);
    bounds.center()
}

/// The replacement of a polygon without known corners: the rectangle through the middle of its box, perpendicular to
/// the box's shortest side.
fn plate(bounds: &Aabb) -> ConvexPolygon {
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    let axis = half.min_position();
    let mut corner = bounds.min;
    corner[axis] = bounds.center()[axis];
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let at = |max_u: bool, max_v: bool| {
        let mut p = corner;
        p[u] = if max_u { bounds.max[u] } else { p[u] };
        p[v] = if max_v { bounds.max[v] } else { p[v] };
        p
    };
    ConvexPolygon::quad([at(false, false), at(true, false), at(true, true), at(false, true)])
}
