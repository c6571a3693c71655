//! The octree that the paper compares its tree with, in its best form. It is built from scratch after every change: "the
//! octree is rebuilt under optimal conditions each time a new model comes" (section 4.3).
//!
//! Source: Donald Meagher, "Geometric Modeling Using Octree Encoding" (1982), in the best known form for culling boxes.
//! A polygon lies in the leaf that contains its centre, and every node has the tight box around all polygons below. The
//! cells follow the polygons: a node is cut at the middle of the box around its polygons' centres. So a far outlier
//! costs one level, not a linear scan. All nodes lie in flat arrays in depth-first order.

mod build;

pub(super) use build::OctreeBuilder;
pub use build::OctreeConfig;

use super::rebuilt::Rebuilt;
use osp::index::{IndexConfig, SpatialIndex};

/// An octree that is rebuilt in every commit that follows a change.
pub fn octree_rebuild(config: &OctreeConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(OctreeBuilder::new(*config), index.room()))
}
