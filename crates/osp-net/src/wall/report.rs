//! The state of a wall, which its hub sends on request.

use std::path::PathBuf;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use super::{WallError, message, wire};
use crate::live::Address;

/// Whether a screen has a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// No node shows the screen.
    #[default]
    Absent,
    /// There is one, and it is not waited for.
    Out,
    /// Frames wait for it.
    In,
}

impl Place {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::Out => "out",
            Self::In => "in",
        }
    }
}

/// Times of many frames, microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Times {
    /// Number of values.
    pub count: u64,
    /// Half of them took at most this.
    pub p50_us: u64,
    /// 99 of 100.
    pub p99_us: u64,
    /// The longest.
    pub max_us: u64,
}

impl Times {
    pub(super) fn of(histogram: &Histogram<u64>) -> Self {
        Self {
            count: histogram.len(),
            p50_us: histogram.value_at_quantile(0.5),
            p99_us: histogram.value_at_quantile(0.99),
            max_us: histogram.max(),
        }
    }
}

/// The node of a screen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeReport {
    /// The screen.
    pub screen: String,
    /// State of the screen's node.
    pub place: Place,
    /// The machine.
    pub host: String,
    /// From the hub's frame to the node's answer, both by the hub's clock.
    pub ready: Times,
    /// Events of the session that the hub has applied and the node had not, at its last message.
    pub behind: u64,
    /// Frames that were shown without its answer.
    pub missed: u64,
    /// Number of times that it was left out.
    pub dropped: u64,
    /// Answers that differed from the hub's own.
    pub differed: u64,
    /// Differing part of its last answer.
    pub difference: Option<String>,
}

/// Counts of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NodeCounts {
    /// Frames that it has drawn.
    pub frames: u64,
    /// Events of the session that it has applied.
    pub events: u64,
    /// Messages that no hub means to send.
    pub garbage: u64,
}

/// See the [module](self).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WallReport {
    /// The session.
    pub session: String,
    /// The rig's name.
    pub rig: String,
    /// Error of the connection to the session.
    pub trouble: Option<String>,
    /// Frames a second set for the hub.
    pub rate_hz: f64,
    /// Frames of the last second.
    pub frames_a_second: f64,
    /// Frames since the hub has started.
    pub frames: u64,
    /// Events of the session that the last frame shows.
    pub events: u64,
    /// Polygons of the model that are shown.
    pub polygons: u64,
    /// Messages that nobody of a wall means to send.
    pub garbage: u64,
    /// From a frame's beginning to the word to show it.
    pub frame: Times,
    /// Between two words to show a frame.
    pub period: Times,
    /// Between the first and the last node's word that they show a frame, by the hub's clock: the way of these words is part
    /// of it.
    pub skew: Times,
    /// A node for each screen of the rig.
    pub nodes: Vec<NodeReport>,
}

impl WallReport {
    /// Whether the session exists, and every screen has an active node with the hub's picture.
    pub fn is_well(&self) -> bool {
        let is_well = |node: &NodeReport| node.place == Place::In && node.difference.is_none();
        self.trouble.is_none() && self.nodes.iter().all(is_well)
    }
}

/// Requests the state of a wall from its hub.
///
/// # Errors
/// There is no server, or no hub that answers within two seconds, or its answer is none.
pub fn ask(address: &Address, certificates: Option<PathBuf>) -> Result<WallReport, WallError> {
    let session = address.session().to_owned();
    let answer = wire::ask(address, certificates, Duration::from_secs(2))?;
    let Some(answer) = answer else { return Err(WallError::NoHub { session }) };
    message::read(&answer).map_err(|why| WallError::NoReport { session, why })
}
