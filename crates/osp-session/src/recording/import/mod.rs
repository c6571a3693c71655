//! Readers of foreign session formats, each an [`EventSource`](super::EventSource) in our axes and units
//! (right-handed, +y up, -z forward, metres).
//!
//! | function | format | orientation of a ribbon |
//! |---|---|---|
//! | [`open_tilt`] | Tilt Brush and Open Brush `.tilt`, a zip or a folder | direction of travel |
//! | [`open_apa`] | A-Painter `.apa` | local x spans the ribbon |
//! | [`open_cassie`] | CASSIE `sketch_history` and `raw_data` json, one or both | none was recorded |
//! | [`open_poses`] | tracker poses, one a line | local x is the normal |
//! | [`open_obj`] | Wavefront `.obj` and `.obj.gz`: finished polygons | |
//! | [`open_gltf`] | glTF 2.0 `.glb` and `.gltf`: finished polygons in nested groups | |
//!
//! Every reader but CASSIE's and glTF's works from a stream and holds no more than the piece it decodes (an `.obj`
//! must keep its vertices). Readers do not trust the counts that a file states: memory grows only with bytes that were
//! read.
//!
//! # Damage
//! The events before the damage are delivered, then one error that names the byte or line and what was expected
//! there. A lenient reader notes it instead: a binary format or one JSON document ends there, a line format continues with
//! the next line.

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
mod poses;
mod session_name;
mod strokes;
mod tilt;
pub(crate) mod tilt_environment;
mod tilt_fields;
pub(crate) mod tilt_layout;
mod tilt_metadata;

pub(super) use apa::open_apa;
pub(super) use cassie::open_cassie;
pub(super) use detect::{FORMATS, by_mark, by_name};
pub(super) use gltf::open_gltf;
pub(super) use obj::open_obj;
pub(super) use poses::open_poses;
pub(super) use tilt::open_tilt;

use std::path::Path;

pub use tilt::tilt_thumbnail;

/// The other files that a session of this name is read from.
pub fn files_beside(path: &Path) -> Vec<std::path::PathBuf> {
    let is_gltf = path
        .extension()
        .is_some_and(|ending| ["glb", "gltf"].iter().any(|known| ending.eq_ignore_ascii_case(known)));
    if is_gltf { gltf::buffers_beside(path) } else { cassie::files_beside(path) }
}
