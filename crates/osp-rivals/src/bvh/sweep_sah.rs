//! Splits by the surface area heuristic at every possible position: the best tree of its kind, and the slowest to build.
//!
//! Source: Ingo Wald and Vlastimil Havran, "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)"
//! (2006). Polygons are sorted once along each axis; stable partition keeps the orders. Boxes instead of planes are from
//! Ingo Wald, Solomon Boulos, Peter Shirley, "Ray Tracing Deformable Scenes using Dynamic Bounding Volume Hierarchies"
//! (2007).

use std::ops::Range;

use super::top_down::{NODE_COST, POLYGON_COST, Pending, Ranges, Split, build_top_down, longest_axis};
use crate::{
    flat_tree::{FlatTree, area},
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

#[derive(Debug)]
pub(crate) struct SweepSahBuilder {
    leaf_capacity: usize,
    /// For each axis, the numbers of the items, sorted by centre.
    orders: [Vec<u32>; 3],
    scratch: Scratch,
    pending: Vec<Pending>,
}

/// Working memory of a build.
#[derive(Debug, Default)]
struct Scratch {
    /// For each position of the sweep, the cost of the polygons after it.
    behind: Vec<f64>,
    is_first: Vec<bool>,
    second: Vec<u32>,
    leaf: Vec<Item>,
}

impl SweepSahBuilder {
    pub(crate) fn new(leaf_capacity: usize) -> Self {
        Self { leaf_capacity, orders: Default::default(), scratch: Scratch::default(), pending: Vec::new() }
    }
}

struct Sweep<'a> {
    leaf_capacity: usize,
    items: &'a [Item],
    orders: &'a mut [Vec<u32>; 3],
    scratch: &'a mut Scratch,
}

impl Sweep<'_> {
    /// The cheapest split along the order of an axis: its cost, and the number of polygons before the split.
    fn best_along(&mut self, axis: usize, range: Range<usize>) -> (f64, usize) {
        let order = &self.orders[axis][range];
        let bounds = |&i: &u32| &self.items[i as usize].bounds;
        let mut around = Aabb::EMPTY;
        for (i, item) in order.iter().enumerate().skip(1).rev() {
            around = around.union(bounds(item));
            self.scratch.behind[i] = area(&around) * (order.len() - i) as f64;
        }
        around = Aabb::EMPTY;
        let mut best = (f64::INFINITY, 0);
        for (i, item) in order.iter().enumerate().take(order.len() - 1) {
            around = around.union(bounds(item));
            let cost = area(&around) * (i + 1) as f64 + self.scratch.behind[i + 1];
            if cost < best.0 {
                best = (cost, i + 1);
            }
        }
        best
    }

    /// Moves the first `first` items in the order of `axis` to the front of the other two orders. All orders stay
    /// sorted within both parts.
    fn reorder(&mut self, axis: usize, range: Range<usize>, first: usize) {
        for (i, &item) in self.orders[axis][range.clone()].iter().enumerate() {
            self.scratch.is_first[item as usize] = i < first;
        }
        for other in (0..3).filter(|&other| other != axis) {
            let order = &mut self.orders[other][range.clone()];
            self.scratch.second.clear();
            let mut kept = 0;
            for i in 0..order.len() {
                let item = order[i];
                if self.scratch.is_first[item as usize] {
                    order[kept] = item;
                    kept += 1;
                } else {
                    self.scratch.second.push(item);
                }
            }
            order[kept..].copy_from_slice(&self.scratch.second);
        }
    }
}

impl Ranges for Sweep<'_> {
    fn split(&mut self, range: Range<usize>) -> Split {
        let count = range.len();
        let along = [0, 1, 2].map(|axis| self.best_along(axis, range.clone()));
        let axis = (0..3).min_by(|&a, &b| along[a].0.total_cmp(&along[b].0)).unwrap_or(0);
        let (cost, first) = along[axis];
        let around = self.orders[0][range.clone()]
            .iter()
            .fold(Aabb::EMPTY, |all, &i| all.union(&self.items[i as usize].bounds));
        let whole = area(&around);
        let leaf_cost = POLYGON_COST * whole * count as f64;
        if count <= self.leaf_capacity && leaf_cost <= NODE_COST * whole + POLYGON_COST * cost {
            return Split::Leaf;
        }
        // Without a surface all positions cost the same, so the range is halved along an axis with some extent.
        let (axis, first) =
            if whole > 0.0 && cost.is_finite() { (axis, first) } else { (longest_axis(&around), count / 2) };
        self.reorder(axis, range, first);
        Split::After(first)
    }

    fn leaf(&mut self, range: Range<usize>, depth: usize, tree: &mut FlatTree) {
        self.scratch.leaf.clear();
        self.scratch.leaf.extend(self.orders[0][range].iter().map(|&i| self.items[i as usize]));
        tree.leaf(depth, &self.scratch.leaf);
    }
}

impl TreeBuilder for SweepSahBuilder {
    const NAME: &'static str = "bvh-sah-sweep";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        for (axis, order) in self.orders.iter_mut().enumerate() {
            order.clear();
            order.extend(0..items.len() as u32);
            let center = |i: u32| items[i as usize].bounds.center()[axis];
            order.sort_unstable_by(|&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
        }
        self.scratch.behind.resize(items.len() + 1, 0.0);
        self.scratch.is_first.resize(items.len(), false);
        let (leaf_capacity, orders, scratch) = (self.leaf_capacity, &mut self.orders, &mut self.scratch);
        let range = 0..items.len();
        let mut sweep = Sweep { leaf_capacity, items, orders, scratch };
        build_top_down(range, 0, leaf_capacity, &mut sweep, &mut self.pending, tree);
    }

    fn bytes(&self) -> usize {
        let orders: usize = self.orders.iter().map(Vec::capacity).sum();
        (orders + self.scratch.second.capacity()) * size_of::<u32>()
            + self.scratch.behind.capacity() * size_of::<f64>()
            + self.scratch.is_first.capacity()
            + self.scratch.leaf.capacity() * size_of::<Item>()
            + self.pending.capacity() * size_of::<Pending>()
    }
}
