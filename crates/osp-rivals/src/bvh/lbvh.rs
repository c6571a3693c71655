//! The linear hierarchy: polygons are sorted along the Morton curve, and ranges are split where the highest bit of the code
//! changes.
//!
//! Source: Christian Lauterbach et al., "Fast BVH Construction on GPUs" (2009). The split by the highest differing bit is
//! from Tero Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees" (2012). Differences: the
//! tree is built on one thread, top down over the sorted codes. A range that fits into a leaf becomes a leaf. A range of
//! equal codes is halved by number.

use std::ops::Range;

use super::{
    morton::{Key, MortonOrder},
    top_down::{Pending, Ranges, Split, build_top_down},
};
use crate::{
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};

#[derive(Debug)]
pub(crate) struct LbvhBuilder {
    leaf_capacity: usize,
    /// Number of bits of an axis in the Morton codes, 1 to 21. With fewer bits, more polygons share a code. Their range
    /// is halved by number.
    morton_bits: u32,
    order: MortonOrder,
    pending: Vec<Pending>,
    leaf: Vec<Item>,
}

impl LbvhBuilder {
    pub(crate) fn new(leaf_capacity: usize, morton_bits: u32) -> Self {
        let (pending, leaf) = (Vec::new(), Vec::new());
        Self { leaf_capacity, morton_bits, order: MortonOrder::default(), pending, leaf }
    }
}

/// Ranges of sorted keys.
pub(super) struct AlongCurve<'a> {
    pub(super) items: &'a [Item],
    pub(super) keys: &'a [Key],
    pub(super) leaf_capacity: usize,
    pub(super) leaf: &'a mut Vec<Item>,
}

impl Ranges for AlongCurve<'_> {
    fn split(&mut self, range: Range<usize>) -> Split {
        let keys = &self.keys[range];
        let (Some(first), Some(last)) = (keys.first(), keys.last()) else { return Split::Leaf };
        let differing = first.code ^ last.code;
        if keys.len() <= self.leaf_capacity {
            return Split::Leaf;
        }
        if differing == 0 {
            return Split::After(keys.len() / 2);
        }
        let highest = differing.ilog2();
        Split::After(keys.partition_point(|key| key.code >> highest & 1 == 0))
    }

    fn leaf(&mut self, range: Range<usize>, depth: usize, tree: &mut FlatTree) {
        self.leaf.clear();
        self.leaf.extend(self.keys[range].iter().map(|key| self.items[key.item as usize]));
        tree.leaf(depth, self.leaf);
    }
}

impl TreeBuilder for LbvhBuilder {
    const NAME: &'static str = "lbvh";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        let leaf_capacity = self.leaf_capacity;
        let keys = self.order.sort(items, self.morton_bits);
        let mut ranges = AlongCurve { items, keys, leaf_capacity, leaf: &mut self.leaf };
        build_top_down(0..keys.len(), 0, leaf_capacity, &mut ranges, &mut self.pending, tree);
    }

    fn bytes(&self) -> usize {
        self.order.bytes()
            + self.pending.capacity() * size_of::<Pending>()
            + self.leaf.capacity() * size_of::<Item>()
    }
}
