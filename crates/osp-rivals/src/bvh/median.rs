//! Splits at the median: each side gets half of the polygons, along the longest axis of the box around their centres.
//!
//! Source: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes" (1986).

use super::top_down::{InPlace, LEAF_CAPACITY, Pending, Split, box_of_centers, build_top_down, longest_axis};
use crate::{
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};

/// Configuration of a hierarchy split by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MedianConfig {
    /// A node with more polygons than this is split.
    pub leaf_capacity: usize,
}

impl Default for MedianConfig {
    fn default() -> Self {
        Self { leaf_capacity: LEAF_CAPACITY }
    }
}

#[derive(Debug)]
pub(super) struct MedianBuilder {
    config: MedianConfig,
    pending: Vec<Pending>,
}

impl MedianBuilder {
    pub(super) fn new(config: MedianConfig) -> Self {
        Self { config, pending: Vec::new() }
    }
}

impl TreeBuilder for MedianBuilder {
    const NAME: &'static str = "bvh-median";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        let capacity = self.config.leaf_capacity;
        let split = |items: &mut [Item]| {
            if items.len() <= capacity {
                return Split::Leaf;
            }
            let axis = longest_axis(&box_of_centers(items));
            let center = |item: &Item| item.bounds.center()[axis];
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
            Split::After(half)
        };
        let range = 0..items.len();
        build_top_down(range, 0, capacity, &mut InPlace { items, split }, &mut self.pending, tree);
    }

    fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Pending>()
    }
}
