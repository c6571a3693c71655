//! Groups that move: a scene graph over indexes.
//!
//! A [`GroupIndex`] inserts polygons once, as *meshes*, by their boxes in the mesh's own space. *Nodes* form trees:
//! each has a transform to the space of its parent (or the world) and perhaps a mesh. A mesh of several nodes is shown
//! several times and stored once. A node that is placed again costs the nodes below it, whatever the number of their
//! polygons: their matrices are multiplied and their boxes united. In an index of the trees, one entry changes.
//!
//! ```text
//! trees: an osp tree, an entry for each node that hangs under none ─> its box in the world
//! node:  world matrix and box of all below, kept; a flag says that they are not those of now ─> nodes below, a mesh
//! mesh:  up to 512 polygons a list, more an osp tree, in its own space
//! ```
//!
//! A query searches the index of the trees and visits the nodes whose boxes are in view. It transforms the frustum
//! into the space of each mesh on the way ([`Frustum::in_space`](osp::math::Frustum::in_space)), widened by the
//! rounding there. So no polygon with a point in view is left out. (A polygon's box in the world may be in view while
//! its box in the mesh's space is not. Such polygons are left out, as they cannot be seen.)

mod node;
mod query;

pub use node::{GroupError, GroupIndex, GroupWork};
pub use query::{CullScratch, Found, Polygons};

/// A mesh of a [`GroupIndex`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u32);

/// A node of a [`GroupIndex`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);
