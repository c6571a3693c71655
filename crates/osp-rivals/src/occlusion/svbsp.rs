//! The shadow-volume BSP tree, in two forms.
//!
//! N. Chin, S. Feiner, "Near Real-Time Shadow Generation Using BSP Trees", 1989, insert occluder after occluder.
//! Section 3.2.3 of the OSP paper sorts single planes instead: [`SortedPlanes`].
//!
//! # Differences from Chin and Feiner
//! * Polygons are inserted front to back by their nearest corners, not by a BSP tree of the scene. If two polygons overlap
//!   in depth, this order is not exact. No result depends on the order, because every shadowed leaf has its occluder's cap.
//! * If a piece of a polygon reaches an unoccluded leaf, the leaf is divided by the planes of the whole polygon, not of
//!   the piece. Otherwise a plane lost by a rounding error would hide visible polygons. A plane is omitted if the whole
//!   cell lies in front of it.

use glam::DVec3;

use super::sorted_planes::SortedPlanes;
use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, Cell, Needed, OcclusionCuller, ShadowVolume, Tested, TestedBoxes,
        kernels::{
            CapRule, Caps, Child, IMPLIED_SINE, Link, MAX_DEPTH, RELEVANT_AREA_SR, RELEVANT_SINE, ShadowTree,
            Side, Span, clip, has_area, reach,
        },
    },
    view::ViewWindow,
};

/// A piece of a polygon that descends the tree.
#[derive(Clone, Copy, Debug)]
struct Task {
    link: Link,
    at: Child,
    depth: u32,
    cell: Span,
    outline: Span,
}

/// The order in which planes enter the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SvbspForm {
    /// Occluder after occluder with all planes, the nearest occluder first (N. Chin and S. Feiner).
    Occluders,
    /// Single planes of all occluders, a good plane first (section 3.2.3 of the OSP paper).
    Planes,
}

/// A shadow-volume BSP tree of the occluders.
#[derive(Clone, Debug)]
pub struct Svbsp {
    /// Memory of a build by single planes; `None` for the other form.
    sorted_planes: Option<SortedPlanes>,
    node_budget: usize,
    point_budget: usize,
    tree: ShadowTree,
    points: Vec<DVec3>,
    order: Vec<(f64, u32)>,
    tasks: Vec<Task>,
    counts: BuildCounts,
}

impl Svbsp {
    /// A culler without occluders, for at most `node_budget` splitting planes. Allocates all its memory.
    pub fn new(form: SvbspForm, node_budget: usize) -> Self {
        let point_budget = node_budget * 16;
        Self {
            sorted_planes: (form == SvbspForm::Planes).then(|| SortedPlanes::new(node_budget)),
            node_budget,
            point_budget,
            tree: ShadowTree::new(node_budget, node_budget, CapRule::Any),
            points: Vec::with_capacity(point_budget),
            order: Vec::new(),
            tasks: Vec::new(),
            counts: BuildCounts::default(),
        }
    }

    fn insert_all(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) {
        self.order.clear();
        self.order.extend(occluders.iter().enumerate().map(|(i, o)| {
            let nearest = o.corners().iter().map(|v| v.length_squared()).fold(f64::INFINITY, f64::min);
            (nearest, i as u32)
        }));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for i in 0..self.order.len() {
            self.insert(&occluders[self.order[i].1 as usize], window);
        }
    }

    fn insert(&mut self, occluder: &ShadowVolume, window: &ViewWindow) {
        // Each insertion begins with empty lists, because it needs no data of other insertions.
        self.points.clear();
        self.points.extend_from_slice(window.corners());
        self.points.extend(occluder.corners().iter().map(|v| v.normalize_or_zero()));
        let outline = Span { start: 4, len: occluder.corners().len() as u32 };
        let cell = Span { start: 0, len: 4 };
        self.tasks.push(Task { link: Link::Top, at: self.tree.top(), depth: 1, cell, outline });
        while let Some(task) = self.tasks.pop() {
            self.counts.pieces += 1;
            match task.at.read() {
                Ok(node) => self.descend(task, node),
                Err(Caps::NONE) => self.raise(task, occluder),
                Err(_) => {}
            }
        }
    }

    fn descend(&mut self, task: Task, i: u32) {
        let node = *self.tree.node(i);
        let (low, high) = reach(node.normal, &self.points[task.outline.range()]);
        for (child, side, normal, reaches) in [
            (node.front, Side::Front, node.normal, high > RELEVANT_SINE),
            (node.back, Side::Back, -node.normal, low < -RELEVANT_SINE),
        ] {
            if !reaches {
                continue;
            }
            if self.points.len() + task.cell.len as usize + task.outline.len as usize + 4 > self.point_budget
            {
                self.counts.left_out += 1;
                continue;
            }
            let cell = clip(&mut self.points, task.cell, normal);
            let outline = clip(&mut self.points, task.outline, normal);
            if cell.len >= 3 && has_area(&self.points[outline.range()], RELEVANT_AREA_SR) {
                let link = Link::Below(i, side);
                self.tasks.push(Task { link, at: child, depth: task.depth + 1, cell, outline });
            }
        }
    }

    /// Replaces an unoccluded leaf by the planes of an occluder that reaches the leaf's cell.
    fn raise(&mut self, mut task: Task, occluder: &ShadowVolume) {
        for &normal in occluder.sides() {
            let (low, high) = reach(normal, &self.points[task.cell.range()]);
            if low >= -IMPLIED_SINE {
                continue;
            }
            let room = self.points.len() + task.cell.len as usize + 2 <= self.point_budget;
            if !room || self.tree.node_count() >= self.node_budget || task.depth >= MAX_DEPTH {
                self.counts.left_out += 1;
                return;
            }
            let front = clip(&mut self.points, task.cell, normal);
            if high <= IMPLIED_SINE || front.len < 3 {
                return;
            }
            let node = self.tree.push(task.link, normal, task.depth);
            task.depth += 1;
            task.link = Link::Below(node, Side::Front);
            task.cell = front;
        }
        if !self.tree.is_full_of_caps() {
            let caps = self.tree.add_cap(Caps::NONE, occluder);
            self.tree.set(task.link, Child::leaf(caps));
        }
    }
}

impl OcclusionCuller for Svbsp {
    fn name(&self) -> &'static str {
        if self.sorted_planes.is_some() { "svbsp-paper" } else { "svbsp" }
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.tree.clear(window.eye_in_world());
        self.counts = BuildCounts { occluders: occluders.len() as u32, ..BuildCounts::default() };
        if let Some(planes) = &mut self.sorted_planes {
            let (pieces, left_out) = planes.build(&mut self.tree, window, occluders);
            self.counts = BuildCounts { pieces, left_out, ..self.counts };
        } else {
            self.insert_all(window, occluders);
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
