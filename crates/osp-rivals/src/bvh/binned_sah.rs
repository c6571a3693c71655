//! Splits by the surface area heuristic over a few buckets.
//!
//! Source: Ingo Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies" (2007). Differences: all three axes
//! are tried, not only the longest. If the heuristic rates all splits the same (every box is a point, or all lie on one
//! line), space is halved in the middle.

use glam::Vec3;

use super::top_down::{
    Boxed, InPlaceBuilder, NODE_COST, POLYGON_COST, Split, SplitInPlace, box_of_centers, partition,
    split_in_middle,
};
use crate::{flat_tree::area, item::Item};
use osp::math::Aabb;

/// Largest number of buckets for [`BinnedSah::buckets`].
const MAX_BUCKETS: usize = 32;

/// Default number of buckets of an axis.
pub(crate) const USUAL_BUCKETS: usize = 12;

/// Split by the surface area heuristic.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BinnedSah {
    /// Number of buckets of an axis, 2 to 32. More buckets make better splits and slower builds; above 16 hardly
    /// anything changes.
    pub(crate) buckets: usize,
    pub(crate) leaf_capacity: usize,
}

pub(crate) type BinnedSahBuilder = InPlaceBuilder<BinnedSah>;

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
pub(super) fn split_by_sah(items: &mut [impl Boxed], config: BinnedSah) -> SahSplit {
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
    let split_cost = NODE_COST * whole + POLYGON_COST * cost;
    if all.weight as usize <= config.leaf_capacity && POLYGON_COST * all.cost() <= split_cost {
        return SahSplit::Leaf;
    }
    SahSplit::After(partition(items, |item| buckets.of(item.bounds().center(), axis) <= last_of_first))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SahSplit {
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
            Self::Blind => split_in_middle(items),
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

impl SplitInPlace for BinnedSah {
    const NAME: &'static str = "bvh-sah";

    fn leaf_capacity(&self) -> usize {
        self.leaf_capacity
    }

    fn split(&self, items: &mut [Item]) -> Split {
        split_by_sah(items, *self).or_middle(items, self.leaf_capacity)
    }
}
