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

pub(super) use binned_sah::BinnedSahBuilder;
pub use binned_sah::SahConfig;
pub use hlbvh::HlbvhConfig;
pub use lbvh::LbvhConfig;
pub use median::MedianConfig;
pub use midpoint::MidpointConfig;
pub(super) use morton::MOST_BITS as MOST_MORTON_BITS;
pub use sweep_sah::SweepSahConfig;
pub use two_level::{BvhTwoLevel, TwoLevelConfig};

use super::rebuilt::Rebuilt;
use osp::index::{IndexConfig, SpatialIndex};

/// A hierarchy halved in the middle of space.
pub fn bvh_midpoint(config: &MidpointConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(midpoint::MidpointBuilder::new(*config), index.room()))
}

/// A hierarchy halved by number of polygons.
pub fn bvh_median(config: &MedianConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(median::MedianBuilder::new(*config), index.room()))
}

/// A hierarchy split by the surface area heuristic over a few buckets.
pub fn bvh_sah(config: &SahConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(BinnedSahBuilder::new(*config), index.room()))
}

/// A hierarchy split by the surface area heuristic over all positions.
pub fn bvh_sah_sweep(config: &SweepSahConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(sweep_sah::SweepSahBuilder::new(*config), index.room()))
}

/// A hierarchy along the Morton curve.
pub fn lbvh(config: &LbvhConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(lbvh::LbvhBuilder::new(*config), index.room()))
}

/// A hierarchy along the Morton curve whose top is made by the surface area heuristic.
pub fn hlbvh(config: &HlbvhConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(hlbvh::HlbvhBuilder::new(*config), index.room()))
}
