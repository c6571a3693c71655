use glam::Vec3;

use crate::{
    flat_tree::{FlatTree, MAX_DEPTH},
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

/// Configuration of an octree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OctreeConfig {
    /// A node with more polygons than this is split. A larger capacity makes quicker builds, and queries test more
    /// polygons. Sixteen polygons are tested at once; queries get faster up to a capacity of 64.
    pub leaf_capacity: usize,
    /// The deepest level, at most 96. Nodes on this level are leaves of any size. Only polygons whose positions form a
    /// geometric series reach this level, because cells halve at every level.
    pub max_depth: usize,
}

impl Default for OctreeConfig {
    fn default() -> Self {
        Self { leaf_capacity: 64, max_depth: 48 }
    }
}

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
pub(crate) struct OctreeBuilder {
    config: OctreeConfig,
    seeds: Vec<Seed>,
    sorted: Vec<Seed>,
    octants: Vec<u8>,
    pending: Vec<Pending>,
    leaf: Vec<Item>,
}

impl OctreeBuilder {
    pub(crate) fn new(config: OctreeConfig) -> Self {
        Self {
            config: OctreeConfig { max_depth: config.max_depth.min(MAX_DEPTH), ..config },
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
            if count > self.config.leaf_capacity
                && (node.depth as usize) < self.config.max_depth
                && !in_one_place
            {
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

impl TreeBuilder for OctreeBuilder {
    const NAME: &'static str = "octree-rebuild";
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
