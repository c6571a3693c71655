use std::ops::Range;

use crate::{
    flat_tree::{COUNTED_DEPTH, FlatTree},
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

/// Default number of polygons of a leaf: four tests of sixteen. A larger number makes smaller trees, and queries test
/// more polygons. With 10,000 to a million polygons, frustum queries get faster up to this number, and stay as fast up
/// to 96. A tree for rays alone would have fewer.
pub(crate) const LEAF_CAPACITY: usize = 64;

/// Cost of visiting a node, for the surface area heuristic. A larger cost makes larger leaves.
pub(crate) const NODE_COST: f64 = 1.0;
/// Cost of testing a polygon of a leaf. It is less than [`NODE_COST`], because sixteen polygons are tested at once.
pub(crate) const POLYGON_COST: f64 = 0.03;

/// A builder's decision about a range of polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    /// The range becomes a leaf, if it is small enough for a leaf.
    Leaf,
    /// The range is split after this number of polygons. If this leaves one side empty, the range is halved
    /// by number.
    After(usize),
}

/// The polygons of a builder, which orders and splits ranges of them.
pub(crate) trait Ranges {
    /// Orders a range so that the two sides of its split follow each other, and returns the split.
    fn split(&mut self, range: Range<usize>) -> Split;

    /// Makes a leaf of a range.
    fn leaf(&mut self, range: Range<usize>, depth: usize, tree: &mut FlatTree);
}

/// A node still to be made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pending {
    start: u32,
    end: u32,
    depth: u32,
}

/// Builds a binary tree of `range` in depth-first order, with its top at `depth`. Whatever `ranges` decides, a leaf has at
/// most `leaf_capacity` polygons, every node has fewer than its parent, and the depth stays bounded.
pub(crate) fn build_top_down(
    range: Range<usize>,
    depth: usize,
    leaf_capacity: usize,
    ranges: &mut impl Ranges,
    pending: &mut Vec<Pending>,
    tree: &mut FlatTree,
) {
    pending.clear();
    pending.push(Pending { start: range.start as u32, end: range.end as u32, depth: depth as u32 });
    while let Some(Pending { start, end, depth }) = pending.pop() {
        let (range, count) = (start as usize..end as usize, (end - start) as usize);
        let fits = count <= leaf_capacity.max(1);
        let is_counted = depth as usize >= COUNTED_DEPTH;
        let split = match (count, is_counted) {
            (0 | 1, _) => Split::Leaf,
            (_, true) if fits => Split::Leaf,
            (_, true) => Split::After(count / 2),
            (_, false) => ranges.split(range.clone()),
        };
        let first = match split {
            Split::Leaf if fits => {
                ranges.leaf(range, depth as usize, tree);
                continue;
            }
            Split::After(first) if first > 0 && first < count => first,
            _ => count / 2,
        };
        tree.inner(depth as usize);
        let middle = start + first as u32;
        pending.push(Pending { start: middle, end, depth: depth + 1 });
        pending.push(Pending { start, end: middle, depth: depth + 1 });
    }
}

/// A rule that orders and splits polygons in place.
pub(crate) trait SplitInPlace: 'static + Send + Sync + std::fmt::Debug {
    /// The name of the index on the command line and in tables.
    const NAME: &'static str;

    fn leaf_capacity(&self) -> usize;

    fn split(&self, items: &mut [Item]) -> Split;
}

struct InPlace<'a, S> {
    items: &'a mut [Item],
    rule: &'a S,
}

impl<S: SplitInPlace> Ranges for InPlace<'_, S> {
    fn split(&mut self, range: Range<usize>) -> Split {
        self.rule.split(&mut self.items[range])
    }

    fn leaf(&mut self, range: Range<usize>, depth: usize, tree: &mut FlatTree) {
        tree.leaf(depth, &self.items[range]);
    }
}

#[derive(Debug)]
pub(crate) struct InPlaceBuilder<S> {
    rule: S,
    pending: Vec<Pending>,
}

impl<S: SplitInPlace> InPlaceBuilder<S> {
    pub(crate) fn new(rule: S) -> Self {
        Self { rule, pending: Vec::new() }
    }

    /// Builds a hierarchy of `items` with its top at `depth`.
    pub(crate) fn build_below(&mut self, items: &mut [Item], depth: usize, tree: &mut FlatTree) {
        let range = 0..items.len();
        let (rule, pending) = (&self.rule, &mut self.pending);
        build_top_down(range, depth, rule.leaf_capacity(), &mut InPlace { items, rule }, pending, tree);
    }
}

impl<S: SplitInPlace> TreeBuilder for InPlaceBuilder<S> {
    const NAME: &'static str = S::NAME;
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        self.build_below(items, 0, tree);
    }

    fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Pending>()
    }
}

/// An item of a builder, which has a box.
pub(crate) trait Boxed {
    fn bounds(&self) -> &Aabb;

    /// Number of polygons of the item.
    fn weight(&self) -> u32 {
        1
    }
}

impl Boxed for Item {
    fn bounds(&self) -> &Aabb {
        &self.bounds
    }
}

pub(crate) fn box_of_centers(items: &[impl Boxed]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |all, item| {
        let center = item.bounds().center();
        Aabb::new(all.min.min(center), all.max.max(center))
    })
}

pub(crate) fn longest_axis(bounds: &Aabb) -> usize {
    // Both corners are halved, because the edge of a huge box overflows.
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    half.max_position()
}

/// The middle of an interval. If the interval has any length, the result is below `max`, so that some centres lie above
/// it and some do not.
fn split_point(min: f32, max: f32) -> f32 {
    let middle = min * 0.5 + max * 0.5;
    if middle < max { middle } else { min }
}

/// Halves the longest axis of the box around the centres.
pub(crate) fn split_in_middle(items: &mut [impl Boxed]) -> Split {
    let centers = box_of_centers(items);
    let axis = longest_axis(&centers);
    let at = split_point(centers.min[axis], centers.max[axis]);
    Split::After(partition(items, |item| item.bounds().center()[axis] <= at))
}

/// Moves the items for which `is_first` returns true to the front; returns their number.
pub(crate) fn partition<T>(items: &mut [T], mut is_first: impl FnMut(&T) -> bool) -> usize {
    let (mut low, mut high) = (0, items.len());
    loop {
        while low < high && is_first(&items[low]) {
            low += 1;
        }
        while low < high && !is_first(&items[high - 1]) {
            high -= 1;
        }
        if low >= high {
            return low;
        }
        items.swap(low, high - 1);
    }
}
