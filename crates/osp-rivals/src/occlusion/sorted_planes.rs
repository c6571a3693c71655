//! A BSP tree of shadow planes: a good plane divides a cell, and the other planes are sorted to its front and its back.
//!
//! "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", section 3.2.3.
//!
//! # Where the text is silent
//! * The best plane cuts the fewest other planes. Among equals, the numbers of planes in front and behind differ least.
//!   The first [`CANDIDATES`] planes of a cell are compared; the planes of the best occluder come first.
//! * A plane is sorted by its edge. If the splitting plane cuts the edge, each side gets a part. Planes in the
//!   splitting plane are dropped.
//! * The last plane of a cell hides the part in front of it, beyond the cap of its occluder; the part behind it is
//!   unoccluded. So a plane of an occluder in the shadow of another occluder makes a part of that shadow unoccluded.
//!   The paper states this error, and removes it by rule 4 of its modified tree.
//! * A hidden cell has to lie in the cone of its occluder. If rounding errors prevent this, the cell is unoccluded.

use glam::DVec3;

use osp::{
    occlusion::{
        ShadowVolume,
        kernels::{
            Caps, Child, IMPLIED_SINE, Link, MAX_DEPTH, RELEVANT_SINE, ShadowTree, Side, Span, clip, reach,
        },
    },
    view::ViewWindow,
};

/// Number of planes of a cell that are compared. With more planes, builds take longer and cut fewer planes.
const CANDIDATES: usize = 16;

/// A shadow plane, and the part of its edge that lies in the cell.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    ends: [DVec3; 2],
    occluder: u32,
}

/// The position of an edge relative to a splitting plane.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Before,
    Behind,
    Cut,
    Within,
}

impl Plane {
    fn place(&self, splitter: DVec3) -> Place {
        let (low, high) = reach(splitter, &self.ends);
        match (high > RELEVANT_SINE, low < -RELEVANT_SINE) {
            (true, true) => Place::Cut,
            (true, false) => Place::Before,
            (false, true) => Place::Behind,
            (false, false) => Place::Within,
        }
    }

    /// The part of a cut edge on one side of a splitting plane.
    fn part(mut self, splitter: DVec3, side: Side) -> Self {
        let [a, b] = self.ends.map(|end| splitter.dot(end));
        let crossing = self.ends[0].lerp(self.ends[1], a / (a - b)).normalize_or_zero();
        let is_first_kept = (a > b) == (side == Side::Front);
        self.ends[usize::from(is_first_kept)] = crossing;
        self
    }
}

/// A cell that is not divided yet.
#[derive(Clone, Copy, Debug)]
struct Task {
    link: Link,
    depth: u32,
    cell: Span,
    planes: Span,
}

/// Memory of a build, which is reused from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct SortedPlanes {
    node_budget: usize,
    /// Largest length of the list of points and of the list of planes.
    list_budget: usize,
    points: Vec<DVec3>,
    planes: Vec<Plane>,
    tasks: Vec<Task>,
    left_out: u32,
}

impl SortedPlanes {
    /// Allocates the memory for a tree of `node_budget` splitting planes.
    pub(super) fn new(node_budget: usize) -> Self {
        let list_budget = node_budget * 16;
        Self {
            node_budget,
            list_budget,
            points: Vec::with_capacity(list_budget),
            planes: Vec::with_capacity(list_budget),
            // Dividing a cell adds at most one task.
            tasks: Vec::with_capacity(MAX_DEPTH as usize + 1),
            left_out: 0,
        }
    }

    /// Fills an empty tree. Returns the number of planes and their parts, and the number of those that exceed the
    /// memory.
    pub(super) fn build(
        &mut self,
        tree: &mut ShadowTree,
        window: &ViewWindow,
        occluders: &[ShadowVolume],
    ) -> (u32, u32) {
        self.points.clear();
        self.points.extend_from_slice(window.corners());
        self.planes.clear();
        self.left_out = 0;
        for (i, occluder) in occluders.iter().enumerate() {
            let corners = occluder.corners();
            if self.planes.len() + corners.len() > self.list_budget {
                self.left_out += 1;
                continue;
            }
            for (k, &normal) in occluder.sides().iter().enumerate() {
                let ends = [corners[k], corners[(k + 1) % corners.len()]].map(DVec3::normalize_or_zero);
                self.planes.push(Plane { normal, ends, occluder: i as u32 });
            }
        }
        let planes = Span { start: 0, len: self.planes.len() as u32 };
        if planes.len > 0 {
            self.tasks.push(Task { link: Link::Top, depth: 1, cell: Span { start: 0, len: 4 }, planes });
        }
        while let Some(task) = self.tasks.pop() {
            self.divide(tree, task, occluders);
        }
        (self.planes.len() as u32, self.left_out)
    }

    /// Whether the lists have room for both halves of a cell.
    fn has_room(&self, tree: &ShadowTree, task: Task) -> bool {
        tree.node_count() < self.node_budget
            && task.depth < MAX_DEPTH
            && self.points.len() + 2 * (task.cell.len as usize + 2) <= self.list_budget
            && self.planes.len() + 2 * task.planes.len as usize <= self.list_budget
    }

    fn divide(&mut self, tree: &mut ShadowTree, task: Task, occluders: &[ShadowVolume]) {
        if !self.has_room(tree, task) {
            self.left_out += task.planes.len;
            return;
        }
        let at = self.good_plane(task.planes);
        let Plane { normal, occluder, .. } = self.planes[at];
        let node = tree.push(task.link, normal, task.depth);
        for side in [Side::Front, Side::Back] {
            let facing = if side == Side::Front { normal } else { -normal };
            let cell = clip(&mut self.points, task.cell, facing);
            if cell.len < 3 {
                continue;
            }
            let planes = self.sort(task.planes, at, side);
            let link = Link::Below(node, side);
            if planes.len > 0 {
                self.tasks.push(Task { link, depth: task.depth + 1, cell, planes });
            } else if side == Side::Front {
                let occluder = &occluders[occluder as usize];
                let corners = &self.points[cell.range()];
                let is_inside = occluder.sides().iter().all(|&side| reach(side, corners).0 >= -IMPLIED_SINE);
                if is_inside && !tree.is_full_of_caps() {
                    let caps = tree.add_cap(Caps::NONE, occluder);
                    tree.set(link, Child::leaf(caps));
                }
            }
        }
    }

    fn good_plane(&self, planes: Span) -> usize {
        let cost = |at: &usize| {
            let normal = self.planes[*at].normal;
            let (mut cut, mut before, mut behind) = (0_u32, 0_u32, 0_u32);
            for plane in &self.planes[planes.range()] {
                match plane.place(normal) {
                    Place::Before => before += 1,
                    Place::Behind => behind += 1,
                    Place::Cut => cut += 1,
                    Place::Within => {}
                }
            }
            (cut, before.abs_diff(behind))
        };
        planes.range().take(CANDIDATES).min_by_key(cost).unwrap_or(planes.start as usize)
    }

    /// Appends the planes, or their parts, that lie on one side of plane number `at`.
    fn sort(&mut self, planes: Span, at: usize, side: Side) -> Span {
        let start = self.planes.len();
        let splitter = self.planes[at].normal;
        for i in planes.range().filter(|&i| i != at) {
            let plane = self.planes[i];
            match (plane.place(splitter), side) {
                (Place::Before, Side::Front) | (Place::Behind, Side::Back) => self.planes.push(plane),
                (Place::Cut, side) => self.planes.push(plane.part(splitter, side)),
                _ => {}
            }
        }
        Span { start: start as u32, len: (self.planes.len() - start) as u32 }
    }
}
