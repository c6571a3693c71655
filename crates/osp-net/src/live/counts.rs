//! Counts of a member of a shared session.

use hdrhistogram::Histogram;
use serde::Serialize;

/// Counts of one member, since it has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Messages that count.
    pub messages: u64,
    /// Their events.
    pub events: u64,
    /// Own ones among these messages.
    pub own_messages: u64,
    /// Messages that were there before, or came again.
    pub duplicates: u64,
    /// Messages before which one of the same sender is missing.
    pub gaps: u64,
    /// Messages of those who have not joined, or have left.
    pub strangers: u64,
    /// Data that is no message.
    pub garbage: u64,
    /// Messages in which something cannot be.
    pub refused: u64,
    /// Messages of those who said more than they may, or for which the session had no room.
    pub beyond_limits: u64,
    /// Own messages sent again.
    pub resent: u64,
    /// Times that the log was requested again, from where it was known.
    pub reopened: u64,
    /// Connections to the server, the first one included.
    pub connections: u64,
}

impl Counts {
    /// Messages that count for nothing.
    pub fn passed_over(&self) -> u64 {
        self.duplicates + self.gaps + self.faulty()
    }

    /// Messages that no member means to send: others than those that came twice, or too early after a disturbance.
    pub fn faulty(&self) -> u64 {
        self.strangers + self.garbage + self.refused + self.beyond_limits
    }
}

/// Times of own messages from the hand to the server and back, microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Latency {
    /// Messages.
    pub messages: u64,
    /// Half of them took at most this.
    pub p50_us: u64,
    /// 95 of 100.
    pub p95_us: u64,
    /// 99 of 100.
    pub p99_us: u64,
    /// The longest.
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
