//! A wall of several computers that show the same state of a shared session. A hub determines how many events each
//! frame shows, and when the frame is shown.
//!
//! Each computer ([`Node`]) shows one screen of a [rig](osp_session::rig::Rig). The hub and every computer read the
//! same log of a [shared session](crate::live). Therefore a frame consists only of a position in this log and the
//! views:
//!
//! ```text
//! hub: frame n: the first S events, the views of all screens ───────────────────> computers
//! computer: applies exactly S events, culls, draws, waits for its GPU: ready n ─> hub
//! hub: all computers are ready, or the time is over: swap n ────────────────────> computers
//! computer: shows its picture: shown n ─────────────────────────────────────────> hub
//! ```
//!
//! The hub has the model, too, and culls the views of every screen as the screen's computer does. A computer answers
//! with a hash of the applied events and a fingerprint of its visible polygons. The hub [reports](HubEvent::Differs) a
//! computer whose hashes differ from its own. If a computer misses [three frames](MISSES), the hub does not wait for it
//! any more, so that the other computers continue. The hub waits for this computer again once it answers in time.
//! `Barrier` makes these decisions; it has no clock and no network.
//!
//! Displays are not locked to each other. Graphics drivers can make all displays show their pictures at the same refresh
//! (genlock, swap groups), but wgpu has no interface for this.

mod barrier;
mod follower;
mod hub;
mod hub_event;
mod message;
mod node;
mod report;
mod wire;

pub use barrier::MISSES;
pub use hub::{Hub, HubOptions};
pub use hub_event::HubEvent;
pub use node::{Node, NodeOptions, Step};
pub use report::{NodeCounts, NodeReport, Place, Times, WallReport, ask};

use thiserror::Error;

use crate::live::LiveError;

/// The reason why a wall stops.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "their messages describe them")]
pub enum WallError {
    /// The connection to the shared session has failed.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// The system provides no thread or socket.
    #[error("no connection can be begun")]
    System(#[source] std::io::Error),
    /// The rig has no screen of this name.
    #[error("expected a screen of the rig `{rig}` ({there}); found `{wanted}`")]
    NoScreen { rig: String, there: String, wanted: String },
    /// The hub refuses this computer.
    #[error("the hub does not let this computer in: {0}")]
    Refused(String),
    /// The server does not answer.
    #[error("{server}: {why}")]
    NoServer { server: String, why: String },
    /// Another hub shows the session already.
    #[error("{session}: another hub shows this session: expected one (osp wall status prints it)")]
    SecondHub { session: String },
    /// No hub answers.
    #[error("{session}: no hub answers (osp wall --hub)")]
    NoHub { session: String },
    /// The hub's answer is no report.
    #[error("{session}: expected the state of a wall; found something else: {why}")]
    NoReport { session: String, why: String },
}
