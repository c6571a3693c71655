//! The model in formats of other programs.
//!
//! Knows [`scene`](crate::scene).

mod gltf;

pub use gltf::{ExportError, GltfCounts, write_glb};
