//! A k-d tree that inserts polygons one at a time.
//!
//! Source: Jon Bentley, "Multidimensional Binary Search Trees Used for Associative Searching" (1975), with polygons in
//! leaves. The tree is kept balanced as in Igal Galperin and Ronald Rivest, "Scapegoat Trees" (1993): the highest subtree
//! that has become lopsided is built again. For moving points, Yixi Cai, Wei Xu and Fu Zhang, "ikd-Tree" (2021) do the
//! same. Leaves are split at the median of the longest axis.
//!
//! Differences: polygons are stored by the centres of their boxes, and every node has the tight box around all polygons
//! below. A polygon that moves within its leaf's cell stays in this leaf. Without rebuilds, a stroke that runs in one
//! direction would add a level for every few polygons.

use glam::Vec3;

use super::{bucket_tree::Partition, item::Item};
use osp::math::Aabb;

/// Largest share of its parent's polygons that a child may have. A larger share makes rarer rebuilds and deeper trees.
const MAX_SHARE: f32 = 0.7;

#[derive(Debug)]
pub(super) struct KdPartition;

/// The split of an inner node: centres below `at` belong to the first child.
#[derive(Clone, Copy, Debug)]
pub(super) struct KdSplit {
    axis: usize,
    at: f32,
}

impl Partition for KdPartition {
    const NAME: &'static str = "kd-tree";
    const ARITY: usize = 2;
    const FOLLOWS_POLYGONS: bool = true;
    type Cell = KdSplit;

    fn root_cell(&self) -> KdSplit {
        KdSplit { axis: 0, at: 0.0 }
    }

    fn grow(&self, _root: &KdSplit, _center: Vec3) -> Option<(KdSplit, usize)> {
        None // The root's cell is all of space.
    }

    fn split(&self, _cell: &KdSplit, items: &mut [Item]) -> Option<KdSplit> {
        let centers = items.iter().fold(Aabb::EMPTY, |all, item| {
            let center = item.bounds.center();
            Aabb::new(all.min.min(center), all.max.max(center))
        });
        // Both corners are halved, because the edge of a huge box overflows.
        let axis = (centers.max * 0.5 - centers.min * 0.5).max_position();
        if centers.min[axis] == centers.max[axis] {
            return None;
        }
        let center = |item: &Item| item.bounds.center()[axis];
        let half = items.len() / 2;
        let (_, median, after) = items.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
        let mut at = center(median);
        if at == centers.min[axis] {
            // At least half of the polygons have the smallest coordinate, so the split lies above it.
            at = after.iter().map(center).filter(|&x| x > at).fold(f32::INFINITY, f32::min);
        }
        Some(KdSplit { axis, at })
    }

    fn child_cell(_cell: &KdSplit, _child: usize) -> KdSplit {
        KdSplit { axis: 0, at: 0.0 }
    }

    fn child_of(&self, cell: &KdSplit, center: Vec3) -> usize {
        usize::from(center[cell.axis] >= cell.at)
    }

    fn is_lopsided(&self, count: u32, child: u32) -> bool {
        child as f32 > MAX_SHARE * count as f32
    }
}
