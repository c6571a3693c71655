//! The octree that stores a polygon in every child that it touches, and is rebuilt after every change.
//!
//! Source: Andrew Glassner, "Space Subdivision for Fast Ray Tracing" (1984).
//!
//! # Differences from the source
//! * Every node has the tight box around all polygons below, so queries find the same polygons as in other indexes.
//! * The source divides a full cell until the maximum depth. Polygons that coincide or are large would then be stored
//!   without end. Here [`MOST_COPIES`] and the rule of [`Builder::divide`] bound the memory.
//! * A query reports each polygon once: it has a bit for each polygon.

use super::{
    flat_tree::FlatTree,
    item::Item,
    octree_paper::octant,
    octree_rebuild::DEEPEST,
    rebuilt::{OnUpdate, Rebuilt, TreeBuilder},
};
use osp::{
    index::{IndexConfig, IndexError, Node, SpatialIndex, Upkeep, Visit, Visitor, WorkCounts},
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// Largest number of entries of the tree, as a multiple of the number of polygons. A larger multiple divides models of
/// large polygons further.
const MOST_COPIES: usize = 8;

/// A node still to be made.
#[derive(Clone, Copy, Debug)]
struct Pending {
    cell: Aabb,
    /// Range of [`Builder::numbers`].
    start: usize,
    end: usize,
    /// Number of nodes above.
    depth: usize,
    /// Number of times that the root's cell was halved.
    level: usize,
}

#[derive(Debug)]
struct Builder {
    leaf_capacity: usize,
    /// Indices of the polygons of all pending nodes. The polygons of the next node are at the end.
    numbers: Vec<u32>,
    pending: Vec<Pending>,
    leaf: Vec<Item>,
    /// Number of additional entries that the tree may still get.
    spare: usize,
    /// The largest id of the tree, plus 1.
    ids_end: usize,
}

impl Builder {
    fn new(leaf_capacity: usize) -> Self {
        Self {
            leaf_capacity,
            numbers: Vec::new(),
            pending: Vec::new(),
            leaf: Vec::new(),
            spare: 0,
            ids_end: 0,
        }
    }

    /// Divides a node if its children together have at most 1.5 times its polygons. Appends the children in reverse
    /// order. Returns whether the node was divided.
    fn divide(&mut self, mut node: Pending, items: &[Item], tree: &mut FlatTree) -> bool {
        let count = node.end - node.start;
        let (most, waiting) = (count + (count / 2).min(self.spare), self.pending.len());
        while count > self.leaf_capacity && node.level < DEEPEST {
            node.level += 1;
            for child in (0..8).rev() {
                let cell = octant(&node.cell, node.cell.center(), child);
                let start = self.numbers.len();
                for at in node.start..node.end {
                    let number = self.numbers[at];
                    if cell.intersects(&items[number as usize].bounds) {
                        self.numbers.push(number);
                    }
                }
                let end = self.numbers.len();
                if end > start {
                    self.pending.push(Pending { cell, start, end, depth: node.depth + 1, level: node.level });
                }
            }
            let copied = self.numbers.len() - node.end;
            match self.pending[waiting..] {
                [only] if copied == count => node.cell = only.cell,
                [_, _, ..] if (count..=most).contains(&copied) => {
                    tree.inner(node.depth);
                    self.spare -= copied - count;
                    return true;
                }
                _ => node.level = DEEPEST,
            }
            self.pending.truncate(waiting);
            self.numbers.truncate(node.end);
        }
        false
    }
}

impl TreeBuilder for Builder {
    const NAME: &'static str = "octree-every-child";
    const ON_UPDATE: OnUpdate = OnUpdate::Rebuild;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        self.spare = items.len() * (MOST_COPIES - 1);
        self.ids_end = items.iter().map(|item| item.id.0 as usize + 1).max().unwrap_or(0);
        self.numbers.clear();
        self.numbers.extend(0..items.len() as u32);
        let around = items.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
        // The cube begins at the smallest corner, so a flat model lies in the lower half along its thin direction.
        let side = (around.max - around.min).max_element();
        // Rounding must not cut the cube short of the model.
        let cell = Aabb::new(around.min, (around.min + side).max(around.max));
        self.pending.push(Pending { cell, start: 0, end: items.len(), depth: 0, level: 0 });
        while let Some(node) = self.pending.pop() {
            self.numbers.truncate(node.end);
            if !self.divide(node, items, tree) {
                let numbers = &self.numbers[node.start..node.end];
                self.leaf.clear();
                self.leaf.extend(numbers.iter().map(|&number| items[number as usize]));
                tree.leaf(node.depth, &self.leaf);
            }
        }
    }

    fn bytes(&self) -> usize {
        self.numbers.capacity() * size_of::<u32>()
            + self.pending.capacity() * size_of::<Pending>()
            + self.leaf.capacity() * size_of::<Item>()
    }
}

/// The polygons that a query has already reported, one bit for each.
struct Once(Vec<u64>);

impl Once {
    fn is_first(&mut self, id: PolygonId) -> bool {
        let (word, bit) = (&mut self.0[id.0 as usize / 64], 1 << (id.0 % 64));
        let is_first = *word & bit == 0;
        *word |= bit;
        is_first
    }
}

/// Passes each polygon to a visitor only once.
struct FirstTime<'a> {
    visitor: &'a mut dyn Visitor,
    once: Once,
    ids: Vec<PolygonId>,
    reported: u64,
}

impl Visitor for FirstTime<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.visitor.node(node)
    }

    fn polygons(&mut self, ids: &[PolygonId], decision: Visit) {
        self.ids.clear();
        self.ids.extend(ids.iter().copied().filter(|&id| self.once.is_first(id)));
        self.reported += self.ids.len() as u64;
        if !self.ids.is_empty() {
            self.visitor.polygons(&self.ids, decision);
        }
    }
}

#[derive(Debug)]
pub(super) struct OctreeEveryChild {
    tree: Rebuilt<Builder>,
}

impl OctreeEveryChild {
    pub(super) fn new(leaf_capacity: usize, index: &IndexConfig) -> Self {
        Self { tree: Rebuilt::new(Builder::new(leaf_capacity), index.room()) }
    }

    fn once(&self) -> Once {
        Once(vec![0; self.tree.builder().ids_end.div_ceil(64)])
    }
}

/// The counts of a query that reported this many different polygons.
fn without_copies(mut work: WorkCounts, reported: u64) -> WorkCounts {
    work.reported = reported;
    work.taken_whole = work.taken_whole.min(reported);
    work
}

impl SpatialIndex for OctreeEveryChild {
    fn name(&self) -> &'static str {
        self.tree.name()
    }

    fn len(&self) -> usize {
        self.tree.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.tree.insert(id, bounds)
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.tree.remove(id)
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.tree.update(id, bounds)
    }

    fn may_skip_commits(&self) -> bool {
        true
    }

    fn commit(&mut self) {
        self.tree.commit();
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let (start, mut once) = (draw_list.len(), self.once());
        let work = self.tree.frustum_cull(frustum, draw_list);
        let mut end = start;
        for at in start..draw_list.len() {
            let id = draw_list[at];
            if once.is_first(id) {
                draw_list[end] = id;
                end += 1;
            }
        }
        draw_list.truncate(end);
        without_copies(work, (end - start) as u64)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut first_time = FirstTime { visitor, once: self.once(), ids: Vec::new(), reported: 0 };
        let work = self.tree.traverse(frustum, &mut first_time);
        without_copies(work, first_time.reported)
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut once = self.once();
        self.tree.ray_nearest(ray, t_max, &mut |id| if once.is_first(id) { hit(id) } else { None })
    }

    fn upkeep(&self) -> Option<Upkeep> {
        self.tree.upkeep()
    }

    fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    fn clear(&mut self) {
        self.tree.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    struct Leaves(usize, usize);

    impl Visitor for Leaves {
        fn node(&mut self, node: &Node<'_>) -> Visit {
            self.0 += usize::from(node.is_leaf);
            self.1 += if node.is_leaf { node.polygons } else { 0 };
            Visit::Descend
        }

        fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}
    }

    /// The number of leaves, and of the polygons in all of them together.
    fn leaves(boxes: impl Iterator<Item = Aabb>) -> (usize, usize) {
        let mut index = OctreeEveryChild::new(2, &IndexConfig::default());
        boxes.enumerate().for_each(|(id, b)| index.insert(PolygonId(id as u32), &b).expect("a new box"));
        index.commit();
        let mut leaves = Leaves(0, 0);
        index.traverse(&Frustum::everything(), &mut leaves);
        let mut found = Vec::new();
        index.frustum_cull(&Frustum::everything(), &mut found);
        found.sort_unstable();
        assert!(found.into_iter().eq((0..index.len() as u32).map(PolygonId)), "each once");
        (leaves.0, leaves.1)
    }

    fn inserted(boxes: impl Iterator<Item = Aabb>) -> usize {
        leaves(boxes).1
    }

    #[test]
    fn a_flat_model_is_divided() {
        for flat in [Vec3::X, Vec3::Y, Vec3::Z] {
            let at = |i: usize| {
                Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, (i / 64) as f32) * (Vec3::ONE - flat)
            };
            let boxes = (0..512).map(|i| Aabb::new(at(i), at(i) + 0.5 * (Vec3::ONE - flat)));
            let (leaves, _) = leaves(boxes);
            assert!(leaves > 32, "{flat}: {leaves} leaves");
        }
    }

    #[test]
    fn a_polygon_lies_in_every_leaf_that_it_touches_and_copies_are_bounded() {
        let corner = |child: usize| Vec3::from_array([0, 1, 2].map(|axis| (child >> axis & 1) as f32 * 8.0));
        let small = (0..24).map(|i| Aabb::cube(corner(i % 8) + 0.1 * (i / 8) as f32, 0.01));
        assert_eq!(inserted(small.clone()), 24);
        // A wall through the middle touches all eight octants of the root, three polygons each.
        let wall = Aabb::new(Vec3::new(0.0, 0.0, 4.0), Vec3::new(8.0, 8.0, 4.2));
        let with_wall = inserted(small.chain([wall]));
        assert!(with_wall >= 24 + 8, "{with_wall}");
        let same = inserted((0..100).map(|_| wall));
        assert_eq!(same, 100, "dividing them would only make copies");
        // Cubes in a lattice, many on the borders of cells.
        let lattice = (0..1728).map(|i| Vec3::new((i % 12) as f32, (i / 12 % 12) as f32, (i / 144) as f32));
        let entries = inserted(lattice.map(|middle| Aabb::cube(middle, 0.3)));
        assert!(entries > 1728 && entries <= 1728 * MOST_COPIES, "{entries}");
    }
}
