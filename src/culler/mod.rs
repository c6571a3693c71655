//! The culler for engines, with the engine's own keys, boxes, occluders and cameras.
//!
//! ```text
//! set, remove ─> pending.rs ─ commit ─> indexed.rs: ids, index ─ cull ─> frustum ─> hiding.rs: occlusion ─> frame.rs: keys
//! ```
//!
//! The culler does not use [`Pipeline`](crate::frame::Pipeline). Use a pipeline instead for polygons in your own form,
//! for groups that move as a whole, or for another index. Depends on all other modules except [`frame`](crate::frame).

mod append;
mod camera;
#[expect(clippy::module_inception, reason = "a culler is a culler")]
mod culler;
mod frame;
mod hiding;
mod indexed;
mod keys;
mod layers;
mod occluder;
pub mod oracle;
mod pending;

pub use crate::occlusion::OcclusionReport;
pub use camera::{ALL_LAYERS, Camera, CameraError};
pub use culler::{Culler, Refusal};
pub use frame::{Frame, Seen};
pub use keys::{Dense, Key};
pub use occluder::{Occluder, OccluderError};
