//! The culler for engines, with the engine's own keys, boxes, occluders and cameras.
//!
//! ```text
//! set, remove ─> keys.rs: number ─> objects.rs: index ─ cull ─> frustum ─> hiding.rs: occlusion ─> view.rs: keys
//! ```
//!
//! The culler does not use [`Pipeline`](crate::frame::Pipeline). Use a pipeline instead for polygons in your own form,
//! for groups that move as a whole, or for another index. Depends on all other modules except [`frame`](crate::frame).

mod append;
mod camera;
#[expect(clippy::module_inception, reason = "a culler is a culler")]
mod culler;
mod detail;
mod hiding;
mod keys;
mod layers;
mod objects;
mod occluder;
pub mod oracle;
mod query;
mod view;

pub use crate::occlusion::OcclusionReport;
pub use camera::{ALL_LAYERS, Camera, CameraError};
pub use culler::{Culler, Refusal};
pub use detail::Detail;
pub use keys::{Dense, Handle, Key};
pub use occluder::{Occluder, OccluderError};
pub use query::Query;
pub use view::{Frame, Seen, ViewState};
