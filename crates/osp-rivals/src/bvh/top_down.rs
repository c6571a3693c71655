use std::ops::Range;

use crate::{
    flat_tree::{COUNTED_DEPTH, FlatTree},
    item::Item,
};
use osp::math::Aabb;

/// Default number of polygons of a leaf: four tests of sixteen. A larger number makes smaller trees, and queries test
/// more polygons. With 10,000 to a million polygons, frustum queries get faster up to this number, and stay as fast up
/// to 96. A tree for rays alone would have fewer.
pub(crate) const LEAF_CAPACITY: usize = 64;

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

/// Items that a function orders in place.
pub(crate) struct InPlace<'a, F> {
    pub(crate) items: &'a mut [Item],
    pub(crate) split: F,
}

impl<F: FnMut(&mut [Item]) -> Split> Ranges for InPlace<'_, F> {
    fn split(&mut self, range: Range<usize>) -> Split {
        (self.split)(&mut self.items[range])
    }

    fn leaf(&mut self, range: Range<usize>, depth: usize, tree: &mut FlatTree) {
        tree.leaf(depth, &self.items[range]);
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

/// The box around the centres.
pub(crate) fn box_of_centers(items: &[impl Boxed]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |all, item| {
        let center = item.bounds().center();
        Aabb::new(all.min.min(center), all.max.max(center))
    })
}

/// The axis on which a box is longest.
pub(crate) fn longest_axis(bounds: &Aabb) -> usize {
    // Both corners are halved, because the edge of a huge box overflows.
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    half.max_position()
}

/// The middle of an interval. If the interval has any length, the result is below `max`, so that some centres lie above
/// it and some do not.
pub(crate) fn split_point(min: f32, max: f32) -> f32 {
    let middle = min * 0.5 + max * 0.5;
    if middle < max { middle } else { min }
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
