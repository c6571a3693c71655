//! Groups that move: a scene graph over indexes.
//!
//! A [`GroupIndex`] files polygons once, as *meshes*, by their boxes in the mesh's own space. *Nodes* form trees: each has a
//! transform to the space of its parent (or the world) and perhaps a mesh; a mesh that several nodes have is shown several
//! times and filed once. A node that is placed again costs the nodes below it, whatever their polygons are many: their
//! matrices are multiplied, their boxes united, and of the whole tree one entry changes in an index of the trees.
//!
//! ```text
//! trees: an osp tree, an entry for each node that hangs under none ─> its box in the world
//! node:  world matrix and box of all below, kept; a flag says that they are not those of now ─> nodes below, a mesh
//! mesh:  up to 512 polygons a list, more an osp tree, in its own space
//! ```
//!
//! A query asks the trees, goes down where a node's box is in view, and brings the frustum into the space of each mesh
//! that it reaches ([`Frustum::in_space`](osp::math::Frustum::in_space)), widened by what rounding may cost there. So no
//! polygon of which a point is in view is left out. (Its box in the world may reach into view where its box in the mesh's
//! space, which is turned with it, does not: such polygons are left out, as they cannot be seen.)

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
