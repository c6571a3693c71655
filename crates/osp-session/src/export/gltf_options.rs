use glam::Vec3;

use super::times::PolygonTimes;
use crate::recording::{Camera, Environment};

/// Content of an object of the exported file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objects {
    /// A layer of the session.
    #[default]
    Layers,
    /// A stroke.
    Strokes,
    /// The whole model, for viewers that only show it: brushes share materials, equal vertices are merged, and a vertex
    /// has neither time nor stroke.
    Whole {
        /// Whether the buffers are compressed (`EXT_meshopt_compression`). Needs the feature `compress`.
        is_compressed: bool,
    },
}

/// Options of an export.
#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    /// Content of an object.
    pub objects: Objects,
    /// Names of the layers, by their numbers.
    pub layer_names: Vec<String>,
    /// The times at which the polygons were drawn, if the file is to contain them.
    pub times: Option<PolygonTimes>,
    /// Position of the eye, world space, metres. Polygons that face the eye are turned to it, and soap films have the
    /// colours that it sees. A mesh cannot turn, so both are fixed in the file.
    pub eye_in_world: Option<Vec3>,
    /// The camera of the file.
    pub camera: Option<Camera>,
    /// The light and the background of the file.
    pub environment: Option<Environment>,
}
