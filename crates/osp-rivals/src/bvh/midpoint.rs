//! Splits in the middle of space: halves the longest axis of the box around the centres.
//!
//! The hierarchy is from Steven Rubin and Turner Whitted, "A 3-Dimensional Representation for Fast Rendering of Complex
//! Scenes" (1980). Spatial splits as the simple alternative are from Jeffrey Goldsmith and John Salmon, "Automatic Creation
//! of Object Hierarchies for Ray Tracing" (1987). Difference: the centre of a polygon determines its side, so no polygon is
//! cut or stored twice.

use super::top_down::{
    InPlace, LEAF_CAPACITY, Pending, Split, box_of_centers, build_top_down, longest_axis, partition,
    split_point,
};
use crate::{
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};

/// Configuration of a hierarchy halved in the middle of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MidpointConfig {
    /// A node with more polygons than this is split.
    pub leaf_capacity: usize,
}

impl Default for MidpointConfig {
    fn default() -> Self {
        Self { leaf_capacity: LEAF_CAPACITY }
    }
}

#[derive(Debug)]
pub(super) struct MidpointBuilder {
    config: MidpointConfig,
    pending: Vec<Pending>,
}

impl MidpointBuilder {
    pub(super) fn new(config: MidpointConfig) -> Self {
        Self { config, pending: Vec::new() }
    }
}

impl TreeBuilder for MidpointBuilder {
    const NAME: &'static str = "bvh-midpoint";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        let capacity = self.config.leaf_capacity;
        let split = |items: &mut [Item]| {
            if items.len() <= capacity {
                return Split::Leaf;
            }
            let centers = box_of_centers(items);
            let axis = longest_axis(&centers);
            let at = split_point(centers.min[axis], centers.max[axis]);
            Split::After(partition(items, |item| item.bounds.center()[axis] <= at))
        };
        let range = 0..items.len();
        build_top_down(range, 0, capacity, &mut InPlace { items, split }, &mut self.pending, tree);
    }

    fn bytes(&self) -> usize {
        self.pending.capacity() * size_of::<Pending>()
    }
}
