use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    Environment,
    event::{check_point, check_pose},
};
use osp::math::COORDINATE_LIMIT_M;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Format number; see [`FORMAT_VERSION`](super::FORMAT_VERSION).
    pub format: u32,
    #[serde(default)]
    pub name: String,
    /// Origin of the session: a program, a file, or a generator with its arguments.
    #[serde(default)]
    pub source: String,
    /// The modelling volume, if it is specified. Polygons outside it are allowed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub root: Option<Root>,
    /// A view that the session's author chose (the thumbnail camera of a Tilt Brush sketch).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// Light and background, if the session specifies them (since format 2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<Box<Environment>>,
    /// The layers; strokes refer to them by index. An empty list means a single visible layer (since format 2).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Layer>,
    /// Descriptions of source contents that a recording cannot represent: pictures, models, videos (since format 2).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// `metadata.json` of the Tilt Brush or Open Brush sketch that the session comes from, unchanged.
    /// [`write_tilt`](crate::export::write_tilt) writes it back, including the palette, media and camera paths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sketch_metadata: Option<String>,
}

impl Header {
    /// Largest size of [`sketch_metadata`](Self::sketch_metadata), bytes; larger metadata are dropped. Real metadata
    /// have up to 3,000 bytes.
    pub const MAX_METADATA_BYTES: usize = 1 << 18;

    /// A header of format 2, the oldest format with environments, layers and brushes.
    pub fn new(name: impl Into<String>, source: impl Into<String>) -> Self {
        Self { format: 2, name: name.into(), source: source.into(), ..Self::default() }
    }

    /// Checks that every number is in its range. The error describes the expected form.
    ///
    /// # Errors
    /// A number is not finite or out of its range.
    pub fn check(&self) -> Result<(), &'static str> {
        if let Some(root) = self.root {
            check_point(root.center)?;
            if !(root.size > 0.0 && root.size <= COORDINATE_LIMIT_M) {
                return Err("a root with a size above 0, at most 1e15 m");
            }
        }
        if let Some(camera) = self.camera {
            camera.check()?;
        }
        self.environment.as_ref().map_or(Ok(()), |environment| environment.check())
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    #[serde(default)]
    pub name: String,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
}

/// The root cube of a session, world space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Root {
    pub center: Vec3,
    /// Edge length, metres.
    pub size: f32,
}

/// A camera pose with a vertical field of view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Position of the eye, world space.
    pub p: Vec3,
    /// Rotation from the camera, which looks along its -z, to world space.
    pub q: Quat,
    /// Vertical field of view, degrees.
    pub fov_degrees: f32,
    /// Near distance, metres along the camera's axis. If absent, the program that shows the recording chooses the
    /// distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_m: Option<f32>,
}

impl Camera {
    /// Checks that every number is in its range; the error describes the expected form.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        check_pose(self.p, self.q)?;
        if !(self.fov_degrees > 0.0 && self.fov_degrees < 180.0) {
            return Err("a field of view between 0 and 180 degrees");
        }
        if !self.near_m.is_none_or(|near_m| near_m > 0.0 && near_m <= COORDINATE_LIMIT_M) {
            return Err("a near distance above 0, at most 1e15 m");
        }
        Ok(())
    }
}
