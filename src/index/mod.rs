//! Spatial indexes: each takes polygons by their boxes and finds those that a view may see.
//!
//! Every structure stands behind [`SpatialIndex`], answers exactly the same set as [`BruteForce`], the reference, and returns
//! its [`WorkCounts`]. `frustum_cull` is a method of its own, not a visitor, so that an index can test many boxes at once;
//! [`SpatialIndex::traverse`] is for everything that asks per node (occlusion, pictures of the structure). Knows
//! [`math`](crate::math) and [`polygon`](crate::polygon).

pub(crate) mod admission;
mod brute_force;
mod config;
mod draw_list;
pub(crate) mod filed_boxes;
pub mod groups;
pub(crate) mod mask_writer;
mod osp;
pub(crate) mod probe;
#[cfg_attr(not(feature = "rivals"), expect(dead_code, reason = "kernels that only other structures run"))]
pub(crate) mod simd;
mod spatial_index;
pub(crate) mod waiting;
mod work;

pub use brute_force::BruteForce;
pub use config::IndexConfig;
pub use draw_list::DrawList;
pub use osp::Osp;
pub use simd::Backend;
pub use spatial_index::{IndexError, Node, SpatialIndex, Thinner, Visit, Visitor};
pub use work::{Upkeep, WorkCounts};
