//! Tests of eight or sixteen boxes at once, shared by the indexes.
//!
//! A [`Kernel`] is a zero-sized token of an instruction set; it exists only if the processor has that set.
//! [`Backend::detect`] chooses the set once, when an index is created, and [`Backend::run`] enters code compiled for
//! it. The environment variable `OSP_SIMD` selects another set. Every kernel computes the distance to a plane in the
//! order that [`crate::math`] fixes, without fused multiply-add. All kernels therefore return the same results, bit for
//! bit.

mod backend;
mod boxes;
mod eye_boxes;
mod id_writer;
mod kernel;
mod narrow;
mod planes;
mod prefetch;
mod prepared_plane;
#[cfg(test)]
mod tests;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod wasm_simd128;
#[cfg(target_arch = "x86_64")]
mod x86_avx2;
#[cfg(target_arch = "x86_64")]
mod x86_avx512;

pub use backend::Backend;
pub use boxes::Boxes;
pub(crate) use boxes::Wide;
pub(crate) use eye_boxes::EyeBoxes;
pub(crate) use id_writer::PageRuns;
pub use id_writer::{IdWriter, ROOM_BEHIND};
pub(crate) use kernel::lanes_of;
pub use kernel::{Kernel, WithKernel};
pub use planes::{PlaneSet, Sides};
pub(crate) use prefetch::prefetch;
pub use prefetch::prefetch_lines;
pub(crate) use prepared_plane::PreparedPlane;
