//! A recorded session, played frame by frame through one or several indexes: pacing, cameras, fingerprints.
//!
//! [`Replay::step`] plays a frame in every [`Lane`]. Knows [`recording`](crate::recording), [`scene`](crate::scene) and all
//! that they know, and [`frame`](crate::frame).

mod camera;
mod fingerprint;
mod lanes;
mod summary;

pub use camera::{ArtistSide, CameraChoice, CameraPath, Moment, whole_view};
pub use fingerprint::{SessionFingerprint, fingerprint_of_frame, fingerprint_of_views};
pub use lanes::{Budget, Lane, LaneFrame, Replay, STRETCHES, stretch_of_frame};
pub use summary::{Summary, summarize};
