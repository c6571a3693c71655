use crate::{index::flat_tree::area, math::Aabb, scene::PolygonId};

/// No node.
pub(in crate::index) const NONE: u32 = u32::MAX;

/// How much taller one of two siblings may be. Smaller: a lower tree, but a lone polygon beside a crowd is pushed down
/// into it; 32 leaves alone what surfaces ask for and still bounds the depth by about nine times the ideal.
const MAX_HEIGHT_DIFFERENCE: u32 = 32;

/// An inner node has two children, a leaf one polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeNode {
    pub(super) bounds: Aabb,
    /// [`NONE`] at the top; the next free node in a free one.
    pub(super) parent: u32,
    /// [`NONE`] twice in a leaf.
    pub(super) children: [u32; 2],
    /// 0 in a leaf.
    pub(super) height: u32,
    /// Polygons here and below; 0 in a free node.
    pub(super) polygons: u32,
    /// Of a leaf.
    pub(super) id: PolygonId,
}

impl TreeNode {
    pub(super) fn is_leaf(&self) -> bool {
        self.height == 0
    }
}

/// The tree. See [the module](super).
#[derive(Clone, Debug)]
pub(in crate::index) struct BoxTree {
    pub(super) nodes: Vec<TreeNode>,
    pub(super) root: u32,
    pub(super) first_free: u32,
}

impl BoxTree {
    pub(in crate::index) fn with_capacity(polygons: usize) -> Self {
        Self { nodes: Vec::with_capacity(2 * polygons), root: NONE, first_free: NONE }
    }

    pub(in crate::index) fn len(&self) -> usize {
        if self.root == NONE { 0 } else { self.nodes[self.root as usize].polygons as usize }
    }

    pub(in crate::index) fn clear(&mut self) {
        self.nodes.clear();
        (self.root, self.first_free) = (NONE, NONE);
    }

    pub(in crate::index) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<TreeNode>()
    }

    /// Every leaf: its number, polygon and box.
    pub(in crate::index) fn leaves(&self) -> impl Iterator<Item = (u32, PolygonId, &Aabb)> {
        let used = self.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf() && node.polygons > 0);
        used.map(|(at, node)| (at as u32, node.id, &node.bounds))
    }

    pub(super) fn node(&self, at: u32) -> &TreeNode {
        &self.nodes[at as usize]
    }

    fn node_mut(&mut self, at: u32) -> &mut TreeNode {
        &mut self.nodes[at as usize]
    }

    fn take_node(&mut self, node: TreeNode) -> u32 {
        if self.first_free == NONE {
            self.nodes.push(node);
            return self.nodes.len() as u32 - 1;
        }
        let at = self.first_free;
        self.first_free = self.node(at).parent;
        *self.node_mut(at) = node;
        at
    }

    fn give_node(&mut self, at: u32) {
        let next = self.first_free;
        let node = self.node_mut(at);
        (node.polygons, node.height, node.parent, node.children) = (0, 0, next, [NONE; 2]);
        self.first_free = at;
    }

    /// Adds a polygon and returns its leaf.
    pub(in crate::index) fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> u32 {
        let leaf =
            TreeNode { bounds: *bounds, parent: NONE, children: [NONE; 2], height: 0, polygons: 1, id };
        let leaf = self.take_node(leaf);
        if self.root == NONE {
            self.root = leaf;
            return leaf;
        }
        let sibling = self.find_best_sibling(bounds);
        let above = self.node(sibling).parent;
        let joined = TreeNode {
            bounds: self.node(sibling).bounds.union(bounds),
            parent: above,
            children: [sibling, leaf],
            height: self.node(sibling).height + 1,
            polygons: self.node(sibling).polygons + 1,
            id,
        };
        let joined = self.take_node(joined);
        self.replace_child(above, sibling, joined);
        self.node_mut(sibling).parent = joined;
        self.node_mut(leaf).parent = joined;
        self.repair_upwards(above);
        leaf
    }

    /// Takes a leaf out; its sibling takes the place of their parent.
    pub(in crate::index) fn remove(&mut self, leaf: u32) {
        let parent = self.node(leaf).parent;
        self.give_node(leaf);
        if parent == NONE {
            self.root = NONE;
            return;
        }
        let [a, b] = self.node(parent).children;
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
            let children = &mut self.node_mut(parent).children;
            let side = usize::from(children[1] == old);
            children[side] = new;
        }
    }

    /// The node whose pairing with the new box adds the least surface to the tree.
    ///
    /// Going down from a node costs what its box grows by, whatever is found below ("inherited"). A subtree is left out
    /// when even a leaf right at the new box, the best that could be below, would not beat the best so far.
    fn find_best_sibling(&self, bounds: &Aabb) -> u32 {
        let own_area = area(bounds);
        let center = bounds.center();
        let mut at = self.root;
        let mut direct = area(&self.node(at).bounds.union(bounds));
        let mut inherited = 0.0;
        let (mut best, mut best_cost) = (at, direct);
        while !self.node(at).is_leaf() {
            let cost = inherited + direct;
            if cost <= best_cost {
                (best, best_cost) = (at, cost);
            }
            inherited += direct - area(&self.node(at).bounds);
            let options = self.node(at).children.map(|child| {
                let node = self.node(child);
                let direct = area(&node.bounds.union(bounds));
                let least_below = if node.is_leaf() {
                    f64::INFINITY
                } else {
                    inherited + direct + (own_area - area(&node.bounds)).min(0.0)
                };
                Way { child, direct, least_below }
            });
            for option in options.iter().filter(|option| self.node(option.child).is_leaf()) {
                if inherited + option.direct <= best_cost {
                    (best, best_cost) = (option.child, inherited + option.direct);
                }
            }
            let distance = |option: &Way| {
                let node = self.node(option.child);
                let apart = (node.bounds.center() * 0.5 - center * 0.5).length_squared();
                (apart, node.height)
            };
            let [a, b] = &options;
            let next = match a.least_below.total_cmp(&b.least_below) {
                std::cmp::Ordering::Less => a,
                std::cmp::Ordering::Greater => b,
                // Also if both are leaves: then the next test ends it.
                std::cmp::Ordering::Equal if distance(b) < distance(a) => b,
                std::cmp::Ordering::Equal => a,
            };
            if next.least_below > best_cost || self.node(next.child).is_leaf() {
                break;
            }
            (at, direct) = (next.child, next.direct);
        }
        best
    }

    /// Brings boxes, heights and counts up to date from `at` to the top, and improves what it passes.
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

    /// Computes an inner node from its children.
    fn gather(&mut self, at: u32) {
        let [a, b] = self.node(at).children.map(|child| *self.node(child));
        let node = self.node_mut(at);
        node.bounds = a.bounds.union(&b.bounds);
        node.height = a.height.max(b.height) + 1;
        node.polygons = a.polygons + b.polygons;
    }

    fn height_difference(&self, a: u32, b: u32) -> u32 {
        self.node(a).height.abs_diff(self.node(b).height)
    }

    /// Rotates the taller child up if it is too tall (as in G. Adelson-Velsky and E. Landis, 1962). Returns the node
    /// that is now in the place of `at`.
    fn limit_height(&mut self, at: u32) -> u32 {
        let [a, b] = self.node(at).children;
        if self.height_difference(a, b) <= MAX_HEIGHT_DIFFERENCE {
            return at;
        }
        let (tall, side) = if self.node(a).height > self.node(b).height { (a, 0) } else { (b, 1) };
        let [c, d] = self.node(tall).children;
        let (stays, moves) = if self.node(c).height >= self.node(d).height { (c, d) } else { (d, c) };
        let above = self.node(at).parent;
        self.replace_child(above, at, tall);
        self.node_mut(tall).parent = above;
        self.node_mut(tall).children = [stays, at];
        self.node_mut(at).parent = tall;
        self.node_mut(at).children[side] = moves;
        self.node_mut(moves).parent = at;
        self.gather(at);
        self.gather(tall);
        tall
    }

    /// Exchanges a child with a child of the other child if that shrinks the box that loses it most. The box of `at`
    /// itself stays the same.
    fn rotate(&mut self, at: u32) {
        let children = self.node(at).children;
        let mut best: Option<(f64, u32, u32)> = None;
        for side in 0..2 {
            let (lower, upper) = (children[side], children[1 - side]);
            if self.node(upper).is_leaf() {
                continue;
            }
            let now = area(&self.node(upper).bounds);
            let below = self.node(upper).children;
            for i in 0..2 {
                let (goes_up, stays) = (below[i], below[1 - i]);
                let joined = self.node(lower).bounds.union(&self.node(stays).bounds);
                let gain = now - area(&joined);
                let joined_height = self.node(lower).height.max(self.node(stays).height) + 1;
                let keeps_limit = self.height_difference(lower, stays) <= MAX_HEIGHT_DIFFERENCE
                    && self.node(goes_up).height.abs_diff(joined_height) <= MAX_HEIGHT_DIFFERENCE;
                if gain > best.map_or(0.0, |(most, ..)| most) && keeps_limit {
                    best = Some((gain, lower, goes_up));
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

/// A way down.
struct Way {
    child: u32,
    /// Surface of the child's box joined with the new one.
    direct: f64,
    /// No place below costs less.
    least_below: f64,
}
