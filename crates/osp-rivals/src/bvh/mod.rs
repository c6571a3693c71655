//! Bounding volume hierarchies, built from scratch when polygons come or go and refitted when they only move.
//!
//! This module contains only the builders, one in each file. A builder orders the polygons and chooses the limits of nodes.
//! `FlatTree` has the queries, the refit and the checks; `Rebuilt` decides when to build. Leaves of all hierarchies have up
//! to 64 polygons, tested sixteen at a time.

mod binned_sah;
mod hlbvh;
mod lbvh;
mod median;
mod midpoint;
mod morton;
mod sweep_sah;
pub(super) mod top_down;
mod two_level;

pub(super) use binned_sah::{BinnedSah, BinnedSahBuilder, USUAL_BUCKETS};
pub(super) use hlbvh::HlbvhBuilder;
pub(super) use lbvh::LbvhBuilder;
pub(super) use median::Median;
pub(super) use midpoint::Midpoint;
pub(super) use morton::MOST_BITS as MOST_MORTON_BITS;
pub(super) use sweep_sah::SweepSahBuilder;
pub use two_level::{BvhTwoLevel, TwoLevelConfig};
