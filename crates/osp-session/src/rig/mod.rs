//! Several screens around tracked eyes, as in a CAVE or in front of a stereo projector.

mod calibration;
mod output;
#[expect(clippy::module_inception, reason = "a rig is a rig")]
mod rig;
mod room_place;
mod stereo;

pub use calibration::{Calibration, RoomFromTracker};
pub use output::{Eyes, Output, Viewport};
pub use rig::{Rig, RigError, Screen};
pub use room_place::RoomPlace;
pub use stereo::{Eye, Stereo};
