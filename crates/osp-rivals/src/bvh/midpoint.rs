//! Splits in the middle of space: halves the longest axis of the box around the centres.
//!
//! The hierarchy is from Steven Rubin and Turner Whitted, "A 3-Dimensional Representation for Fast Rendering of Complex
//! Scenes" (1980). Spatial splits as the simple alternative are from Jeffrey Goldsmith and John Salmon, "Automatic Creation
//! of Object Hierarchies for Ray Tracing" (1987). Difference: the centre of a polygon determines its side, so no polygon is
//! cut or stored twice.

use super::top_down::{Split, SplitInPlace, split_in_middle};
use crate::item::Item;

/// A node with more polygons than this is split.
#[derive(Debug)]
pub(crate) struct Midpoint(pub(crate) usize);

impl SplitInPlace for Midpoint {
    const NAME: &'static str = "bvh-midpoint";

    fn leaf_capacity(&self) -> usize {
        self.0
    }

    fn split(&self, items: &mut [Item]) -> Split {
        if items.len() <= self.0 { Split::Leaf } else { split_in_middle(items) }
    }
}
