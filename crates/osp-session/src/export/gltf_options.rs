use glam::Vec3;

use super::times::PolygonTimes;
use crate::recording::{Camera, Environment};

/// The part of the session that becomes one object of the exported file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objects {
    #[default]
    Layers,
    Strokes,
    /// The whole model, for viewers that need no editing. Brushes share materials, equal vertices are merged, and a
    /// vertex has neither time nor stroke.
    Whole {
        /// Whether the buffers are compressed (`EXT_meshopt_compression`). Needs the feature `compress`.
        is_compressed: bool,
    },
}

#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    pub objects: Objects,
    pub layer_names: Vec<String>,
    /// The times at which the polygons were drawn, if the file is to contain them.
    pub times: Option<PolygonTimes>,
    /// Position of the eye, world space, metres. In the file, polygons that face the eye face this position. The
    /// colours of soap films are computed for it, too.
    pub eye_in_world: Option<Vec3>,
    pub camera: Option<Camera>,
    /// The light and the background of the file.
    pub environment: Option<Environment>,
}
