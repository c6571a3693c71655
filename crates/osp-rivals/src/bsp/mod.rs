//! A binary space partition along the polygons' own planes, built again after every change.
//!
//! Source: Henry Fuchs, Zvi Kedem and Bruce Naylor, "On Visible Surface Generation by A Priori Tree Structures" (1980).
//! The plane of a node is the plane of one of its polygons. It cuts other polygons, and the pieces go to either side.
//! For any eye, a traversal of the tree visits the pieces in exact order from back to front. Transparent strokes need
//! this order, and get it without sorting ([`Bsp::back_to_front`]).
//!
//! Differences from the paper:
//! * The plane of a node belongs to the best polygon of a bounded sample, not to any polygon or the polygon with the
//!   fewest cuts. The rating counts cuts and balance on a bounded sample of the other polygons.
//! * If the best plane leaves most polygons on one side, the plane across the longest axis at the median of the polygons
//!   may replace it. Otherwise a convex shape would become a chain.
//! * Depth and number of pieces are bounded. Polygons beyond these limits stay together in a leaf, ordered by distance.
//!   [`BspCounts::unordered`] counts these pieces.
//! * A quad that is bent a little (see [`osp::polygon::FLATNESS`]) gives its plane the thickness of its bend, and polygons
//!   within this thickness are not cut. Otherwise neighbouring quads of a ribbon would cut each other into slivers.
//! * The paper has no frustum culling. Here every polygon is assigned to the node of its largest piece, and a second, flat
//!   tree of tight boxes follows the upper nodes. Its boxes surround whole polygons, so a query reports exactly the set of
//!   all other indexes, each polygon once.

mod build;
mod index;
mod order;
mod plane;

pub use build::BspConfig;
pub use index::Bsp;
pub use order::{BspCounts, BspNode};
