//! A binary space partition along the polygons' own planes, built again when something came, went or moved.
//!
//! Source: Henry Fuchs, Zvi Kedem and Bruce Naylor, "On Visible Surface Generation by A Priori Tree Structures" (1980).
//! The plane of a node is that of one of its polygons; polygons that it cuts are cut, and the pieces go to either side.
//! From any eye a walk of the tree meets the pieces in exact order, the farthest first: what transparent strokes need,
//! without sorting ([`Bsp::back_to_front`]).
//!
//! Differences from the paper:
//! * The polygon whose plane is taken is not any one (or that of the fewest cuts among all) but the best of a few: of a
//!   bounded sample, weighed by cuts and balance on a bounded sample of the others.
//! * Where the best of them leaves most polygons on one side (a convex shape would become a chain), the plane across the
//!   longest axis at the median of the polygons is taken, which belongs to none of them.
//! * Depth and number of pieces are bounded. What is beyond stays together in a leaf and is ordered there by distance:
//!   the tree says how many pieces these are ([`BspCounts::unordered`]).
//! * A quad that is bent a little (see [`osp::polygon::FLATNESS`]) gives its plane the thickness of its bend: what is
//!   within is not cut. Without it, each ribbon would be cut into slivers by its own neighbours.
//! * Frustum culling was no subject in 1980. Here every polygon is at home where its largest piece is, and a second, flat
//!   tree of tight boxes follows the upper nodes; boxes are those of whole polygons, so that the set is exactly that of
//!   all other indexes, each polygon once.

mod build;
mod index;
mod order;
mod plane;

pub use build::BspConfig;
pub use index::Bsp;
pub use order::BspCounts;
