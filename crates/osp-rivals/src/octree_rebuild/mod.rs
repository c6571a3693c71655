//! The paper's rival in its best form: an octree that is built from scratch after every change, as "the octree is
//! rebuilt under optimal conditions each time a new model comes" (section 4.3).
//!
//! The octree is from Donald Meagher, "Geometric Modeling Using Octree Encoding" (1982). The form here is the best
//! known one for culling boxes. A polygon is in the one leaf that its centre lies in, and every node has the tight box
//! of all polygons below. The cells follow the polygons: a node is cut at the middle of the box around its polygons'
//! centres. So one far outlier costs one level and not a linear scan. Everything lies in flat arrays in depth-first
//! order.

mod build;

pub use build::OctreeConfig;

use super::rebuilt::Rebuilt;
use build::OctreeBuilder;
use osp::index::{IndexConfig, SpatialIndex};

/// An octree that is rebuilt in every commit that follows a change.
pub fn octree_rebuild(config: &OctreeConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(OctreeBuilder::new(*config), index.room()))
}
