//! Groups that move: a scene graph over indexes.
//!
//! A [`GroupIndex`] stores polygons in *meshes*, by their boxes in the mesh's own space. *Nodes* form trees: each node
//! has a transform to the space of its parent (or the world), and may have a mesh. A mesh of several nodes is shown
//! several times and stored once. If a node is placed again, the matrices of the nodes below are multiplied and their
//! boxes united. One entry changes in the index of all trees. The cost does not depend on the number of polygons.
//!
//! ```text
//! trees: an osp tree with an entry for each root node ─> its box in the world
//! node:  stored world matrix and box of all below; a flag marks them as out of date ─> nodes below, a mesh
//! mesh:  a list of up to 512 polygons, or an osp tree of more polygons, in the mesh's own space
//! ```
//!
//! A query searches the index of the trees and visits the nodes whose boxes are in view. It transforms the frustum into
//! the space of each visited mesh ([`Frustum::in_space`](osp::math::Frustum::in_space)), and widens it by the rounding
//! error in this space. So no polygon with a point in view is skipped. (The box of a polygon in the world may be in
//! view while its box in the mesh's space is not. Such a polygon is skipped, because it cannot be visible.)

mod node;
mod query;

pub use node::{GroupError, GroupIndex, GroupWork};
pub use query::{CullScratch, Found, Polygons};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u32);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);
