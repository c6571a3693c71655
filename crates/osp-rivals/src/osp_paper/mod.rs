//! The OSP (octal space partition) tree as its paper describes it: "A Study on the Real Time Culling of Infinite Sets
//! of Geometries Using OSP Tree", sections 2 and 3.1.
//!
//! A cube is halved by a plane of constant x, its halves by planes of constant y, their halves by planes of constant z.
//! This cycle makes eight parts, and then begins again with x. Every node exists before the first polygon, so the
//! insertion of a polygon is a descent that tests one plane at a time. This table lists the paper's figures:
//!
//! | Paper | Here |
//! |---|---|
//! | 2.2, Fig. 2 and 4: pre-processing, the cycle of splitting planes | `grid.rs`, [`OspPaper::new`] |
//! | Fig. 3: the fields of a node | `node.rs` |
//! | 2.3, Fig. 5: inserting a polygon | `tree.rs` |
//! | 3.1, Fig. 6: culling by the view frustum | `cull.rs` |
//! | not in the paper: the node at which Fig. 5 ends, without the descent | [`placement`](OspGrid::place) |
//!
//! # Differences from the paper
//! * **The result is exact.** If the frustum's planes cut a node, the paper draws all of the node's own polygons. Here
//!   the box of each polygon is tested, because every index of this crate reports the same set. With
//!   [`CutNodes::Drawn`], all of the node's own polygons are reported.
//! * **"Outside" means behind one plane.** The paper tests whether the eight points of a node lie outside the frustum. If
//!   they lie behind different planes, the box may still be in view. So a node is skipped only if all eight points lie
//!   behind the same plane.
//! * **Two of the eight points are enough.** The corner of a box farthest along a plane's normal and the corner farthest
//!   against it decide for all eight. Only the distances of these two corners are computed.
//! * **The polygon's box replaces its vertices.** Fig. 5 puts every vertex into the equation of the splitting plane.
//!   These planes are perpendicular to the axes, so all vertices are in front if the smallest coordinate is in front.
//!   The box therefore gives the same result as the vertices, bit for bit.
//! * **`Depth` counts binary levels.** The paper gives the three steps of one cycle (YZ, XZ, XY) the same depth. Here each
//!   step is a level, so the paper's maximum depth `d` is `3 d` levels. A depth that is no multiple of 3 ends in the
//!   middle of a cycle.
//! * **`IsFrustumCull` is omitted.** The paper marks culled nodes in the tree. Here a query does not change the tree;
//!   its result goes to the draw list or to the visitor.
//! * **A count of the polygons below** is added to the node. With this count, a removal clears `IsPolygon` and `IsSubnode`
//!   again. So a query takes no longer after all polygons were erased than in an empty tree.
//! * **Occluder candidates**, which the paper collects during insertion (3.2.1), belong to [`osp::occlusion`].
//!
//! Choices that the text leaves open:
//! * *The front side of a plane.* It is the side of growing x, y or z.
//! * *A polygon that is not wholly inside the cube* ("a limited space"). It is stored in a separate list
//!   ([`OspPaper::outside`]). Every query tests each polygon of the list. Nothing is lost, but many such polygons
//!   make a linear scan.
//! * *The shape of the nodes between two full cycles.* A node is a box with edges of one or two lengths; `Width` is the
//!   longest.
//! * *Erasing and moving.* The polygon is removed from its node's list, and the flags of its ancestors are updated.
//! * *Whether empty nodes are visited when culling.* They are not: `IsPolygon` and `IsSubnode` mark them.

mod cull;
mod grid;
mod node;
mod placement;
mod tree;

pub use grid::{DEFAULT_MAX_DEPTH, MAX_MAX_DEPTH, OspGrid};
pub use node::OspNode;
pub use placement::OspPlace;
pub use tree::OspPaper;

#[cfg(doc)]
use super::CutNodes;
