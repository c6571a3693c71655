//! Counts of a member of a shared session.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Counts of one member since it has connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Number of accepted messages.
    pub messages: u64,
    /// Number of events in these messages.
    pub events: u64,
    /// Number of these messages that this member has sent.
    pub own_messages: u64,
    /// Number of messages that came a second time.
    pub duplicates: u64,
    /// Number of messages with a missing predecessor of the same sender.
    pub gaps: u64,
    /// Number of messages of senders that have not joined, or have left.
    pub strangers: u64,
    /// Number of messages that cannot be read.
    pub garbage: u64,
    /// Number of messages with impossible events.
    pub refused: u64,
    /// Number of messages beyond the sender's rate, or beyond the size of the session.
    pub beyond_limits: u64,
    /// Number of this member's messages that were sent again.
    pub resent: u64,
    /// Number of times that the log was requested again, from the last message read.
    pub reopened: u64,
    /// Number of connections to the server, including the first connection.
    pub connections: u64,
}

impl Counts {
    /// Number of messages that were not accepted.
    pub fn ignored(&self) -> u64 {
        self.duplicates + self.gaps + self.faulty()
    }

    /// Number of messages that no correct member sends: all ignored messages except duplicates and gaps.
    pub fn faulty(&self) -> u64 {
        self.strangers + self.garbage + self.refused + self.beyond_limits
    }
}

/// Times of this member's messages to the server and back, microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Latency {
    pub messages: u64,
    /// Median.
    pub p50_us: u64,
    /// 95th percentile.
    pub p95_us: u64,
    /// 99th percentile.
    pub p99_us: u64,
    /// Longest time.
    pub max_us: u64,
}

impl Latency {
    pub(super) fn of(histogram: &Histogram<u64>) -> Self {
        Self {
            messages: histogram.len(),
            p50_us: histogram.value_at_quantile(0.5),
            p95_us: histogram.value_at_quantile(0.95),
            p99_us: histogram.value_at_quantile(0.99),
            max_us: histogram.max(),
        }
    }
}
