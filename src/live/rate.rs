//! How much an author may say, judged by the server's clock, so that all members judge alike.

use std::collections::BTreeMap;

use crate::recording::Sender;

/// Bytes a second that an author may say for long: some forty thousand events, four hundred times what a hand draws.
pub(super) const BYTES_A_SECOND: u64 = 4 << 20;

/// Bytes that an author may say at once: what was drawn while there was no connection.
pub(super) const BURST_BYTES: u64 = 64 << 20;

/// A vessel that fills up as time goes by, and that what is said takes from.
#[derive(Clone, Copy, Debug)]
struct Allowance {
    bytes: u64,
    at_nanos: u64,
}

impl Allowance {
    /// What there is at a time; time that goes back gives nothing.
    fn at(self, now_nanos: u64, bytes_a_second: u64, burst_bytes: u64) -> Self {
        let elapsed = u128::from(now_nanos.saturating_sub(self.at_nanos));
        let more = elapsed * u128::from(bytes_a_second) / 1_000_000_000;
        if more == 0 {
            return self;
        }
        let bytes = (u128::from(self.bytes) + more).min(burst_bytes.into());
        Self { bytes: u64::try_from(bytes).unwrap_or(burst_bytes), at_nanos: now_nanos }
    }
}

/// What each sender may still say.
#[derive(Clone, Debug, Default)]
pub(super) struct Rates {
    of: BTreeMap<Sender, Allowance>,
}

impl Rates {
    /// Whether a sender may say so much at a time. Call [`Rates::note`] once it counts.
    pub(super) fn allow(&self, sender: Sender, bytes: usize, now_nanos: u64) -> bool {
        let full = Allowance { bytes: BURST_BYTES, at_nanos: now_nanos };
        let allowance = self.of.get(&sender).map_or(full, |a| a.at(now_nanos, BYTES_A_SECOND, BURST_BYTES));
        allowance.bytes >= bytes as u64
    }

    /// Takes what a sender has said.
    pub(super) fn note(&mut self, sender: Sender, bytes: usize, now_nanos: u64) {
        let full = Allowance { bytes: BURST_BYTES, at_nanos: now_nanos };
        let allowance = self.of.entry(sender).or_insert(full);
        *allowance = allowance.at(now_nanos, BYTES_A_SECOND, BURST_BYTES);
        allowance.bytes = allowance.bytes.saturating_sub(bytes as u64);
    }
}

/// What this member lets itself say: half of what the others take, for clocks differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnRate(Allowance);

impl Default for OwnRate {
    fn default() -> Self {
        Self(Allowance { bytes: BURST_BYTES / 2, at_nanos: 0 })
    }
}

impl OwnRate {
    /// Takes so many bytes, if there are as many.
    pub(super) fn take(&mut self, bytes: usize, now_nanos: u64) -> bool {
        self.0 = self.0.at(now_nanos, BYTES_A_SECOND / 2, BURST_BYTES / 2);
        let is_enough = self.0.bytes >= bytes as u64;
        if is_enough {
            self.0.bytes -= bytes as u64;
        }
        is_enough
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_taken_and_then_what_comes_in_the_long_run() {
        let (mut rates, sender) = (Rates::default(), Sender(1));
        let second = 1_000_000_000;
        let mut said = 0;
        while rates.allow(sender, 1 << 16, second) {
            rates.note(sender, 1 << 16, second);
            said += 1 << 16;
        }
        assert_eq!(said, BURST_BYTES);
        assert!(rates.allow(Sender(2), 1 << 16, second), "another's allowance is its own");
        assert!(!rates.allow(sender, 1 << 16, 0), "time that goes back gives nothing");
        // In small steps as much as in a large one.
        for step in 1..=1000 {
            let now = second + step * 1_000_000;
            while rates.allow(sender, 1 << 10, now) {
                rates.note(sender, 1 << 10, now);
                said += 1 << 10;
            }
        }
        let more = said - BURST_BYTES;
        assert!((BYTES_A_SECOND - 2048..=BYTES_A_SECOND).contains(&more), "{more}");
    }

    #[test]
    fn one_lets_oneself_say_half_as_much() {
        let mut own = OwnRate::default();
        let mut said = 0u64;
        for step in 0..=10_000u64 {
            while own.take(1 << 12, step * 1_000_000) {
                said += 1 << 12;
            }
        }
        let most = BURST_BYTES / 2 + 10 * (BYTES_A_SECOND / 2);
        assert!(said <= most && said > most - (1 << 14), "{said} of {most}");
    }
}
