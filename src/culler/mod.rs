//! The culler for engines, with the engine's own keys, boxes, occluders and cameras.
//!
//! [`Culler`] provides the data that [`Geometry`](crate::polygon::Geometry), [`Pipeline`](crate::frame::Pipeline) and
//! the structures of [`occlusion`](crate::occlusion) need. Use those directly for polygons in your own form, for
//! groups that move as a whole, or for another index. Depends on all other modules but [`frame`](crate::frame).

mod camera;
#[expect(clippy::module_inception, reason = "a culler is a culler")]
mod culler;
mod filed;
mod frame;
mod hiding;
mod keys;
mod layers;
mod occluder;
mod oracle;
mod waiting;

pub use camera::{ALL_LAYERS, Camera, CameraError, Depth};
pub use culler::{Culler, Refusal};
pub use frame::{Frame, Seen};
pub use keys::{Dense, Key};
pub use occluder::{Occluder, OccluderError};
pub use oracle::{Missing, Oracle, OracleError};
