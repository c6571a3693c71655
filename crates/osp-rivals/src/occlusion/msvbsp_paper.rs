//! The paper's MSVBSP tree, rules 1 to 6 as printed. It culls visible polygons; [`osp::occlusion::msvbsp`] is the
//! conservative form.
//!
//! "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", section 3.2.4.
//!
//! # Where the text is silent
//! * Planes are compared by their edges; an edge on the splitting plane counts as in front of it.
//! * Rule 5: two planes are the same only if the ends of their edges are equal, bit for bit.
//! * A group of occluders that rule 5 unites hides volumes beyond the caps of all its members, if caps are used at all.
//!   A cap is the plane that ends a shadow volume at its occluder.
//! * If the budget is used up, cells that are not divided yet are unoccluded.

use glam::DVec3;

use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, Cell, Needed, OcclusionCuller, ShadowVolume, Soundness, Tested, TestedBoxes,
        kernels::{CapRule, Caps, Child, Link, MAX_DEPTH, ShadowTree, Side, Span},
    },
    view::ViewWindow,
};

/// The end of an edge counts as behind a splitting plane if the sine of its angle to the plane exceeds this value. A
/// larger value sorts neighbours that share a corner more cleanly, and loses more planes.
const BEHIND_SINE: f64 = 1.0e-9;

/// Treatment of volumes between the eye and an occluder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperCaps {
    /// They count as hidden, because the paper does not mention caps.
    None,
    /// They do not count as hidden: the occluder's own plane closes the shadow.
    Supporting,
}

/// A shadow plane with its edge, which determines how the paper sorts the plane.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    ends: [DVec3; 2],
    occluder: u32,
    deleted: bool,
}

#[derive(Clone, Copy, Debug)]
struct Task {
    link: Link,
    depth: u32,
    planes: Span,
    /// The group whose planes come first in the cell (rule 3).
    group: u32,
}

/// The MSVBSP tree as the paper prints it. It culls visible polygons; [`osp::occlusion::msvbsp::Msvbsp`] is the conservative form.
#[derive(Clone, Debug)]
pub struct MsvbspPaper {
    caps: PaperCaps,
    node_budget: usize,
    list_budget: usize,
    tree: ShadowTree,
    planes: Vec<Plane>,
    /// For each occluder, the number of its group, which is the number of the group's best member.
    group: Vec<u32>,
    caps_of_group: Vec<Caps>,
    lists: Vec<u32>,
    tasks: Vec<Task>,
    left_out: u32,
}

impl MsvbspPaper {
    /// A culler without occluders, for at most `node_budget` splitting planes.
    pub fn new(caps: PaperCaps, node_budget: usize) -> Self {
        let rule = match caps {
            PaperCaps::None => CapRule::Ignore,
            PaperCaps::Supporting => CapRule::All,
        };
        let list_budget = node_budget * 64;
        Self {
            caps,
            node_budget,
            list_budget,
            tree: ShadowTree::new(node_budget, node_budget, rule),
            planes: Vec::new(),
            group: Vec::new(),
            caps_of_group: Vec::new(),
            lists: Vec::with_capacity(list_budget),
            tasks: Vec::new(),
            left_out: 0,
        }
    }

    /// The tree of the last build.
    pub fn tree(&self) -> &ShadowTree {
        &self.tree
    }

    fn group_of(&self, mut occluder: u32) -> u32 {
        while self.group[occluder as usize] != occluder {
            occluder = self.group[occluder as usize];
        }
        occluder
    }

    /// Applies rules 5 and 6: deletes planes that two occluders share.
    fn delete_shared_planes(&mut self) {
        for i in 0..self.planes.len() {
            for j in i + 1..self.planes.len() {
                let (a, b) = (self.planes[i], self.planes[j]);
                // The loop tests every pair, so the cheap tests come first.
                if a.normal.dot(b.normal) > -0.999_999 || a.occluder == b.occluder || a.deleted || b.deleted {
                    continue;
                }
                if a.ends[0] == b.ends[1] && a.ends[1] == b.ends[0] {
                    self.planes[i].deleted = true;
                    self.planes[j].deleted = true;
                    let (g, h) = (self.group_of(a.occluder), self.group_of(b.occluder));
                    self.group[g.max(h) as usize] = g.min(h);
                } else if overlap_in_one_plane(&a, &b) {
                    // The best occluder comes first, so the later occluder is worse.
                    self.planes[j].deleted = true;
                }
            }
        }
        for occluder in 0..self.group.len() as u32 {
            self.group[occluder as usize] = self.group_of(occluder);
        }
    }

    fn caps_of_groups(&mut self, occluders: &[ShadowVolume]) {
        self.caps_of_group.clear();
        self.caps_of_group.resize(occluders.len(), Caps::NONE);
        for (i, occluder) in occluders.iter().enumerate() {
            let group = self.group[i] as usize;
            self.caps_of_group[group] = self.tree.add_cap(self.caps_of_group[group], occluder);
        }
    }

    fn group_of_plane(&self, plane: u32) -> u32 {
        self.group[self.planes[plane as usize].occluder as usize]
    }

    fn build_node(&mut self, task: Task) {
        let range = task.planes.range();
        let first = self.lists[range.clone()].iter().position(|&p| self.group_of_plane(p) == task.group);
        let splitter = self.lists[range.start + first.unwrap_or(0)];
        let Plane { normal, .. } = self.planes[splitter as usize];
        let group = self.group_of_plane(splitter);
        let room = self.lists.len() + 2 * range.len() <= self.list_budget;
        if !room || self.tree.node_count() >= self.node_budget || task.depth > MAX_DEPTH {
            self.left_out += range.len() as u32;
            return;
        }
        let node = self.tree.push(task.link, normal, task.depth);
        // Rule 2: a plane goes to the side, or to both sides, on which its edge has an end. Nothing is cut.
        let mut sort = |side: Side| {
            let start = self.lists.len();
            for i in range.clone() {
                let plane = &self.planes[self.lists[i] as usize];
                let behind = |p: &DVec3| normal.dot(*p) < -BEHIND_SINE * p.length();
                let before = |p: &DVec3| normal.dot(*p) > BEHIND_SINE * p.length();
                let belongs = match side {
                    Side::Front => plane.ends.iter().any(before) || !plane.ends.iter().any(behind),
                    Side::Back => plane.ends.iter().any(behind),
                };
                if belongs && self.lists[i] != splitter {
                    self.lists.push(self.lists[i]);
                }
            }
            Span { start: start as u32, len: (self.lists.len() - start) as u32 }
        };
        let front = sort(Side::Front);
        let back = sort(Side::Back);
        let depth = task.depth + 1;
        if front.range().any(|i| self.group_of_plane(self.lists[i]) == group) {
            self.tasks.push(Task { link: Link::Below(node, Side::Front), depth, planes: front, group });
        } else {
            // Rule 4: no plane of this group is left, so all other occluders that reach this cell lie in its shadow.
            let caps = self.caps_of_group[group as usize];
            self.tree.set(Link::Below(node, Side::Front), Child::leaf(caps));
        }
        if back.len > 0 {
            self.tasks.push(Task { link: Link::Below(node, Side::Back), depth, planes: back, group });
        }
    }
}

/// Whether two shadow planes with opposite normals are one plane and their edges overlap by more than a point (rule 6).
fn overlap_in_one_plane(a: &Plane, b: &Plane) -> bool {
    let in_plane = b.ends.iter().all(|p| a.normal.dot(*p).abs() <= BEHIND_SINE * p.length());
    if !in_plane {
        return false;
    }
    let u = a.ends[0].normalize_or_zero();
    let w = a.normal.cross(u);
    let angle = |p: DVec3| libm::atan2(w.dot(p), u.dot(p));
    let (a1, b0, b1) = (angle(a.ends[1]), angle(b.ends[0]), angle(b.ends[1]));
    let (low, high) = (0.0f64.min(a1).max(b0.min(b1)), 0.0f64.max(a1).min(b0.max(b1)));
    high - low > BEHIND_SINE
}

impl OcclusionCuller for MsvbspPaper {
    fn name(&self) -> &'static str {
        match self.caps {
            PaperCaps::None => "msvbsp-paper-capless",
            PaperCaps::Supporting => "msvbsp-paper",
        }
    }

    fn soundness(&self) -> Soundness {
        match self.caps {
            PaperCaps::None => Soundness::Unsound("rules 2, 5 and 6, and no caps"),
            PaperCaps::Supporting => Soundness::Unsound("rules 2, 5 and 6"),
        }
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.tree.clear(window.eye_in_world());
        self.planes.clear();
        self.group.clear();
        self.lists.clear();
        self.tasks.clear();
        self.left_out = 0;
        // The memory must suffice for one cap of each occluder.
        let fitting = occluders.len().min(self.node_budget);
        self.left_out += (occluders.len() - fitting) as u32;
        let occluders = &occluders[..fitting];
        self.group.extend(0..fitting as u32);
        for (i, occluder) in occluders.iter().enumerate() {
            let corners = occluder.corners();
            for (k, &normal) in occluder.sides().iter().enumerate() {
                let ends = [corners[k], corners[(k + 1) % corners.len()]];
                self.planes.push(Plane { normal, ends, occluder: i as u32, deleted: false });
            }
        }
        self.delete_shared_planes();
        self.caps_of_groups(occluders);
        // Rule 1: the best group comes first; a group is as good as its best member. Planes of a group are sorted by score.
        self.lists.extend((0..self.planes.len() as u32).filter(|&p| !self.planes[p as usize].deleted));
        let mut lists = std::mem::take(&mut self.lists);
        lists.sort_unstable_by_key(|&p| (self.group_of_plane(p), p));
        self.lists = lists;
        let planes = Span { start: 0, len: self.lists.len() as u32 };
        if planes.len > 0 && self.lists.len() <= self.list_budget {
            self.tasks.push(Task { link: Link::Top, depth: 1, planes, group: u32::MAX });
        }
        while let Some(task) = self.tasks.pop() {
            self.build_node(task);
        }
        BuildCounts {
            occluders: occluders.len() as u32,
            nodes: self.tree.node_count() as u32,
            depth: self.tree.depth(),
            pieces: self.lists.len() as u32,
            left_out: self.left_out,
        }
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
