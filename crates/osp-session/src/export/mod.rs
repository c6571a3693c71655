//! The model in formats of other programs: its polygons as glTF, STL, PLY or OBJ, its strokes as `.tilt`.
//!
//! Depends on [`scene`](crate::scene), [`stroke`](crate::stroke), [`brush`](crate::brush) and
//! [`recording`](crate::recording).

mod error;
mod gltf;
mod gltf_json;
mod gltf_material;
mod gltf_options;
mod gltf_packed;
mod gltf_part;
mod gltf_texture;
mod gltf_view;
mod kept_strokes;
mod mesh;
mod tilt;
mod tilt_metadata;
mod tilt_stroke;
mod times;

pub use error::ExportError;
pub use gltf::{GltfCounts, write_glb, write_glb_watched};
pub use gltf_options::{ExportOptions, Objects};
pub use kept_strokes::KeptStrokes;
pub use mesh::{MeshFormat, write_mesh};
pub use tilt::{TiltCounts, write_tilt};
pub use times::PolygonTimes;
