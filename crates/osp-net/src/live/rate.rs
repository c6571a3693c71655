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

/// The size of a token bucket, and how fast time fills it.
#[derive(Clone, Copy, Debug)]
struct Limit {
    a_second: u64,
    most: u64,
}

/// The contents of a token bucket, from which messages take.
#[derive(Clone, Copy, Debug)]
struct Allowance {
    amount: u64,
    at_nanos: u64,
}

impl Limit {
    /// The contents at a given time; a new bucket is full. A time before `at_nanos` adds nothing.
    fn at(self, bucket: Option<Allowance>, now_nanos: u64) -> Allowance {
        let Some(bucket) = bucket else { return Allowance { amount: self.most, at_nanos: now_nanos } };
        let elapsed = u128::from(now_nanos.saturating_sub(bucket.at_nanos));
        let more = elapsed * u128::from(self.a_second) / 1_000_000_000;
        if more == 0 {
            return bucket;
        }
        let amount = (u128::from(bucket.amount) + more).min(self.most.into());
        Allowance { amount: u64::try_from(amount).unwrap_or(self.most), at_nanos: now_nanos }
    }
}

impl Allowance {
    fn less(self, amount: u64) -> Self {
        Self { amount: self.amount.saturating_sub(amount), ..self }
    }
}

const OF_SENDER: Limit = Limit { a_second: BYTES_A_SECOND, most: BURST_BYTES };
/// This member sends at most half of what the other members accept, because clocks differ.
const OF_MEMBER: Limit = Limit { a_second: BYTES_A_SECOND / 2, most: BURST_BYTES / 2 };
/// Waiting time that each join uses up, nanoseconds.
const JOIN_NANOS: u64 = SECS_A_JOIN * 1_000_000_000;
const OF_JOINS: Limit = Limit { a_second: 1_000_000_000, most: JOINS_AT_ONCE * JOIN_NANOS };

/// The remaining allowance of each sender.
#[derive(Clone, Debug, Default)]
pub(super) struct Rates {
    of: BTreeMap<Sender, Allowance>,
}

impl Rates {
    /// Whether a sender may send `bytes` bytes at this time. Call [`Rates::note`] if the message counts.
    pub(super) fn allow(&self, sender: Sender, bytes: usize, now_nanos: u64) -> bool {
        OF_SENDER.at(self.of.get(&sender).copied(), now_nanos).amount >= bytes as u64
    }

    pub(super) fn note(&mut self, sender: Sender, bytes: usize, now_nanos: u64) {
        let before = OF_SENDER.at(self.of.get(&sender).copied(), now_nanos);
        self.of.insert(sender, before.less(bytes as u64));
    }
}

/// Waiting time that no join has used up, nanoseconds; `None` before the first join.
#[derive(Clone, Debug, Default)]
pub(super) struct JoinRate(Option<Allowance>);

impl JoinRate {
    /// Whether one more sender may join at this time. Call [`JoinRate::note`] if the join counts. If the clock goes
    /// back, waiting begins again. Otherwise one time stamp from the future would block the session for long.
    pub(super) fn allow(&mut self, now_nanos: u64) -> bool {
        if let Some(waited) = &mut self.0 {
            waited.at_nanos = waited.at_nanos.min(now_nanos);
        }
        OF_JOINS.at(self.0, now_nanos).amount >= JOIN_NANOS
    }

    pub(super) fn note(&mut self, now_nanos: u64) {
        self.0 = Some(OF_JOINS.at(self.0, now_nanos).less(JOIN_NANOS));
    }
}

/// What this member may still send.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OwnRate(Option<Allowance>);

impl OwnRate {
    /// Takes `bytes` bytes from the allowance. Returns `false`, without effect, if fewer bytes remain.
    pub(super) fn take(&mut self, bytes: usize, now_nanos: u64) -> bool {
        let before = OF_MEMBER.at(self.0, now_nanos);
        let is_enough = before.amount >= bytes as u64;
        self.0 = Some(if is_enough { before.less(bytes as u64) } else { before });
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
