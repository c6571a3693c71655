//! The model in formats of other programs.
//!
//! Depends on [`scene`](crate::scene) and [`brush`](crate::brush).

mod gltf;
mod gltf_json;
mod gltf_material;
mod gltf_part;
mod times;

pub use gltf::{ExportError, ExportOptions, GltfCounts, Objects, write_glb, write_glb_watched};
pub use times::PolygonTimes;
