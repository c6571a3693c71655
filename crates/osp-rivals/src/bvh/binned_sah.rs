//! Splits by the surface area heuristic over a few buckets.
//!
//! Source: Ingo Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies" (2007). Differences: all three axes
//! are tried, not only the longest. If the heuristic rates all splits the same (every box is a point, or all lie on one
//! line), space is halved in the middle.

use glam::Vec3;

use super::top_down::{
    Boxed, InPlace, LEAF_CAPACITY, Pending, Split, box_of_centers, build_top_down, longest_axis, partition,
    split_point,
};
use crate::{
    flat_tree::{FlatTree, area},
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

/// Largest number of buckets for [`SahConfig::buckets`].
const MAX_BUCKETS: usize = 32;

/// Configuration of a hierarchy split by the surface area heuristic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SahConfig {
    /// Number of buckets of an axis, 2 to 32. More buckets make better splits and slower builds; above 16 hardly
    /// anything changes.
    pub buckets: usize,
    /// Largest number of polygons of a leaf.
    pub leaf_capacity: usize,
    /// Cost of visiting a node. A larger cost makes larger leaves.
    pub node_cost: f64,
    /// Cost of testing a polygon of a leaf. It is less than `node_cost`, because sixteen polygons are tested at once.
    pub polygon_cost: f64,
}

impl Default for SahConfig {
    fn default() -> Self {
        Self { buckets: 12, leaf_capacity: LEAF_CAPACITY, node_cost: 1.0, polygon_cost: 0.03 }
    }
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    bounds: Aabb,
    weight: u32,
}

impl Bucket {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, weight: 0 };

    fn join(&mut self, other: &Self) {
        self.bounds = self.bounds.union(&other.bounds);
        self.weight += other.weight;
    }

    fn cost(&self) -> f64 {
        area(&self.bounds) * f64::from(self.weight)
    }
}

/// Maps a centre to its bucket on each axis.
struct Buckets {
    least: Vec3,
    per_half_metre: Vec3,
    last: usize,
}

impl Buckets {
    fn new(centers: &Aabb, count: usize) -> Self {
        // Both corners are halved, because the edge of a huge box overflows.
        let least = centers.min * 0.5;
        let per_half_metre = Vec3::splat(count as f32) / (centers.max * 0.5 - least);
        Self { least, per_half_metre, last: count - 1 }
    }

    #[inline]
    fn of(&self, center: Vec3, axis: usize) -> usize {
        // If the box has no extent on an axis, this is 0 times infinity, and NaN becomes bucket 0.
        let bucket = (center[axis] * 0.5 - self.least[axis]) * self.per_half_metre[axis];
        (bucket as usize).min(self.last)
    }
}

/// Orders `items` by the best split and returns the split. Returns [`SahSplit::Leaf`] if a leaf is cheaper, and
/// [`SahSplit::Blind`] if the heuristic rates all splits the same.
pub(super) fn split_by_sah(items: &mut [impl Boxed], config: &SahConfig) -> SahSplit {
    let count = config.buckets.clamp(2, MAX_BUCKETS);
    let centers = box_of_centers(items);
    let buckets = Buckets::new(&centers, count);
    let mut filled = [[Bucket::EMPTY; MAX_BUCKETS]; 3];
    for item in items.iter() {
        let center = item.bounds().center();
        let own = Bucket { bounds: *item.bounds(), weight: item.weight() };
        for (axis, filled) in filled.iter_mut().enumerate() {
            filled[buckets.of(center, axis)].join(&own);
        }
    }
    let mut all = Bucket::EMPTY;
    filled[0][..count].iter().for_each(|bucket| all.join(bucket));
    let mut best = (f64::INFINITY, 0, 0);
    for (axis, filled) in filled.iter().enumerate() {
        if centers.min[axis] == centers.max[axis] {
            continue;
        }
        for (last_of_first, cost) in costs(&filled[..count]) {
            if cost < best.0 {
                best = (cost, axis, last_of_first);
            }
        }
    }
    let whole = area(&all.bounds);
    let (cost, axis, last_of_first) = best;
    if !(whole > 0.0 && cost.is_finite()) {
        return SahSplit::Blind;
    }
    let split_cost = config.node_cost * whole + config.polygon_cost * cost;
    if all.weight as usize <= config.leaf_capacity && config.polygon_cost * all.cost() <= split_cost {
        return SahSplit::Leaf;
    }
    SahSplit::After(partition(items, |item| buckets.of(item.bounds().center(), axis) <= last_of_first))
}

/// Result of [`split_by_sah`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SahSplit {
    /// A leaf is cheaper.
    Leaf,
    /// The first part has this number of items.
    After(usize),
    /// All splits are rated the same, because the nodes have no surface.
    Blind,
}

impl SahSplit {
    /// Returns the split. If the heuristic rates all splits the same, the split halves space in the middle.
    pub(super) fn or_middle(self, items: &mut [impl Boxed], leaf_capacity: usize) -> Split {
        match self {
            Self::Leaf => Split::Leaf,
            Self::After(first) => Split::After(first),
            Self::Blind if items.len() <= leaf_capacity => Split::Leaf,
            Self::Blind => {
                let centers = box_of_centers(items);
                let axis = longest_axis(&centers);
                let at = split_point(centers.min[axis], centers.max[axis]);
                Split::After(partition(items, |item| item.bounds().center()[axis] <= at))
            }
        }
    }
}

/// The cost of a split after each bucket except the last, if both sides have polygons.
fn costs(filled: &[Bucket]) -> impl Iterator<Item = (usize, f64)> {
    let mut after = [0.0; MAX_BUCKETS];
    let mut right = Bucket::EMPTY;
    for (i, bucket) in filled.iter().enumerate().skip(1).rev() {
        right.join(bucket);
        after[i - 1] = if right.weight > 0 { right.cost() } else { f64::INFINITY };
    }
    let mut left = Bucket::EMPTY;
    filled[..filled.len() - 1].iter().enumerate().map(move |(i, bucket)| {
        left.join(bucket);
        (i, if left.weight > 0 { left.cost() + after[i] } else { f64::INFINITY })
    })
}

#[derive(Debug)]
pub(crate) struct BinnedSahBuilder {
    config: SahConfig,
    pending: Vec<Pending>,
}

impl BinnedSahBuilder {
    pub(crate) fn new(config: SahConfig) -> Self {
        Self { config, pending: Vec::new() }
    }

    /// Builds a hierarchy of `items` with its top at `depth`.
    pub(crate) fn build_below(&mut self, items: &mut [Item], depth: usize, tree: &mut FlatTree) {
        let config = self.config;
        let capacity = config.leaf_capacity;
        let split = |items: &mut [Item]| split_by_sah(items, &config).or_middle(items, capacity);
        let range = 0..items.len();
        build_top_down(range, depth, capacity, &mut InPlace { items, split }, &mut self.pending, tree);
    }
}

impl TreeBuilder for BinnedSahBuilder {
    const NAME: &'static str = "bvh-sah";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        self.build_below(items, 0, tree);
    }

    fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Pending>()
    }
}
