use std::cmp::Ordering;

use crate::flat_tree::{area, joined_area};
use osp::{index::Upkeep, math::Aabb, polygon::PolygonId};

/// The number that stands for no node.
pub(crate) const NONE: u32 = u32::MAX;

/// Largest difference of two siblings' heights. A smaller difference makes lower trees, but pushes a distant single
/// polygon down into the subtree of many others. 32 hardly limits the choice by surface area, and bounds the depth by
/// about nine times the ideal.
const MAX_HEIGHT_DIFFERENCE: u32 = 32;

/// The values of a node that a query's test and an insertion need.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeNode {
    pub(super) bounds: Aabb,
    /// [`NONE`] at the top; in a free node, the next free node.
    pub(super) parent: u32,
    /// Height of the subtree; 0 in a leaf.
    pub(super) height: u32,
    /// Number of polygons in the node and below; 0 in a free node.
    pub(super) polygons: u32,
}

/// The children of a node, stored separately from its box. So a query that reports a whole subtree reads only eight
/// bytes for each node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Links {
    first: u32,
    /// The second child; [`NONE`] in a leaf, whose `first` is its polygon.
    second: u32,
}

/// The contents of a node, decoded from [`Links`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Below {
    Leaf(PolygonId),
    Inner([u32; 2]),
}

impl Links {
    fn leaf(id: PolygonId) -> Self {
        Self { first: id.0, second: NONE }
    }

    fn inner([first, second]: [u32; 2]) -> Self {
        Self { first, second }
    }

    #[inline]
    pub(super) fn below(self) -> Below {
        if self.second == NONE {
            Below::Leaf(PolygonId(self.first))
        } else {
            Below::Inner([self.first, self.second])
        }
    }
}

/// The tree; see [the module](super). An inner node has two children, a leaf one polygon.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    pub(super) nodes: Vec<TreeNode>,
    pub(super) links: Vec<Links>,
    pub(super) root: u32,
    pub(super) first_free: u32,
    upkeep: Upkeep,
}

impl BoxTree {
    pub(crate) fn with_capacity(polygons: usize) -> Self {
        Self {
            nodes: Vec::with_capacity(2 * polygons),
            links: Vec::with_capacity(2 * polygons),
            root: NONE,
            first_free: NONE,
            upkeep: Upkeep::default(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        if self.root == NONE { 0 } else { self.nodes[self.root as usize].polygons as usize }
    }

    pub(crate) fn clear(&mut self) {
        self.nodes.clear();
        self.links.clear();
        (self.root, self.first_free) = (NONE, NONE);
    }

    pub(crate) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<TreeNode>() + self.links.capacity() * size_of::<Links>()
    }

    /// Counts of the work of all insertions and removals.
    pub(crate) fn upkeep(&self) -> Upkeep {
        self.upkeep
    }

    #[inline]
    pub(super) fn node(&self, at: u32) -> &TreeNode {
        &self.nodes[at as usize]
    }

    fn node_mut(&mut self, at: u32) -> &mut TreeNode {
        &mut self.nodes[at as usize]
    }

    #[inline]
    pub(super) fn below(&self, at: u32) -> Below {
        self.links[at as usize].below()
    }

    /// The children of an inner node.
    fn children(&self, at: u32) -> [u32; 2] {
        let Links { first, second } = self.links[at as usize];
        [first, second]
    }

    fn take_node(&mut self, node: TreeNode, links: Links) -> u32 {
        if self.first_free == NONE {
            self.nodes.push(node);
            self.links.push(links);
            return self.nodes.len() as u32 - 1;
        }
        let at = self.first_free;
        self.first_free = self.node(at).parent;
        *self.node_mut(at) = node;
        self.links[at as usize] = links;
        at
    }

    fn give_node(&mut self, at: u32) {
        let next = self.first_free;
        let node = self.node_mut(at);
        (node.polygons, node.height, node.parent) = (0, 0, next);
        self.first_free = at;
    }

    pub(crate) fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> u32 {
        self.upkeep.inserted += 1;
        let leaf = TreeNode { bounds: *bounds, parent: NONE, height: 0, polygons: 1 };
        let leaf = self.take_node(leaf, Links::leaf(id));
        if self.root == NONE {
            self.root = leaf;
            return leaf;
        }
        let sibling = self.find_best_sibling(bounds);
        let above = self.node(sibling).parent;
        let joined = TreeNode {
            bounds: self.node(sibling).bounds.union(bounds),
            parent: above,
            height: self.node(sibling).height + 1,
            polygons: self.node(sibling).polygons + 1,
        };
        let joined = self.take_node(joined, Links::inner([sibling, leaf]));
        self.replace_child(above, sibling, joined);
        self.node_mut(sibling).parent = joined;
        self.node_mut(leaf).parent = joined;
        self.repair_upwards(above);
        leaf
    }

    /// Removes a leaf. Its sibling replaces their parent.
    pub(crate) fn remove(&mut self, leaf: u32) {
        let parent = self.node(leaf).parent;
        self.give_node(leaf);
        if parent == NONE {
            self.root = NONE;
            return;
        }
        let [a, b] = self.children(parent);
        let sibling = if a == leaf { b } else { a };
        let above = self.node(parent).parent;
        self.replace_child(above, parent, sibling);
        self.node_mut(sibling).parent = above;
        self.give_node(parent);
        self.repair_upwards(above);
    }

    /// Makes `new` the child of `parent` (or the root) in place of `old`.
    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        if parent == NONE {
            self.root = new;
        } else {
            let links = &mut self.links[parent as usize];
            *(if links.first == old { &mut links.first } else { &mut links.second }) = new;
        }
    }

    /// Finds the sibling for a new box that adds the least surface to the tree.
    ///
    /// Each visited node adds the growth of its box to the cost of every sibling below it ("inherited" cost). A subtree
    /// is skipped if even the best possible leaf below, equal to the new box, would not beat the best node so far.
    fn find_best_sibling(&self, bounds: &Aabb) -> u32 {
        let own_area = area(bounds);
        let mut at = self.root;
        let mut direct = joined_area(&self.node(at).bounds, bounds);
        let mut at_area = area(&self.node(at).bounds);
        let mut inherited = 0.0;
        let (mut best, mut best_cost) = (at, direct);
        while let Below::Inner(children) = self.below(at) {
            let cost = inherited + direct;
            if cost <= best_cost {
                (best, best_cost) = (at, cost);
            }
            inherited += direct - at_area;
            let a = self.candidate(children[0], bounds, inherited, own_area);
            let b = self.candidate(children[1], bounds, inherited, own_area);
            for candidate in [&a, &b] {
                if candidate.is_leaf && inherited + candidate.direct <= best_cost {
                    (best, best_cost) = (candidate.child, inherited + candidate.direct);
                }
            }
            let next = match a.least_below.total_cmp(&b.least_below) {
                Ordering::Less => a,
                Ordering::Greater => b,
                Ordering::Equal if self.is_nearer(&b, &a, bounds) => b,
                // If both are leaves, the next test ends the loop.
                Ordering::Equal => a,
            };
            if next.least_below > best_cost || next.is_leaf {
                break;
            }
            (at, direct, at_area) = (next.child, next.direct, next.area);
        }
        best
    }

    #[inline]
    fn candidate(&self, child: u32, bounds: &Aabb, inherited: f64, own_area: f64) -> Candidate {
        let node = self.node(child);
        let (direct, area) = (joined_area(&node.bounds, bounds), joined_area(&node.bounds, &node.bounds));
        let is_leaf = node.height == 0;
        let least_below =
            if is_leaf { f64::INFINITY } else { inherited + direct + (own_area - area).min(0.0) };
        Candidate { child, is_leaf, direct, area, least_below }
    }

    /// Whether `candidate` is better than `other`, which has the same cost: its centre is nearer, or its subtree is
    /// lower.
    fn is_nearer(&self, candidate: &Candidate, other: &Candidate, bounds: &Aabb) -> bool {
        let distance = |candidate: &Candidate| {
            let node = self.node(candidate.child);
            // Both centres are halved, because distances between huge boxes overflow.
            ((node.bounds.center() * 0.5 - bounds.center() * 0.5).length_squared(), node.height)
        };
        distance(candidate) < distance(other)
    }

    /// Updates boxes, heights and counts from `at` to the top, and improves these nodes by rotations.
    fn repair_upwards(&mut self, mut at: u32) {
        while at != NONE {
            self.gather(at);
            let top = self.limit_height(at);
            if top == at {
                self.rotate(at);
            }
            at = self.node(top).parent;
        }
    }

    /// Computes the box, height and count of an inner node from its children.
    fn gather(&mut self, at: u32) {
        self.upkeep.boxes += 1;
        let [a, b] = self.children(at);
        let (a, b) = (*self.node(a), *self.node(b));
        let node = self.node_mut(at);
        node.bounds = a.bounds.union(&b.bounds);
        node.height = a.height.max(b.height) + 1;
        node.polygons = a.polygons + b.polygons;
    }

    fn height_difference(&self, a: u32, b: u32) -> u32 {
        self.node(a).height.abs_diff(self.node(b).height)
    }

    /// Rotates the taller child up if the heights differ too much (as in G. Adelson-Velsky and E. Landis, 1962). Returns
    /// the node that has taken the position of `at`.
    fn limit_height(&mut self, at: u32) -> u32 {
        let [a, b] = self.children(at);
        if self.height_difference(a, b) <= MAX_HEIGHT_DIFFERENCE {
            return at;
        }
        let tall = if self.node(a).height > self.node(b).height { a } else { b };
        let [c, d] = self.children(tall);
        let (stays, moves) = if self.node(c).height >= self.node(d).height { (c, d) } else { (d, c) };
        let above = self.node(at).parent;
        self.replace_child(above, at, tall);
        self.node_mut(tall).parent = above;
        self.links[tall as usize] = Links::inner([stays, at]);
        self.node_mut(at).parent = tall;
        self.replace_child(at, tall, moves);
        self.node_mut(moves).parent = at;
        self.gather(at);
        self.gather(tall);
        tall
    }

    /// Exchanges a child with a child of the other child, if that makes a box smaller. Selects the exchange that
    /// shrinks a box most. The box of `at` itself stays the same.
    fn rotate(&mut self, at: u32) {
        let children = self.children(at);
        let mut best: Option<(f64, u32, u32)> = None;
        for side in 0..2 {
            let (lower, upper) = (children[side], children[1 - side]);
            let Below::Inner(below) = self.below(upper) else { continue };
            let now = area(&self.node(upper).bounds);
            for i in 0..2 {
                let (goes_up, stays) = (below[i], below[1 - i]);
                let gain = now - joined_area(&self.node(lower).bounds, &self.node(stays).bounds);
                if gain > best.map_or(0.0, |(most, ..)| most) {
                    let joined_height = self.node(lower).height.max(self.node(stays).height) + 1;
                    let keeps_limit = self.height_difference(lower, stays) <= MAX_HEIGHT_DIFFERENCE
                        && self.node(goes_up).height.abs_diff(joined_height) <= MAX_HEIGHT_DIFFERENCE;
                    if keeps_limit {
                        best = Some((gain, lower, goes_up));
                    }
                }
            }
        }
        if let Some((_, lower, goes_up)) = best {
            let upper = self.node(goes_up).parent;
            self.replace_child(upper, goes_up, lower);
            self.replace_child(at, lower, goes_up);
            (self.node_mut(lower).parent, self.node_mut(goes_up).parent) = (upper, at);
            self.gather(upper);
            self.gather(at);
        }
    }
}

/// A child to which the descent may continue, and bounds of its cost.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    child: u32,
    is_leaf: bool,
    /// Surface of the child's box joined with the new box.
    direct: f64,
    /// Surface of the child's box.
    area: f64,
    /// Lower bound of the cost of all nodes below.
    least_below: f64,
}
