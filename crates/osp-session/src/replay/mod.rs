//! Replay of a recorded session, frame by frame, with one or several indexes: pacing, cameras, fingerprints.
//!
//! [`Player::step`] plays a frame; [`Replay::step`] plays it in every [`Lane`]. Depends on [`recording`](crate::recording),
//! [`scene`](crate::scene) and all their dependencies, and [`frame`](osp::frame).

mod camera;
mod fingerprint;
mod lanes;
mod player;
mod rig_path;
mod root_cube;
mod summary;

pub use camera::{
    ArtistSide, CameraChoice, CameraPath, Moment, main_bounds, sees_most, still_view, whole_view,
};
pub use fingerprint::{SessionFingerprint, SetFingerprint, fingerprint_of_frame, fingerprint_of_views};
pub use lanes::{Budget, Lane, LaneFrame, PARTS_OF_SESSION, Replay, part_of_frame};
pub use player::{Player, SessionState};
pub use rig_path::{NEAREST_EYE_M, RigPath, RigView, RoomMotion, far_m};
pub use root_cube::root_cube;
pub use summary::{Summary, summarize, summarize_each};
