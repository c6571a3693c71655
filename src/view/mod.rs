//! An eye and what its screen shows.
//!
//! [`View`] gives the frustum that an index is asked with and the [`ViewWindow`] that occlusion is culled for; a `Rig`
//! is several screens around tracked eyes. Knows [`math`](crate::math) only.

#[cfg(feature = "session")]
mod calibration;
mod matrix;
#[cfg(feature = "session")]
mod output;
#[cfg(feature = "session")]
mod rig;
#[cfg(feature = "session")]
mod room_place;
#[cfg(feature = "session")]
mod stereo;
#[expect(clippy::module_inception, reason = "a view is a view")]
mod view;
mod view_window;

#[cfg(feature = "session")]
pub use calibration::{Calibration, RoomFromTracker};
pub use matrix::ClipDepth;
#[cfg(feature = "session")]
pub use output::{Eyes, Output, Viewport};
#[cfg(feature = "session")]
pub use rig::{Rig, RigError, Screen};
#[cfg(feature = "session")]
pub use room_place::RoomPlace;
#[cfg(feature = "session")]
pub use stereo::{Eye, Stereo};
pub use view::{Projection, View, WINDOW_MARGIN};
pub use view_window::ViewWindow;
