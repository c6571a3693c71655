//! Splits at the median: each side gets half of the polygons, along the longest axis of the box around their centres.
//!
//! Source: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes" (1986).

use super::top_down::{Split, SplitInPlace, box_of_centers, longest_axis};
use crate::item::Item;

/// A node with more polygons than this is split.
#[derive(Debug)]
pub(crate) struct Median(pub(crate) usize);

impl SplitInPlace for Median {
    const NAME: &'static str = "bvh-median";

    fn leaf_capacity(&self) -> usize {
        self.0
    }

    fn split(&self, items: &mut [Item]) -> Split {
        if items.len() <= self.0 {
            return Split::Leaf;
        }
        let axis = longest_axis(&box_of_centers(items));
        let center = |item: &Item| item.bounds.center()[axis];
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
        Split::After(half)
    }
}
