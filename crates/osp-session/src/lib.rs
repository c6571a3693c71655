//! Recorded sketching sessions: strokes of a tracked hand, stored in files, converted to polygons and replayed frame by
//! frame.
//!
//! ```text
//! a file ──> recording (events) ──> stroke (polygons) ──> scene (a Geometry of osp) ──> replay (frames of osp)
//! ```
//!
//! | module | contents |
//! | --- | --- |
//! | [`recording`] | events, their files, importers, synthetic sessions |
//! | [`brush`] | the brushes: polygons and appearance of strokes |
//! | [`stroke`] | samples become polygons |
//! | [`scene`] | strokes, groups, undo; implements [`Geometry`](osp::polygon::Geometry) |
//! | [`rig`] | several screens around tracked eyes |
//! | [`replay`] | a session frame by frame: pacing, cameras, fingerprints |
//! | [`export`] | binary glTF, `.tilt` |
//! | [`atomic_file`], [`output_file`], [`small_file`], [`platform`] | files, on a disk and on a page |

#![allow(
    missing_docs,
    reason = "a name without a comment says all: no unit, space, bound or error is to add"
)]

#[cfg_attr(target_arch = "wasm32", path = "platform/web_atomic_file.rs")]
pub mod atomic_file;
pub mod brush;
pub mod export;
pub mod output_file;
pub mod platform;
pub mod recording;
pub mod replay;
pub mod rig;
pub mod scene;
pub mod small_file;
pub mod stroke;

/// Whether a field of a file has its usual value. Such fields are not written.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
