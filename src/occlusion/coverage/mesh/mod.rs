//! Occluder meshes, drawn by batches into an image of the pixels that they cover wholly.
//!
//! # How
//! * [`prepare`] does the work that no view changes, once for each mesh. It welds corners at the same position, finds
//!   the triangles on both sides of each edge, and divides the triangles into batches of neighbours with boxes. For a
//!   closed mesh it looks for a box inside.
//! * [`registry`] places the meshes. It links meshes that have not moved where their borders are equal bit for bit.
//! * [`stage`] takes the nearest mesh or batch first and tests its box against the image, so most are never drawn. It
//!   draws some batches, joins those that are neighbours, adds them to the image, and goes on.
//! * [`draw`] projects the corners of a batch to steps of 1/64 pixel. The triangles that show the same side are a
//!   surface. Its *contour* has each edge with such a triangle on one side only: silhouettes, borders, and what the near
//!   plane cuts. Edges between two triangles of the surface need no work.
//! * [`contour`] finds the samples with a positive winding number: the surface reaches their pixels.
//!
//! A surface covers the pixels that it reaches and that no edge of its contour comes near, within `MARGIN`. It covers
//! them from the farthest depth that any of its triangles has in the tile. At the border between two batches, both cover
//! the pixels together, once both are drawn.
//!
//! # Why a covered pixel is covered
//! Let `S` be the triangles of a surface, or of several joined ones, `p` a pixel (closed), and `s` its sample.
//! 1. *Degree.* Each triangle of `S` has a positive area in the picture, or none. So the winding number of each outline is
//!    0 or 1 at points off its edges. The degree is their sum. It is the winding number of the contour, because the
//!    outlines of two neighbours pass their edge in opposite directions, between the same two corners.
//! 2. *Corners.* Neighbours have the same corners bit for bit: in one batch by number, in two batches because the same
//!    numbers give the same projection. Welding makes corners equal only if their coordinates are equal, so it closes no
//!    gap. At a T-junction, one long edge lies beside two short ones. The three are no mates, so they are borders, and no
//!    pixel near them is covered. A triangle without area, which closes such a junction, has winding number 0. It may count
//!    to either surface.
//! 3. *Rounding.* Each corner differs from its exact position by at most `MARGIN`, across and up ([`draw::Placed`]). Move
//!    all corners to their exact positions along straight lines. No edge of the contour comes near `p`, so the degree is
//!    the same at all points of `p`, before, during and after the motion.
//! 4. *Reach.* If the winding number at `s` is positive, so is the degree in `p`. Then each point of `p` lies in the
//!    picture of at least one exact triangle of `S`. The sample may lie so near an edge of the contour that rounding
//!    decides. Then the edge comes near `p`. So `p` does not count, unless the edge is a border between two joined surfaces
//!    of `S`. Neither of the two has a negative winding number anywhere, so their sum is positive beside the edge, and thus
//!    in `p`.
//! 5. *Depth.* A point of `p` lies behind a triangle of `S` that touches `p`, and so the tile. The depth of the tile is
//!    that of the farthest such triangle: its plane, moved back to its farthest corner, or this corner.
//! 6. *Joined surfaces.* A border pixel counts only if each edge near it has both sides in `S`: the batch on the other
//!    side is drawn, its triangle shows the same side, and its part in the tile is joined. All other edges are open.
//!    Linked meshes are cut by the same near plane, so they have the same corners there, too.
//!
//! Anything may be omitted: a batch that is hidden, too small or beyond the budget, a triangle of imprecise corners. Its
//! neighbours then have borders there.
//!
//! *The box inside.* No triangle of a closed mesh enters the box, so all its points have the same winding number in
//! space, and it is not 0. The eye and the near plane lie outside of the mesh's box, where this number is 0. So between
//! the near plane and each point of the box, the ray from the eye meets the mesh.

mod contour;
mod draw;
mod prepare;
mod registry;
mod stage;

pub(crate) use prepare::{BOX_SIDES, OccluderMesh};
pub(crate) use registry::{Columns, Meshes, UNMOVED, moved};
pub(crate) use stage::MeshBuffer;
pub use stage::OcclusionReport;
