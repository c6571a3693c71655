//! An eye and what its screen shows.
//!
//! [`View`] gives the frustum that an index is asked with and the [`ViewWindow`] that occlusion is culled for; a `Rig`
//! is several screens around tracked eyes. Knows [`math`](crate::math) only.

mod matrix;
#[cfg(feature = "session")]
mod rig;
#[cfg(feature = "session")]
mod room_place;
#[expect(clippy::module_inception, reason = "a view is a view")]
mod view;
mod view_window;

pub use matrix::ClipDepth;
#[cfg(feature = "session")]
pub use rig::{Eye, Rig, RigError, Screen, Stereo};
#[cfg(feature = "session")]
pub use room_place::RoomPlace;
pub use view::{Projection, View, WINDOW_MARGIN};
pub use view_window::ViewWindow;
