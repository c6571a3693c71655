//! The paper's rival, well written: an octree that is built from scratch whenever something has changed ("the octree is
//! rebuilt under optimal conditions each time a new model comes", section 4.3 of the OSP paper).
//!
//! The octree is from Donald Meagher, "Geometric Modeling Using Octree Encoding" (1982). Its best known form for
//! culling boxes, as taken here: a polygon is in the one leaf that its centre lies in, every node has the tight box of
//! what is below, the cells follow the polygons (a node is cut at the middle of the box around its polygons' centres, so
//! one far outlier costs one level and not a linear scan), and everything lies in flat arrays in depth-first order.

mod build;

pub use build::OctreeConfig;

use super::rebuilt::Rebuilt;
use build::OctreeBuilder;
use osp::index::{IndexConfig, SpatialIndex};

/// An octree that is rebuilt in every commit that follows a change.
pub fn octree_rebuild(config: &OctreeConfig, index: &IndexConfig) -> Box<dyn SpatialIndex> {
    Box::new(Rebuilt::new(OctreeBuilder::new(*config), index.room()))
}
