//! Readers of the session formats of other programs. Each reader is an [`EventSource`](super::EventSource) in the axes
//! and units of osp (right-handed, +y up, -z forward, metres).
//!
//! | function | format | orientation of a ribbon |
//! |---|---|---|
//! | [`open_tilt`] | Tilt Brush and Open Brush `.tilt`, a zip or a folder | direction of travel |
//! | [`open_apa`] | A-Painter `.apa` | local x spans the ribbon |
//! | [`open_json`] | CASSIE `sketch_history` and `raw_data` json, one or both | none was recorded |
//! | [`open_poses`] | tracker poses, one a line | local x is the normal |
//! | [`open_obj`] | Wavefront `.obj` and `.obj.gz`: finished polygons | |
//! | [`open_gltf`] | glTF 2.0 `.glb` and `.gltf`: finished polygons in nested groups | |
//!
//! All readers except those of CASSIE and glTF decode a stream. They hold only the current stroke or line in memory;
//! the `.obj` reader also holds the vertices. No reader allocates memory by a count that a file states, so memory grows
//! only with the bytes that were read.
//!
//! # Damage
//! A reader returns the events before the damage, then one error with the byte or line and the expected form. A lenient
//! reader adds the error to its notes. It then ends in binary formats and JSON, and continues with the next line in
//! text formats.

mod apa;
mod archive;
pub(crate) mod axes;
mod bytes;
mod cassie;
mod cassie_json;
mod detect;
mod gltf;
mod lines;
mod obj;
mod obj_material;
mod paint;
mod poses;
mod strokes;
mod texture;
mod tilt;
pub(crate) mod tilt_environment;
mod tilt_fields;
pub(crate) mod tilt_layout;
mod tilt_metadata;

pub(super) use apa::open_apa;
pub(super) use cassie::open_json;
pub(super) use detect::{FORMATS, by_contents, by_name};
pub(super) use gltf::open_gltf;
pub(super) use lines::BYTE_ORDER_MARK;
pub(super) use obj::open_obj;
pub(super) use poses::open_poses;
pub(super) use tilt::open_tilt;

use std::path::Path;

use glam::DVec3;

pub use tilt::tilt_thumbnail;

/// The other files that are part of the session at `path`.
pub fn files_beside(path: &Path) -> Vec<std::path::PathBuf> {
    let is_any =
        |endings: &[&str]| endings.iter().any(|ending| crate::platform::fs::has_ending(path, ending));
    match (is_any(&[".glb", ".gltf"]), is_any(&[".obj", ".obj.gz"])) {
        (true, _) => gltf::files_beside(path),
        (_, true) => obj_material::files_beside(path),
        _ => cassie::files_beside(path),
    }
}

/// The name of a group, as far as a recording can hold it.
fn group_name(name: &str) -> String {
    let most = crate::recording::Event::MAX_GROUP_NAME_BYTES;
    let end = (0..=name.len().min(most)).rev().find(|&end| name.is_char_boundary(end));
    name[..end.unwrap_or_default()].to_owned()
}

/// Distance from the origin from which `f32` no longer holds millimetres, metres.
const FAR_M: f64 = 8192.0;

/// The point, in whole metres, that becomes the origin of a model with this box: its middle, if the model lies far away
/// and does not surround the origin.
fn origin_of(min: DVec3, max: DVec3) -> DVec3 {
    let middle = (min + max) * 0.5;
    let is_far =
        middle.abs().max_element() >= FAR_M && (min.cmpgt(DVec3::ZERO) | max.cmplt(DVec3::ZERO)).any();
    if is_far { middle.round() } else { DVec3::ZERO }
}

/// What `osp info` says of a model that was moved.
fn far_from_origin(origin: DVec3) -> Option<String> {
    let DVec3 { x, y, z } = origin;
    (origin != DVec3::ZERO).then(|| {
        format!("the model's distance from the origin: its point ({x} {y} {z}) m lies at the origin here")
    })
}

/// The name that a session gets from its file: the file's name without its extensions.
fn session_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(".gz").unwrap_or(&name);
    stem.rsplit_once('.').map_or(stem, |(stem, _)| stem).to_owned()
}
