//! An eye and what its screen shows.
//!
//! [`View`] gives the frustum that an index is asked with and the [`ViewWindow`] that occlusion is culled for. Knows
//! [`math`](crate::math) only.

mod matrix;
#[expect(clippy::module_inception, reason = "a view is a view")]
mod view;
mod view_window;

pub use matrix::ClipDepth;
pub use view::{Projection, View, WINDOW_MARGIN};
pub use view_window::ViewWindow;
