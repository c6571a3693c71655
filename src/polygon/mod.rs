//! Types for the caller's polygons: id, shape, change, and the trait [`Geometry`] that supplies their data.
//!
//! Depends on [`math`](crate::math) only.

#[doc(hidden)]
pub mod bits;
mod by_id;
mod change;
mod convex;
mod geometry;
mod id;
mod marks;
mod near;
mod paged;
mod space;
mod spaces_in_view;
mod visible_blocks;

pub use change::Change;
pub use convex::{ConvexPolygon, FLATNESS};
pub use geometry::Geometry;
pub use id::PolygonId;
pub(crate) use space::abs as abs_matrix;
pub use space::{SpaceId, SpacePlace};
pub(crate) use spaces_in_view::count as count_polygons;
pub use visible_blocks::{BLOCK, VisibleBlocks, ids_of};

// Lists by id and sets that the other crates of the workspace share. They change without notice.
#[doc(hidden)]
pub use self::{by_id::ById, paged::Paged, space::ROUNDING as PLACE_ROUNDING, spaces_in_view::SpacesInView};
