use std::ops::Range;

use crate::{
    flat_tree::{COUNTED_DEPTH, FlatTree},
    item::Item,
};
use osp::math::Aabb;

/// Polygons of a leaf by default: four wide tests. More: smaller trees, more polygons tested. Frustum queries
/// gain up to here and stay level to 96, from 10 k to 1 M polygons; a tree for rays alone would take fewer.
pub(crate) const LEAF_CAPACITY: usize = 64;

/// A builder's decision about a range of polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    /// It stays together (granted if it fits into a leaf).
    Leaf,
    /// This many come first. A count that leaves one side empty stands for halves.
    After(usize),
}

/// A builder's polygons, in the form that it orders them in.
pub(crate) trait Ranges {
    /// Orders a range so that the two sides of its split follow each other.
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

/// Builds a binary tree of `range` depth first, its top at `depth`. Whatever `ranges` decides, a leaf holds at most
/// `leaf_capacity` polygons, every node has fewer than its parent, and the depth stays in bounds.
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

/// Whole items, ordered in place by a function.
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

/// Something with a box.
pub(crate) trait Boxed {
    fn bounds(&self) -> &Aabb;

    /// Polygons in it.
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
    // Halved, because the length of a huge box overflows.
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    half.max_position()
}

/// The middle of an interval, but below `max` if the interval has any length: some centres lie at or below it, some
/// above.
pub(crate) fn split_point(min: f32, max: f32) -> f32 {
    let middle = min * 0.5 + max * 0.5;
    if middle < max { middle } else { min }
}

/// Moves the items for which `is_first` holds to the front, and counts them.
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
