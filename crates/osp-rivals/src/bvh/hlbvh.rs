//! The hierarchical linear hierarchy. Polygons that share the leading bits of their Morton code form a treelet, built along
//! the curve. The surface area heuristic joins the treelets.
//!
//! Source: Jacopo Pantaleoni and David Luebke, "HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic
//! Geometry" (2010). Difference: this version runs on one thread, without the compressed sort of the GPU version.

use super::{
    binned_sah::{BinnedSah, split_by_sah},
    lbvh::AlongCurve,
    morton::{CODE_BITS, MortonOrder},
    top_down::{Boxed, Pending, Split, build_top_down},
};
use crate::{
    flat_tree::FlatTree,
    item::Item,
    rebuilt::{OnUpdate, TreeBuilder},
};
use osp::math::Aabb;

/// From this depth on, treelets are joined in halves, so that enough levels remain for the treelets themselves.
const COUNTED_TOP_DEPTH: u32 = 24;

/// Number of leading bits of the Morton code that the polygons of a treelet share. More bits make more treelets, a
/// better top of the tree, and slower builds.
const TREELET_BITS: u32 = 15;

/// Polygons that share the leading bits of their codes: a range of the Morton order.
#[derive(Clone, Copy, Debug)]
struct Treelet {
    bounds: Aabb,
    start: u32,
    end: u32,
}

impl Boxed for Treelet {
    fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    fn weight(&self) -> u32 {
        self.end - self.start
    }
}

/// A node of the top that is still to be made: a range of treelets.
#[derive(Clone, Copy, Debug)]
struct PendingTop {
    start: u32,
    end: u32,
    depth: u32,
}

#[derive(Debug)]
pub(crate) struct HlbvhBuilder {
    /// Number of bits of an axis in the Morton codes, 1 to 21.
    morton_bits: u32,
    /// Settings for joining the treelets, and the capacity of a leaf.
    sah: BinnedSah,
    order: MortonOrder,
    treelets: Vec<Treelet>,
    top: Vec<PendingTop>,
    pending: Vec<Pending>,
    leaf: Vec<Item>,
}

impl HlbvhBuilder {
    pub(crate) fn new(morton_bits: u32, sah: BinnedSah) -> Self {
        Self {
            morton_bits,
            sah,
            order: MortonOrder::default(),
            treelets: Vec::new(),
            top: Vec::new(),
            pending: Vec::new(),
            leaf: Vec::new(),
        }
    }
}

impl TreeBuilder for HlbvhBuilder {
    const NAME: &'static str = "hlbvh";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        let (sah, items) = (self.sah, &*items);
        let keys = self.order.sort(items, self.morton_bits);
        let below = CODE_BITS - TREELET_BITS;
        self.treelets.clear();
        let mut start = 0;
        for treelet in keys.chunk_by(|a, b| a.code >> below == b.code >> below) {
            let bounds =
                treelet.iter().fold(Aabb::EMPTY, |all, key| all.union(&items[key.item as usize].bounds));
            let end = start + treelet.len() as u32;
            self.treelets.push(Treelet { bounds, start, end });
            start = end;
        }
        let mut along = AlongCurve { items, keys, leaf_capacity: sah.leaf_capacity, leaf: &mut self.leaf };
        self.top.clear();
        self.top.push(PendingTop { start: 0, end: self.treelets.len() as u32, depth: 0 });
        while let Some(PendingTop { start, end, depth }) = self.top.pop() {
            let treelets = &mut self.treelets[start as usize..end as usize];
            if let [only] = treelets {
                let range = only.start as usize..only.end as usize;
                let capacity = sah.leaf_capacity;
                build_top_down(range, depth as usize, capacity, &mut along, &mut self.pending, tree);
                continue;
            }
            let count: u32 = treelets.iter().map(Treelet::weight).sum();
            if count as usize <= sah.leaf_capacity {
                // The few polygons of several treelets become one leaf.
                along.leaf.clear();
                let keys = treelets.iter().flat_map(|t| &keys[t.start as usize..t.end as usize]);
                along.leaf.extend(keys.map(|key| items[key.item as usize]));
                tree.leaf(depth as usize, along.leaf);
                continue;
            }
            let half = treelets.len() / 2;
            let first = if depth >= COUNTED_TOP_DEPTH {
                half
            } else {
                match split_by_sah(treelets, sah).or_middle(treelets, 0) {
                    Split::After(first) if first > 0 && first < treelets.len() => first,
                    _ => half,
                }
            };
            tree.inner(depth as usize);
            let middle = start + first as u32;
            self.top.push(PendingTop { start: middle, end, depth: depth + 1 });
            self.top.push(PendingTop { start, end: middle, depth: depth + 1 });
        }
    }

    fn bytes(&self) -> usize {
        self.order.bytes()
            + self.treelets.capacity() * size_of::<Treelet>()
            + self.top.capacity() * size_of::<PendingTop>()
            + self.pending.capacity() * size_of::<Pending>()
            + self.leaf.capacity() * size_of::<Item>()
    }
}
