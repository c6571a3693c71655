//! The octree that the paper compares its tree with, in its best form: "the octree is rebuilt under optimal conditions
//! each time a new model comes" (section 4.3). It is built from scratch, once in a frame with changes, or once for each
//! inserted polygon.
//!
//! Source: Donald Meagher, "Geometric Modeling Using Octree Encoding" (1982), in the best known form for culling boxes.
//! A polygon lies in the leaf that contains its centre, and every node has the tight box around all polygons below. The
//! cells follow the polygons: a node is cut at the middle of the box around its polygons' centres. So a far outlier
//! costs one level, not a linear scan. All nodes lie in flat arrays in depth-first order.

use glam::Vec3;

use super::{
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

/// The deepest level of an octree. Nodes on this level are leaves of any size. Only polygons whose positions form a
/// geometric series reach this level, because cells halve at every level.
pub(super) const DEEPEST: usize = 48;

/// The element that a build moves: 16 bytes instead of the whole item.
#[derive(Clone, Copy, Debug)]
struct Seed {
    center: Vec3,
    item: u32,
}

/// A node still to be made.
#[derive(Clone, Copy, Debug)]
struct Pending {
    start: u32,
    end: u32,
    depth: u32,
    /// The box around the centres of its polygons.
    centers: Aabb,
}

/// Builds by counting sort: at every node, a first loop counts the polygons of the eight octants, and a second loop
/// orders them. O(n log n). The order is stable, so polygons keep their order of arrival.
#[derive(Debug)]
pub(crate) struct OctreeBuilder<const EACH_INSERT: bool> {
    /// A node with more polygons than this is split.
    leaf_capacity: usize,
    max_depth: usize,
    seeds: Vec<Seed>,
    sorted: Vec<Seed>,
    octants: Vec<u8>,
    pending: Vec<Pending>,
    leaf: Vec<Item>,
}

impl<const EACH_INSERT: bool> OctreeBuilder<EACH_INSERT> {
    pub(crate) fn new(leaf_capacity: usize, max_depth: usize) -> Self {
        Self {
            leaf_capacity,
            max_depth,
            seeds: Vec::new(),
            sorted: Vec::new(),
            octants: Vec::new(),
            pending: Vec::new(),
            leaf: Vec::new(),
        }
    }

    /// Builds the nodes above the cells. `make` gets the polygons of each cell, in depth-first order, with the depth of the
    /// cell, and adds the cell's nodes to the tree.
    pub(crate) fn build_cells(
        &mut self,
        items: &[Item],
        tree: &mut FlatTree,
        mut make: impl FnMut(&mut [Item], usize, &mut FlatTree),
    ) {
        let mut centers = Aabb::EMPTY;
        self.seeds.clear();
        self.seeds.extend(items.iter().enumerate().map(|(i, item)| {
            let center = item.bounds.center();
            centers.min = centers.min.min(center);
            centers.max = centers.max.max(center);
            Seed { center, item: i as u32 }
        }));
        if let Some(&first) = self.seeds.first() {
            self.sorted.resize(items.len(), first);
            self.octants.resize(items.len(), 0);
        }
        self.pending.clear();
        self.pending.push(Pending { start: 0, end: items.len() as u32, depth: 0, centers });
        while let Some(node) = self.pending.pop() {
            let count = (node.end - node.start) as usize;
            let in_one_place = node.centers.min == node.centers.max;
            if count > self.leaf_capacity && (node.depth as usize) < self.max_depth && !in_one_place {
                tree.inner(node.depth as usize);
                self.split(&node);
            } else {
                let seeds = &self.seeds[node.start as usize..node.end as usize];
                self.leaf.clear();
                self.leaf.extend(seeds.iter().map(|seed| items[seed.item as usize]));
                make(&mut self.leaf, node.depth as usize, tree);
            }
        }
    }

    /// Splits a node: orders its seeds by octants and appends the nodes below, the last first.
    fn split(&mut self, node: &Pending) {
        let range = node.start as usize..node.end as usize;
        let at = split_point(&node.centers);
        let seeds = &mut self.seeds[range.clone()];
        let octants = &mut self.octants[range.clone()];
        let mut counts = [0u32; 8];
        for (seed, octant) in seeds.iter().zip(octants.iter_mut()) {
            *octant = seed.center.cmpgt(at).bitmask() as u8;
            counts[*octant as usize] += 1;
        }
        let mut next = [0u32; 8];
        for octant in 1..8 {
            next[octant] = next[octant - 1] + counts[octant - 1];
        }
        let mut centers = [Aabb::EMPTY; 8];
        let sorted = &mut self.sorted[range];
        for (seed, &octant) in seeds.iter().zip(octants.iter()) {
            let octant = octant as usize;
            centers[octant].min = centers[octant].min.min(seed.center);
            centers[octant].max = centers[octant].max.max(seed.center);
            sorted[next[octant] as usize] = *seed;
            next[octant] += 1;
        }
        seeds.copy_from_slice(sorted);
        for octant in (0..8).rev().filter(|&octant| counts[octant] > 0) {
            let end = node.start + next[octant];
            let (start, depth) = (end - counts[octant], node.depth + 1);
            self.pending.push(Pending { start, end, depth, centers: centers[octant] });
        }
    }
}

/// The middle of a box. If rounding moves a coordinate of the middle to the maximum, the minimum replaces it, so that
/// each side gets polygons.
fn split_point(centers: &Aabb) -> Vec3 {
    let middle = centers.center();
    Vec3::select(middle.cmplt(centers.max), middle, centers.min)
}

impl<const EACH_INSERT: bool> TreeBuilder for OctreeBuilder<EACH_INSERT> {
    const NAME: &'static str = if EACH_INSERT { "octree-rebuild-insert" } else { "octree-rebuild" };
    const EACH_INSERT: bool = EACH_INSERT;
    const ON_UPDATE: OnUpdate = OnUpdate::Rebuild;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        self.build_cells(items, tree, |leaf, depth, tree| tree.leaf(depth, leaf));
    }

    fn bytes(&self) -> usize {
        (self.seeds.capacity() + self.sorted.capacity()) * size_of::<Seed>()
            + self.octants.capacity()
            + self.pending.capacity() * size_of::<Pending>()
            + self.leaf.capacity() * size_of::<Item>()
    }
}
