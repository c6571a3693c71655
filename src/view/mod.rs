//! An eye and the view through its screen.
//!
//! [`View`] provides the frustum for the index query and the [`ViewWindow`] for occlusion culling. Depends on
//! [`math`](crate::math) only.

pub(crate) mod matrix;
#[expect(clippy::module_inception, reason = "a view is a view")]
mod view;
mod view_window;

pub use view::{Projection, View};

// For occlusion culling. They change without notice.
#[doc(hidden)]
pub use self::{view::WINDOW_MARGIN, view_window::ViewWindow};
