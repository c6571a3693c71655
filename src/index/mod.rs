//! Spatial indexes: an index stores polygons by their boxes, and finds the polygons that a view may see.
//!
//! Every index implements [`SpatialIndex`], finds exactly the same polygons as the reference [`BruteForce`], and counts
//! its work ([`WorkCounts`]). A frame uses the result as [`VisibleBlocks`](crate::polygon::VisibleBlocks), other
//! callers use a list of ids. Depends on [`math`](crate::math) and [`polygon`](crate::polygon).

pub(crate) mod admission;
mod brute_force;
mod config;
pub(crate) mod inserted_boxes;
pub(crate) mod mask_writer;
pub(crate) mod mesh;
mod osp;
pub(crate) mod probe;
pub(crate) mod search_entry;
pub(crate) mod simd;
mod spatial_index;
mod visit;
mod work;

/// Code that [`Osp`] shares with the structures compared with it, so that all of them run the same code for the same
/// work: tests of many boxes at once, checks of arguments, boxes by id, meshes, results as masks or lists, searches by
/// distance. Engines should not use this module, because it changes without notice.
#[doc(hidden)]
pub mod kernels {
    pub use super::{
        admission::admit,
        inserted_boxes::InsertedBoxes,
        mask_writer::{MaskWriter, RunSink},
        mesh::Mesh,
        probe::{Nearest, NearestPolygons, is_wanted, nearest_by},
        search_entry::SearchEntry,
        simd::{Boxes, IdWriter, Kernel, PlaneSet, ROOM_BEHIND, Sides, WithKernel, prefetch_lines},
    };
}

pub use brute_force::BruteForce;
pub use config::IndexConfig;
pub use osp::Osp;
pub use spatial_index::{IndexError, SpatialIndex};
pub use work::WorkCounts;

// For occlusion culling, pictures of the structures and benchmarks. They change without notice.
#[doc(hidden)]
pub use self::{
    simd::Backend,
    visit::{Node, Visit, Visitor},
    work::Upkeep,
};
