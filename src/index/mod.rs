//! Spatial indexes: what files polygons into space and finds those that a view may see.
//!
//! Every structure stands behind [`SpatialIndex`], answers exactly the same set as [`BruteForce`], and returns its
//! [`WorkCounts`]. `frustum_cull` is a method of its own, not a visitor, so that an index can test many boxes at once;
//! [`SpatialIndex::traverse`] is for everything that asks per node (occlusion, pictures of the structure).

mod admission;
mod brute_force;
mod brute_simd;
mod bsp;
mod bucket_tree;
mod buckets;
mod bvh;
mod by_id;
mod draw_list;
mod dynamic_bvh;
mod exact;
mod flat_tree;
mod kd_tree;
mod kind;
mod lanes;
mod loose_octree;
mod octree_rebuild;
mod osp;
mod osp_paper;
#[cfg(feature = "peers")]
mod peers;
mod probe;
mod quadtree;
mod rebuilt;
mod simd;
mod sink;
mod spatial_index;
mod time_order;
mod walk_stack;
mod work;

pub use brute_force::BruteForce;
pub use brute_simd::BruteSimd;
pub use bsp::{Bsp, BspConfig, BspCounts};
pub use bvh::{
    BvhTwoLevel, HlbvhConfig, LbvhConfig, MedianConfig, MidpointConfig, SahConfig, SweepSahConfig,
    TwoLevelConfig, bvh_median, bvh_midpoint, bvh_sah, bvh_sah_sweep, hlbvh, lbvh,
};
pub use draw_list::DrawList;
pub use dynamic_bvh::DynamicBvh;
pub use kd_tree::{KdTreeConfig, kd_tree};
pub use kind::{IndexConfig, IndexKind};
pub use loose_octree::{LooseOctree, LooseOctreeConfig};
pub use octree_rebuild::{OctreeConfig, octree_rebuild};
pub use osp::{FoundPage, FoundPages, FoundRun, Osp};
pub use osp_paper::{DEFAULT_MAX_DEPTH, MAX_MAX_DEPTH, OspGrid, OspPaper, OspPlace};
#[cfg(feature = "peers")]
pub use peers::PeerKind;
pub use quadtree::{QuadtreeConfig, quadtree};
pub use simd::Backend;
pub use spatial_index::{IndexError, Node, SpatialIndex, Visit, Visitor};
pub use time_order::TimeOrder;
pub use work::WorkCounts;
