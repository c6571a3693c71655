//! The culler for engines, with the engine's own keys, boxes, occluders and cameras.
//!
//! [`Culler`] implements [`Geometry`](crate::polygon::Geometry) and does the work of a [`Pipeline`](crate::frame::Pipeline)
//! with [`occlusion`](crate::occlusion). Use those types directly for polygons in your own form, for groups that move as a
//! whole, or for another index. Depends on all other modules except [`frame`](crate::frame).

mod append;
mod camera;
#[expect(clippy::module_inception, reason = "a culler is a culler")]
mod culler;
mod filed;
mod frame;
mod hiding;
mod keys;
mod layers;
mod occluder;
pub mod oracle;
mod waiting;

pub use camera::{ALL_LAYERS, Camera, CameraError};
pub use culler::{Culler, Refusal};
pub use frame::{Frame, Seen};
pub use keys::{Dense, Key};
pub use occluder::{Occluder, OccluderError};
