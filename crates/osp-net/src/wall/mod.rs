//! A wall of several machines that show one moment of one shared session: a hub chooses the moment, and the time to
//! show it.
//!
//! A node is a machine with one screen of a [rig](osp_session::rig::Rig). The hub and every node read the same log of
//! a [shared session](crate::live). So a frame consists only of a position in that log and the views:
//!
//! ```text
//! hub: frame n: the first S events, the views of all screens ───────────────────> nodes
//! node: applies exactly S events, culls, draws, waits for its GPU: ready n ─────> hub
//! hub: all nodes are ready, or the time is over: swap n ────────────────────────> nodes
//! node: shows its picture: shown n ─────────────────────────────────────────────> hub
//! ```
//!
//! The hub has the model, too, and culls the views of every screen as its node does. With its answer a node sends a
//! hash of the applied events and a fingerprint of its visible polygons. The hub [reports](Said::Differs) a node whose
//! numbers differ from its own. A node that misses [three frames](MISSES) is left out, so that the others continue. It
//! is let in again once it answers in time. `Barrier` decides all of that; it has no clock and no network.
//!
//! Displays are not locked to each other. The graphics driver makes every display show its picture at the same refresh
//! (genlock, swap groups): wgpu has no interface to it.

mod barrier;
mod follower;
mod hub;
mod message;
mod node;
mod report;
mod wire;

pub use barrier::{MISSES, Said};
pub use hub::{Hub, HubOptions};
pub use node::{Node, NodeOptions, Step};
pub use report::{NodeCounts, NodeReport, Place, Times, WallReport, ask};

use thiserror::Error;

use crate::live::LiveError;

/// Why a wall stops.
#[derive(Debug, Error)]
pub enum WallError {
    /// There is no shared session to be had.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// The system gives no thread or socket.
    #[error("no connection can be begun")]
    System(#[source] std::io::Error),
    /// The rig has no screen of this name.
    #[error("expected a screen of the rig `{rig}` ({there}); found `{wanted}`")]
    NoScreen {
        /// The rig.
        rig: String,
        /// The names of its screens.
        there: String,
        /// The requested screen.
        wanted: String,
    },
    /// The hub does not let this node in.
    #[error("the hub does not let this node in: {0}")]
    Refused(String),
    /// There is no server.
    #[error("{server}: {why}")]
    NoServer {
        /// The server.
        server: String,
        /// Why.
        why: String,
    },
    /// Another hub shows the session already.
    #[error("{session}: another hub shows this session: expected one (osp wall status prints it)")]
    SecondHub {
        /// The session.
        session: String,
    },
    /// No hub answers.
    #[error("{session}: no hub answers (osp wall --hub)")]
    NoHub {
        /// The session.
        session: String,
    },
    /// An answer that is none.
    #[error("{session}: expected the state of a wall; found something else: {why}")]
    NoReport {
        /// The session.
        session: String,
        /// Reason.
        why: String,
    },
}
