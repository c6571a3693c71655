//! `metadata.json` of a `.tilt`: artists, brushes, layers and camera of the sketch, and the names of its external
//! media.
//!
//! The file must be a JSON object, and a table of brushes must be undamaged. Every other field is read separately: a
//! damaged field is skipped with a warning.

use std::path::PathBuf;

use glam::{Quat, Vec3};
use serde::Deserialize;

use super::{
    axes,
    bytes::ByteReader,
    tilt_environment,
    tilt_fields::{Fields, Listed, MOST_CHARS, TiltTransform, shorten},
    tilt_layout::METERS_PER_UNIT,
};
use crate::{
    brush,
    recording::{Author, Camera, Event, Header, Layer, Paint, error::Result},
};

/// Vertical field of view of the square thumbnail, degrees. The file does not contain it. This value matches the
/// pictures.
const THUMBNAIL_FOV_DEGREES: f32 = 80.0;
/// Near distance of the thumbnail, metres in room space.
const THUMBNAIL_NEAR_M: f32 = 0.01;
/// The program of a sketch that does not specify one.
const USUAL_PROGRAM: &str = "Tilt Brush";
/// Largest size of the metadata, bytes. Real metadata have a few thousand.
const MOST_BYTES: u64 = 16 << 20;
/// Largest number of characters of a name.
const MOST_NAME_CHARS: usize = 60;
/// Largest number of layers that are read. Further layers count as visible.
const MOST_LAYERS: usize = 1000;
/// Largest number of pictures, models and other media whose names are listed.
const MOST_NAMES: usize = 4;

/// Media that a sketch refers to without containing them: field, singular, plural.
const MEDIA: [(&str, &str, &str); 8] = [
    ("ModelIndex", "model", "models"),
    ("Models", "model", "models"),
    ("ImageIndex", "picture", "pictures"),
    ("Images", "picture", "pictures"),
    ("Videos", "video", "videos"),
    ("LightIndex", "placed light", "placed lights"),
    ("TextIndex", "text", "texts"),
    ("CameraPaths", "camera path", "camera paths"),
];

#[derive(Default)]
pub(super) struct Metadata {
    /// GUIDs of the brushes. A stroke stores the index of its brush.
    brushes: Vec<String>,
    text: String,
    /// Whether other bytes than UTF-8 are replaced in the text.
    is_mended: bool,
    path: PathBuf,
}

/// The camera field of some sketches of 2016.
#[derive(Deserialize)]
struct OldCamera {
    position: Vec3,
    orientation: Quat,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct TiltLayer {
    #[serde(default)]
    name: Option<String>,
    #[serde(default)]
    visible: Option<bool>,
}

/// A picture, a model or another medium; its name is in one of these fields.
#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Medium {
    #[serde(default)]
    file_path: Option<String>,
    #[serde(default)]
    file_name: Option<String>,
    #[serde(default)]
    asset_id: Option<String>,
}

impl Metadata {
    /// Reads the metadata. A damaged table of brushes is an error, or a warning if the reader is lenient.
    pub(super) fn read(mut bytes: ByteReader, is_lenient: bool, warnings: &mut Vec<String>) -> Result<Self> {
        let mut text = bytes.rest(MOST_BYTES, "metadata of at most 16 MiB")?;
        bytes.expect_end("the metadata")?;
        if text.starts_with(b"\xEF\xBB\xBF") {
            text.drain(..3);
        }
        let path = bytes.path.clone();
        let is_mended = str::from_utf8(&text).is_err();
        let text = String::from_utf8_lossy(&text).into_owned();
        let expected = "a list of the brushes' names in `BrushIndex`";
        let mut others = Vec::new();
        let brushes =
            match Fields::new(&text, &path, &mut others)?.value::<Vec<String>>("BrushIndex", expected) {
                Ok(brushes) => brushes.unwrap_or_default(),
                Err(error) if is_lenient => {
                    warnings.push(format!("{error}; read without it"));
                    Vec::new()
                }
                Err(error) => return Err(error),
            };
        Ok(Self { brushes, text, is_mended, path })
    }

    /// The names of the program and the artists.
    fn source(fields: &mut Fields<'_>) -> String {
        let mut source = fields.read("ApplicationName").unwrap_or_else(|| USUAL_PROGRAM.to_owned());
        if let Some(version) = fields.read::<String>("ApplicationVersion") {
            source.push(' ');
            source.push_str(&version);
        }
        if let Some(authors) = fields.read::<Vec<String>>("Authors").filter(|authors| !authors.is_empty()) {
            source.push_str(", drawn by ");
            source.push_str(&authors.join(" and "));
        }
        shorten(&source, MOST_CHARS)
    }

    /// Names of the brushes by their numbers in strokes; the GUID for an unknown brush.
    pub(super) fn brushes(&self) -> Vec<String> {
        let name = |guid: &String| match brush::find(guid) {
            Some(brush) => brush.name.clone(),
            None => guid[..guid.floor_char_boundary(Paint::MAX_NAME_BYTES)].to_owned(),
        };
        self.brushes.iter().map(name).collect()
    }

    /// Sets source, camera, layers, light, list of missing contents and metadata text in the header.
    pub(super) fn fill(&self, header: &mut Header, warnings: &mut Vec<String>) {
        if self.text.is_empty() {
            USUAL_PROGRAM.clone_into(&mut header.source);
            return;
        }
        let Ok(mut fields) = Fields::new(&self.text, &self.path, warnings) else { return };
        header.source = Self::source(&mut fields);
        let scene_from_canvas = fields.transform("CanvasTransformInSceneSpace");
        let room_from_scene = fields.transform("SceneTransformInRoomSpace");
        header.camera =
            room_from_scene.zip(scene_from_canvas).and_then(|(room_from_scene, scene_from_canvas)| {
                camera(&mut fields, room_from_scene, scene_from_canvas)
            });
        let [room_from_scene, scene_from_canvas] =
            [room_from_scene, scene_from_canvas].map(|found| found.unwrap_or(TiltTransform::IDENTITY));
        header.layers = layers(&mut fields);
        header.environment =
            tilt_environment::read(&mut fields, room_from_scene, scene_from_canvas, &mut header.left_out)
                .map(Box::new);
        for (field, one, many) in MEDIA {
            header.left_out.extend(fields.read(field).and_then(|media| sentence(&media, one, many)));
        }
        let is_kept = !self.is_mended && self.text.len() <= Header::MAX_METADATA_BYTES;
        header.sketch_metadata = is_kept.then(|| self.text.clone());
        if header.sketch_metadata.is_none() {
            fields.warnings.push(format!(
                "{}: expected UTF-8 of at most {} bytes; found {}; a .tilt that is written from this session lacks its \
                 palette, media and camera paths",
                self.path.display(),
                Header::MAX_METADATA_BYTES,
                if self.is_mended { "other bytes" } else { "more" },
            ));
        }
    }
}

/// The thumbnail's camera in canvas space and the axes of osp. `None` if the file has none, or (with a warning) an
/// unusable one.
fn camera(
    fields: &mut Fields<'_>,
    room_from_scene: TiltTransform,
    scene_from_canvas: TiltTransform,
) -> Option<Camera> {
    let TiltTransform(p, q, _) = fields.read("ThumbnailCameraTransformInRoomSpace").or_else(|| {
        let OldCamera { position, orientation } = fields.read("ThumbnailCameraTransform")?;
        Some(TiltTransform(position, orientation, 1.0))
    })?;
    let (p, q) = room_from_scene.take_back(p, q);
    let (p, q) = scene_from_canvas.take_back(p, q);
    let (p, q) = (axes::position_from_unity(p * METERS_PER_UNIT), axes::rotation_from_unity(axes::unit(q)));
    if let Err(expected) = (Event::Head { author: Author::SOLE, t: 0.0, p, q }).check() {
        fields.warn(format_args!("expected {expected} of the thumbnail's camera; found {p} m and {q}"));
        return None;
    }
    // The near distance is divided by the canvas's scale in the room.
    let near_m = THUMBNAIL_NEAR_M / (room_from_scene.2 * scene_from_canvas.2);
    let near_m = Some(near_m).filter(|near_m| (1.0e-5..=1.0).contains(near_m));
    Some(Camera { p, q, fov_degrees: THUMBNAIL_FOV_DEGREES, near_m })
}

fn layers(fields: &mut Fields<'_>) -> Vec<Layer> {
    let Some(layers) = fields.read::<Listed<TiltLayer, MOST_LAYERS>>("Layers") else { return Vec::new() };
    if layers.count > layers.first.len() {
        fields.warn(format_args!("expected at most {MOST_LAYERS} layers; found {}", layers.count));
    }
    let layer = |layer: TiltLayer| Layer {
        name: shorten(&layer.name.unwrap_or_default(), MOST_NAME_CHARS),
        hidden: layer.visible == Some(false),
    };
    layers.first.into_iter().map(layer).collect()
}

/// The number of media and the names of the first ones, as text.
fn sentence(media: &Listed<Medium, MOST_NAMES>, one: &str, many: &str) -> Option<String> {
    if media.count == 0 {
        return None;
    }
    let mut names: Vec<String> = media.first.iter().filter_map(Medium::name).collect();
    if media.count > media.first.len() && !names.is_empty() {
        names.push("…".to_owned());
    }
    let names = if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) };
    Some(format!("{} {}{names}", media.count, if media.count == 1 { one } else { many }))
}

impl Medium {
    /// Name of the medium, without its folders.
    fn name(&self) -> Option<String> {
        let name = self.file_path.as_ref().or(self.file_name.as_ref()).or(self.asset_id.as_ref())?;
        Some(shorten(name.rsplit(['/', '\\']).next()?, MOST_NAME_CHARS))
    }
}
