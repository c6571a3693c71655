//! All spatial indexes that are compared with [`Osp`](osp::index::Osp), each in its best form and with the same
//! kernels. Also all other methods of [`occlusion`] culling.
//!
//! Each index finds exactly the same set as [`BruteForce`](osp::index::BruteForce) and counts its work. [`IndexKind`] lists
//! all of them, including `Osp`. [`groups`] is a scene graph over indexes, for models whose groups move.

#![allow(missing_docs, reason = "only this workspace uses the crate; many names need no comment")]

mod as_printed;
mod brute_simd;
mod bsp;
mod bucket_tree;
mod buckets;
mod bvh;
mod by_id;
mod dynamic_bvh;
mod exact;
mod flat_tree;
pub mod groups;
mod item;
mod kd_tree;
mod kind;
mod lagging;
mod lanes;
mod loose_octree;
pub mod occlusion;
mod octree_bvh;
mod octree_every_child;
mod octree_paper;
mod octree_rebuild;
mod osp_paper;
#[cfg(feature = "peers")]
mod peers;
mod plane_lanes;
mod quadtree;
mod rebuilt;
mod settings;
mod sink;
mod time_order;
mod walk_stack;

pub use as_printed::{CutNodes, InsertionCounts};
pub use brute_simd::BruteSimd;
pub use bsp::{Bsp, BspConfig, BspCounts, BspNode};
pub use bvh::{BvhTwoLevel, TwoLevelConfig};
pub use dynamic_bvh::DynamicBvh;
pub use kind::{IndexKind, REBUILDS};
pub use loose_octree::LooseOctree;
pub use occlusion::RivalOcclusion;
pub use octree_paper::{OctreePaper, OctreePaperConfig};
pub use osp_paper::{DEFAULT_MAX_DEPTH, MAX_MAX_DEPTH, OspGrid, OspNode, OspPaper, OspPlace};
#[cfg(feature = "peers")]
pub use peers::PeerKind;
pub use settings::{IndexSetting, IndexSettings};
pub use time_order::TimeOrder;
