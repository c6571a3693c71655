//! The modified shadow-volume BSP tree in a form that never hides visible polygons ("MSVBSP-C").
//!
//! After section 3.2.4 of "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", which
//! modifies N. Chin, S. Feiner, "Near Real-Time Shadow Generation Using BSP Trees", 1989.
//!
//! # The algorithm
//! The first cell is the window, a convex cone of directions. The shadow planes of the best occluder cut this cell, one
//! after the other. The part behind a plane becomes a new cell. Other occluders that reach this cell divide it further.
//! The part in front of all planes is in the shadow of the occluder. An occluder's *cap* is the plane that ends the
//! shadow volume at the occluder. A leaf in the shadow stores the caps of all occluders that cover its cell. A volume
//! in this cell is hidden if it lies beyond one of these caps.
//!
//! # Differences from the paper
//! Rules 1 and 3 of the paper (best occluder first, its planes together) are kept. The other rules hide visible polygons,
//! as `osp_rivals::occlusion::MsvbspPaper` shows, and are replaced:
//! * Rule 2 sorts planes into cells by the uncut edges of their occluder. So an occluder loses a plane in a cell that the
//!   plane's edge never reaches. Here every occluder is clipped to the cell, but only to find *whether* it reaches the
//!   cell. All planes of an occluder are inserted, or none. They are the planes of the whole occluder, never of the clipped
//!   piece.
//! * Rules 5 and 6 delete planes that two occluders share, in a pass beforehand. Here a plane is omitted exactly if the
//!   cell already lies in front of it, which includes shared planes on both sides.
//! * Rule 4 drops other occluders that reach a shadowed cell. Here occluders that come nearer than the cap divide the
//!   cell further.
//! * The paper has no caps, so it culls everything between the eye and an occluder.
//!
//! # Why it is conservative
//! 1. The cell of a leaf lies in the cone of every occluder in the leaf's list. A side plane on the way down cuts
//!    the cell to the part in front of the plane. It is omitted if the whole cell lies there. Cells only shrink.
//!    Clipped pieces do not appear in this argument. Errors in them make the shadow smaller, never wrong.
//! 2. A point x of a volume, inside the window, lies in one leaf's cell. The query reaches this leaf, because it skips a
//!    child only if the whole volume lies on the other side.
//! 3. If the verdict is "hidden", the volume lies beyond the cap of an occluder of that leaf. By step 1, the ray from the
//!    eye to x meets this occluder. It meets the occluder before x, because no part of the occluder lies beyond its cap.
//!    The hit point is drawn, because occluders are clipped to the near plane first.
//!
//! If a budget is used up, the leaf gets the caps that are proven so far, without the current occluder.

use glam::DVec3;

use super::{
    BuildCounts, Needed, OcclusionCuller, ShadowVolume, Tested, TestedBoxes,
    cone::{self, Span},
    tolerance::{IMPLIED_SINE, RELEVANT_AREA_SR, RELEVANT_SINE},
    tree::{CapRule, Caps, Cell, Child, Link, MAX_DEPTH, ShadowTree, Side},
};
use crate::{
    math::{Aabb, Sphere},
    view::ViewWindow,
};

/// Settings of [`Msvbsp`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[doc(hidden)]
pub struct MsvbspConfig {
    /// Largest number of splitting planes. It also bounds the time of a build. A plane takes 32 bytes.
    pub node_budget: usize,
    /// Largest sum of the corners of all cells and clipped pieces of one build. A corner takes 24 bytes.
    pub point_budget: usize,
}

impl Default for MsvbspConfig {
    /// 4,096 planes, 65,536 corners.
    fn default() -> Self {
        Self { node_budget: 4096, point_budget: 65_536 }
    }
}

/// An occluder that reaches a cell, and its outline, clipped to the cell or still whole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) occluder: u32,
    pub(super) outline: Span,
}

/// A cell that is still to be divided.
#[derive(Clone, Copy, Debug)]
struct Task {
    link: Link,
    depth: u32,
    cell: Span,
    pieces: Span,
    caps: Caps,
}

/// MSVBSP-C; see [`self`](crate::occlusion::msvbsp).
#[derive(Clone, Debug)]
#[doc(hidden)]
pub struct Msvbsp {
    config: MsvbspConfig,
    tree: ShadowTree,
    /// Working memory of a build. Corners are only appended, so whole outlines and cells can share them.
    points: Vec<DVec3>,
    pieces: Vec<Piece>,
    tasks: Vec<Task>,
    current: Vec<Piece>,
    ahead: Vec<Piece>,
    counts: BuildCounts,
}

impl Msvbsp {
    /// A culler without occluders; allocates all its memory now.
    pub fn new(config: MsvbspConfig) -> Self {
        Self {
            config,
            tree: ShadowTree::new(config.node_budget, config.node_budget, CapRule::Any),
            points: Vec::with_capacity(config.point_budget),
            // Builds within the node budget hardly ever need more than these capacities.
            pieces: Vec::with_capacity(4 * config.node_budget),
            tasks: Vec::with_capacity(config.node_budget),
            current: Vec::with_capacity(config.node_budget),
            ahead: Vec::with_capacity(config.node_budget),
            counts: BuildCounts::default(),
        }
    }

    /// The tree as it was last built.
    pub fn tree(&self) -> &ShadowTree {
        &self.tree
    }

    fn leaf(&mut self, task: &Task) {
        self.tree.set(task.link, Child::leaf(task.caps));
    }

    /// Divides one cell down to the leaf in front of all planes. The parts behind the planes become tasks.
    fn build_cell(&mut self, mut task: Task, occluders: &[ShadowVolume]) {
        self.current.clear();
        let range = task.pieces.range();
        self.current.extend_from_slice(&self.pieces[range.clone()]);
        self.pieces.truncate(range.start);
        let mut next = 0;
        while let Some(&piece) = self.current.get(next) {
            next += 1;
            let occluder = &occluders[piece.occluder as usize];
            if !self.cut(&mut task, &mut next, occluder) {
                continue;
            }
            if self.tree.is_full_of_caps() {
                break;
            }
            task.caps = self.tree.add_cap(task.caps, occluder);
            // Only occluders with a corner nearer than this cap can hide more in the cell.
            let (normal, distance) = (occluder.cap_normal(), occluder.cap_distance_m());
            self.ahead.clear();
            self.ahead.extend(self.current[next..].iter().copied().filter(|p| {
                let corners = occluders[p.occluder as usize].corners();
                corners.iter().any(|v| normal.dot(*v) < distance)
            }));
            std::mem::swap(&mut self.current, &mut self.ahead);
            next = 0;
        }
        self.leaf(&task);
    }

    /// Cuts the cell along an occluder's planes. Returns whether the cell then lies in the occluder's cone.
    fn cut(&mut self, task: &mut Task, next: &mut usize, occluder: &ShadowVolume) -> bool {
        for &normal in occluder.sides() {
            let (low, high) = cone::reach(normal, &self.points[task.cell.range()]);
            if low >= -IMPLIED_SINE {
                continue;
            }
            if high <= IMPLIED_SINE {
                return false;
            }
            if self.tree.node_count() >= self.config.node_budget
                || task.depth >= MAX_DEPTH
                || self.points.len() + 2 * (task.cell.len as usize + 2) > self.config.point_budget
            {
                self.counts.left_out += 1;
                return false;
            }
            let (front, back) = cone::split(&mut self.points, task.cell, normal);
            // Corners lie on both sides, so the part in front has at least one corner and two crossings. The test
            // is for rounding errors.
            if front.len < 3 {
                return false;
            }
            let node = self.tree.push(task.link, normal, task.depth);
            task.depth += 1;
            let behind = self.pieces.len() as u32;
            self.divide(normal, *next);
            *next = 0;
            std::mem::swap(&mut self.current, &mut self.ahead);
            let behind = Span { start: behind, len: self.pieces.len() as u32 - behind };
            let link = Link::Below(node, Side::Back);
            let back = Task { link, depth: task.depth, cell: back, pieces: behind, caps: task.caps };
            if behind.len == 0 || back.cell.len < 3 {
                self.pieces.truncate(behind.start as usize);
                self.leaf(&back);
            } else {
                self.tasks.push(back);
            }
            task.cell = front;
            task.link = Link::Below(node, Side::Front);
        }
        true
    }

    /// Sorts the pieces of the current cell from number `next` on by a plane: pieces in front go to `ahead`, pieces
    /// behind to the end of `pieces`.
    fn divide(&mut self, normal: DVec3, next: usize) {
        self.ahead.clear();
        for i in next..self.current.len() {
            let piece = self.current[i];
            self.counts.pieces += 1;
            let (low, high) = cone::reach(normal, &self.points[piece.outline.range()]);
            let (reaches_front, reaches_back) = (high > RELEVANT_SINE, low < -RELEVANT_SINE);
            if !reaches_back {
                self.ahead.push(piece);
            } else if !reaches_front {
                self.pieces.push(piece);
            } else if self.points.len() + 2 * (piece.outline.len as usize + 2) > self.config.point_budget {
                self.counts.left_out += 1;
            } else {
                let (front, back) = cone::split(&mut self.points, piece.outline, normal);
                if cone::has_area(&self.points[front.range()], RELEVANT_AREA_SR) {
                    self.ahead.push(Piece { outline: front, ..piece });
                }
                if cone::has_area(&self.points[back.range()], RELEVANT_AREA_SR) {
                    self.pieces.push(Piece { outline: back, ..piece });
                }
            }
        }
    }
}

impl OcclusionCuller for Msvbsp {
    fn name(&self) -> &'static str {
        "msvbsp"
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.tree.clear(window.eye_in_world());
        self.points.clear();
        self.pieces.clear();
        self.tasks.clear();
        self.counts = BuildCounts { occluders: occluders.len() as u32, ..BuildCounts::default() };
        self.points.extend_from_slice(window.corners());
        let cell = Span { start: 0, len: 4 };
        for (i, occluder) in occluders.iter().enumerate() {
            let start = self.points.len() as u32;
            let corners = occluder.corners();
            if self.points.len() + corners.len() > self.config.point_budget {
                self.counts.left_out += (occluders.len() - i) as u32;
                break;
            }
            self.points.extend(corners.iter().map(|v| v.normalize_or_zero()));
            let outline = Span { start, len: corners.len() as u32 };
            self.pieces.push(Piece { occluder: i as u32, outline });
        }
        let pieces = Span { start: 0, len: self.pieces.len() as u32 };
        self.tasks.push(Task { link: Link::Top, depth: 1, cell, pieces, caps: Caps::NONE });
        while let Some(task) = self.tasks.pop() {
            self.build_cell(task, occluders);
        }
        self.counts.nodes = self.tree.node_count() as u32;
        self.counts.depth = self.tree.depth();
        self.counts
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.tree.test_box(bounds)
    }

    fn test_box_in(&self, bounds: &Aabb, from: Cell) -> (Tested, Cell) {
        self.tree.test_box_in(bounds, from)
    }

    fn test_boxes(&self, boxes: &[Aabb], from: Cell, needed: Needed) -> TestedBoxes {
        self.tree.test_boxes(boxes, from, needed)
    }

    fn test_corners(&self, bounds: &Aabb) -> Tested {
        self.tree.test_corners(bounds)
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.tree.test_sphere(sphere)
    }
}
