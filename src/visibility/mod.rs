//! From the model and an eye to the polygons worth drawing: views, cameras of a replay, and the frame itself.
//!
//! [`Pipeline::frame`] is the whole frame; everything else here prepares its arguments.

mod camera;
mod frame;
mod last_pass;
mod occlusion_pass;
pub mod pvs;
mod reach;
mod replay;
mod rig;
pub mod verify;
mod view;

pub use camera::{ArtistSide, CameraChoice, CameraPath, Moment, whole_view};
pub use frame::Pipeline;
pub use last_pass::LastPass;
pub use occlusion_pass::{AutoBasis, OcclusionChoice, OcclusionPass, PassConfig};
pub use reach::{Reach, lost_polygons};
pub use replay::{Budget, Lane, LaneFrame, Replay, STRETCHES, stretch_of_frame};
pub use rig::{Eye, MAX_SCREENS, Rig, RigError, Screen, Stereo};
pub use view::{Projection, View, WINDOW_MARGIN};
