//! The state of a wall, which the hub sends on request.

use std::path::PathBuf;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use super::{WallError, message, wire};
use crate::live::Address;

/// The state of the computer that draws a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// No computer shows the screen.
    #[default]
    Absent,
    /// The screen has a computer, but the hub does not wait for this computer.
    Out,
    /// In each frame the hub waits for the screen's computer.
    In,
}

impl Place {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::Out => "out",
            Self::In => "in",
        }
    }
}

/// Statistics of measured times, microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Times {
    /// Number of values.
    pub count: u64,
    /// Median.
    pub p50_us: u64,
    /// 99th percentile.
    pub p99_us: u64,
    /// Longest time.
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

/// The state of a screen's computer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeReport {
    /// The screen.
    pub screen: String,
    /// State of the screen's computer.
    pub place: Place,
    /// The machine.
    pub host: String,
    /// Time from the hub's frame to the computer's answer, both by the hub's clock.
    pub ready: Times,
    /// Number of events of the session that the hub has applied and the computer had not applied at its last message.
    pub behind: u64,
    /// Number of frames that were shown without the computer's answer.
    pub missed: u64,
    /// Number of times that the hub stopped waiting for the computer.
    pub dropped: u64,
    /// Number of answers that differed from the hub's own answer.
    pub differed: u64,
    /// The part of the computer's last answer that differs.
    pub difference: Option<String>,
}

/// Counts of a computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NodeCounts {
    /// Number of frames that the computer has drawn.
    pub frames: u64,
    /// Number of events of the session that the computer has applied.
    pub events: u64,
    /// Number of messages that are not valid messages of a hub.
    pub garbage: u64,
}

/// The state of a wall; see the [module](self).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WallReport {
    /// The session.
    pub session: String,
    /// The rig's name.
    pub rig: String,
    /// The last error of the connection to the session.
    pub trouble: Option<String>,
    /// Largest number of frames a second, as set for the hub.
    pub rate_hz: f64,
    /// Number of frames of the last second.
    pub frames_a_second: f64,
    /// Number of frames since the hub has started.
    pub frames: u64,
    /// Number of events of the session that the last frame shows.
    pub events: u64,
    /// Number of polygons of the shown model.
    pub polygons: u64,
    /// Number of invalid messages.
    pub garbage: u64,
    /// Time from a frame's beginning to the command to show it.
    pub frame: Times,
    /// Time between two commands to show a frame.
    pub period: Times,
    /// Time between the first and the last computer's message about showing a frame, by the hub's clock. The transfer
    /// of these messages is included.
    pub skew: Times,
    /// A computer for each screen of the rig.
    pub nodes: Vec<NodeReport>,
}

impl WallReport {
    /// Whether the connection has no error, and every screen has a computer that the hub waits for and that shows the
    /// hub's picture.
    pub fn is_well(&self) -> bool {
        let is_well = |node: &NodeReport| node.place == Place::In && node.difference.is_none();
        self.trouble.is_none() && self.nodes.iter().all(is_well)
    }
}

/// Requests the state of a wall from its hub.
///
/// # Errors
/// The server does not answer, no hub answers within two seconds, or the answer is no report.
pub fn ask(address: &Address, certificates: Option<PathBuf>) -> Result<WallReport, WallError> {
    let session = address.session.to_owned();
    let answer = wire::ask(address, certificates, Duration::from_secs(2))?;
    let Some(answer) = answer else { return Err(WallError::NoHub { session }) };
    message::read(&answer).map_err(|why| WallError::NoReport { session, why })
}
