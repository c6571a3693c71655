//! The model in formats of other programs.

mod gltf;

pub use gltf::{ExportError, GltfCounts, write_glb};
