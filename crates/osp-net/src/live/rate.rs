//! Limits of an author's messages and of joins, by the server's clock, so that all members apply them alike.

use std::collections::BTreeMap;

use osp_session::recording::Sender;

/// Number of bytes a second that an author may send permanently: some forty thousand events, four hundred times as many as
/// a hand draws.
pub(super) const BYTES_A_SECOND: u64 = 4 << 20;

/// Number of bytes that an author may send in a burst, such as events drawn without a connection.
pub(super) const BURST_BYTES: u64 = 64 << 20;

/// Number of joins that a session accepts in a burst: a class, or the whole class again after a network failure.
pub(super) const JOINS_AT_ONCE: u64 = 128;

/// Seconds until the session accepts one more join. Anybody may choose a new sender number, and author numbers are never
/// used again. With this limit, a client that joins again and again needs eleven hours to use up the author numbers.
pub(super) const SECS_A_JOIN: u64 = 10;

/// A token bucket: time fills it, and messages take from it.
#[derive(Clone, Copy, Debug)]
struct Allowance {
    amount: u64,
    at_nanos: u64,
}

impl Allowance {
    /// The contents at a given time. A time before `at_nanos` adds nothing.
    fn at(self, now_nanos: u64, a_second: u64, most: u64) -> Self {
        let elapsed = u128::from(now_nanos.saturating_sub(self.at_nanos));
        let more = elapsed * u128::from(a_second) / 1_000_000_000;
        if more == 0 {
            return self;
        }
        let amount = (u128::from(self.amount) + more).min(most.into());
        Self { amount: u64::try_from(amount).unwrap_or(most), at_nanos: now_nanos }
    }
}

/// The remaining allowance of each sender.
#[derive(Clone, Debug, Default)]
pub(super) struct Rates {
    of: BTreeMap<Sender, Allowance>,
}

impl Rates {
    /// Whether a sender may send `bytes` bytes at this time. Call [`Rates::note`] if the message counts.
    pub(super) fn allow(&self, sender: Sender, bytes: usize, now_nanos: u64) -> bool {
        let full = Allowance { amount: BURST_BYTES, at_nanos: now_nanos };
        let allowance = self.of.get(&sender).map_or(full, |a| a.at(now_nanos, BYTES_A_SECOND, BURST_BYTES));
        allowance.amount >= bytes as u64
    }

    /// Subtracts a sender's message from its allowance.
    pub(super) fn note(&mut self, sender: Sender, bytes: usize, now_nanos: u64) {
        let full = Allowance { amount: BURST_BYTES, at_nanos: now_nanos };
        let allowance = self.of.entry(sender).or_insert(full);
        *allowance = allowance.at(now_nanos, BYTES_A_SECOND, BURST_BYTES);
        allowance.amount = allowance.amount.saturating_sub(bytes as u64);
    }
}

/// Waiting time that each join uses up, nanoseconds.
const JOIN_NANOS: u64 = SECS_A_JOIN * 1_000_000_000;

/// The allowance for joins.
#[derive(Clone, Debug, Default)]
pub(super) struct JoinRate {
    /// Waiting time that no join has used up, nanoseconds; `None` before the first join.
    waited: Option<Allowance>,
}

impl JoinRate {
    fn at(&self, now_nanos: u64) -> Allowance {
        let most = JOINS_AT_ONCE * JOIN_NANOS;
        let full = Allowance { amount: most, at_nanos: now_nanos };
        self.waited.map_or(full, |waited| waited.at(now_nanos, 1_000_000_000, most))
    }

    /// Whether one more sender may join at this time. Call [`JoinRate::note`] if the join counts. If the clock goes
    /// back, waiting begins again. Otherwise one time stamp from the future would block the session for long.
    pub(super) fn allow(&mut self, now_nanos: u64) -> bool {
        if let Some(waited) = &mut self.waited {
            waited.at_nanos = waited.at_nanos.min(now_nanos);
        }
        self.at(now_nanos).amount >= JOIN_NANOS
    }

    /// Subtracts an accepted join from the allowance.
    pub(super) fn note(&mut self, now_nanos: u64) {
        let waited = self.at(now_nanos);
        self.waited = Some(Allowance { amount: waited.amount.saturating_sub(JOIN_NANOS), ..waited });
    }
}

/// This member's own limit: half of what the other members accept, because clocks differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnRate(Allowance);

impl Default for OwnRate {
    fn default() -> Self {
        Self(Allowance { amount: BURST_BYTES / 2, at_nanos: 0 })
    }
}

impl OwnRate {
    /// Takes `bytes` bytes from the allowance. Returns `false`, without effect, if fewer bytes remain.
    pub(super) fn take(&mut self, bytes: usize, now_nanos: u64) -> bool {
        self.0 = self.0.at(now_nanos, BYTES_A_SECOND / 2, BURST_BYTES / 2);
        let is_enough = self.0.amount >= bytes as u64;
        if is_enough {
            self.0.amount -= bytes as u64;
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
        // Small steps give as much as one large step.
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
    fn many_join_at_once_and_then_one_after_the_other() {
        let (mut rate, second) = (JoinRate::default(), 1_000_000_000);
        let join = |rate: &mut JoinRate, now: u64| {
            let may = rate.allow(now);
            if may {
                rate.note(now);
            }
            may
        };
        let start = 5_000 * second;
        assert_eq!((0..1000).filter(|_| join(&mut rate, start)).count() as u64, JOINS_AT_ONCE);
        assert!(!join(&mut rate, start - second), "time that goes back gives nothing");
        // The number of tries in between does not matter.
        let tries = (1..=1000).map(|step| start + step * second * 7 / 10);
        assert_eq!(tries.filter(|&now| join(&mut rate, now)).count() as u64, 700 / SECS_A_JOIN);
        let rested = start + 100 * JOINS_AT_ONCE * SECS_A_JOIN * second;
        assert_eq!((0..1000).filter(|_| join(&mut rate, rested)).count() as u64, JOINS_AT_ONCE);
    }

    #[test]
    fn a_stamp_from_the_future_does_not_close_a_session() {
        let (mut rate, second) = (JoinRate::default(), 1_000_000_000);
        let year = 365 * 24 * 3600 * second;
        for _ in 0..JOINS_AT_ONCE {
            assert!(rate.allow(2 * year));
            rate.note(2 * year);
        }
        assert!(!rate.allow(year), "the clock is set right");
        assert!(rate.allow(year + SECS_A_JOIN * second));
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
