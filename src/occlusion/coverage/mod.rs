//! A picture of connected surfaces, in which only wholly covered pixels count.
//!
//! A building or a sketch is made of small polygons that share edges. A single polygon covers few pixels wholly, but
//! the connected surface covers many. So a pixel counts as covered if its sample is covered and no border or silhouette
//! of the surface passes through the pixel. Edges between two polygons of the surface do not matter.
//!
//! # How
//! * [`surfaces`] stores the polygons that share corners and edges, bit for bit, and follows changes.
//! * [`facets`] projects each corner once, rounds it to 1/64 pixel, and cuts at the near plane; [`facet`] turns every
//!   outline counterclockwise. Two facets of one edge are neighbours if they pass it in opposite directions, because
//!   they then lie on different sides of it. An edge without a neighbour is open: a border, a silhouette, or the near
//!   plane.
//! * [`pairs`] joins neighbouring triangles to convex quads, so that there are half as many facets.
//! * [`picture`] selects the shown part of the window. If all occluders lie in a small part, only this part is shown,
//!   so a far model gets more pixels. An object that is not wholly in this part counts as visible.
//! * [`fill`] visits each tile of 8 x 8 pixels that a facet reaches. It finds the samples that the facet covers, and
//!   the pixels within `MARGIN` of an open edge.
//! * [`tiles`] joins the facets of a tile that are neighbours to surfaces. A surface covers the pixels of its samples,
//!   except pixels near its open edges. It covers a pixel from the farthest depth of its facets that touch this pixel on.
//! * [`buffer`] calls a box hidden if all pixels that its corners span are covered nearer than its nearest depth. It
//!   calls a polygon hidden if all pixels that it touches are covered nearer than its nearest depth in their tile. Most
//!   objects are visible, so two short cuts come first. A box is not hidden if its middle pixel is not covered. A
//!   polygon is not hidden if the pixel of a corner is not covered. It is hidden if all pixels between its corners
//!   hide its nearest corner.
//!
//! # Why a covered pixel is covered
//! Let `S` be the facets of one surface in a tile, `p` a pixel of it (closed), and `s` its sample.
//! 1. *Degree.* Each facet is convex and counterclockwise (`set_outline`, in whole numbers). A pair of triangles has
//!    the outline of both, without the edge that they share. So at a point off its edges its winding number is 0 or 1,
//!    and 1 inside. The sum over `S`, the degree, counts the facets above a point. It is the winding number of the sum
//!    of all outlines. In this sum, an edge that two neighbours share cancels, because they pass it in opposite
//!    directions. Only open edges remain, and edges whose neighbour is not in `S`.
//! 2. *Only open edges come near.* If an edge comes within `MARGIN` of the tile, the neighbouring facet does, too. So
//!    this facet has an entry there, unless it fills the whole tile (`in_tile`, by twice the margin). In that case its
//!    edge is not near the tile. The two entries are joined if their edge may come near the tile. Facets whose entries
//!    find no room break their tiles, which then hide nothing.
//! 3. *Rounding.* Each corner differs from its exact position by at most `MARGIN`, across and up: half a step, and
//!    `KNOWN` for the projection. Move all corners from their rounded to their exact positions along straight lines.
//!    Each edge stays within `MARGIN` of its rounded position, so no open edge meets `p` during the motion. The degree
//!    at a point of `p` changes only where an edge that does not cancel passes it. So the degree does not change, and is
//!    equal at all points of `p`.
//! 4. At `s` the degree is at least 1, because a sample counts only strictly inside a facet, by `INSIDE`, and no
//!    winding number is negative. So at the end, each point of `p` lies in the picture of at least one real polygon of
//!    `S`, beyond the near plane. A renderer may draw a bent polygon by either diagonal: both have the same outline, so
//!    the same degree. But the border of a bent polygon at the near plane depends on the diagonal. So a quad that is cut
//!    there is filled as the two triangles that [`ConvexPolygon`](crate::polygon::ConvexPolygon) has, which are
//!    neighbours along the diagonal.
//! 5. *Depth.* This polygon has a facet in `S`. The facet's bound holds for all depths of the polygon in the tile. It
//!    is the polygon's plane, moved back to the farthest corner, or the depth of this corner. The plane of a pair is
//!    that of one triangle, pushed back to the farthest corner of the other. The polygon meets `p`, and its corners lie
//!    within `MARGIN` of the facet's. So `p` is in the rectangle of pixels around the facet, widened by `MARGIN`. In `p`,
//!    the surface takes the farthest bound of the facets whose rectangles contain `p`. The facets that cover `s` are among
//!    them, so there is a bound. Facets with nearly equal bounds are bounded together, in all their pixels.
//!
//! Any part of the surfaces may be omitted: an edge whose neighbour is omitted is open. So budgets, facets without area
//! or convex outline, and corners too far to the side only reduce the number of hidden objects. A pixel has the
//! nearest bound of the surfaces that cover it, at the farthest corner of the pixel.

mod boxes;
mod buffer;
mod facet;
mod facets;
mod fill;
mod image;
mod mesh;
mod pairs;
mod picture;
mod slope;
mod surfaces;
mod table;
mod tiles;

#[cfg(test)]
mod margin_tests;
#[cfg(test)]
mod tests;

pub use buffer::CoverageBuffer;
pub(in crate::occlusion) use buffer::cube_around;
pub use mesh::OcclusionReport;
pub(crate) use mesh::{BOX_SIDES, Columns, MeshBuffer, Meshes, OccluderMesh, UNMOVED, moved};
pub(in crate::occlusion) use surfaces::Surfaces;
