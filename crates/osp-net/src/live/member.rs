//! A member of a shared session, without the network. Its input is the messages of the log and the member's own events.
//! Its output is the session's events and the messages to publish. The caller passes the time.

use std::time::Duration;

use hdrhistogram::Histogram;

use super::{
    counts::Counts,
    log::{Judged, Log, Passed},
    outbox::{Outbox, Outgoing, Who},
    packet,
    presence::{PRESENCE_EVERY, Presence},
};
use osp_session::recording::{Author, Event, Sender};

/// News for a member's program.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// The next events of the session.
    Events {
        events: Vec<Event>,
        /// Number of this member's acknowledged events. They are among `events`, in the same order, or they end a
        /// stroke that had already ended.
        own: usize,
    },
    /// This member's events that will never be in the session.
    Refused {
        why: String,
        /// Number of these events. They are the oldest of this member's events that are not in the session.
        own: usize,
    },
    /// This member has joined as this author, for the first time or again.
    Joined(Author),
    /// This member has left, as requested.
    Left,
}

/// The state of a member; see the [module](self).
#[derive(Debug)]
pub(super) struct Member {
    log: Log,
    outbox: Option<Outbox>,
    presence: Presence,
    pub(super) counts: Counts,
    pub(super) latency_us: Histogram<u64>,
    pub(super) news: Vec<News>,
    /// Number of the last message that was processed; 0 before the first message.
    pub(super) last_sequence: u64,
    /// The server's time stamp of the first message.
    first_stamp_nanos: Option<u64>,
    /// The session's time minus this member's time, seconds.
    later_secs: f64,
    is_leaving: bool,
    has_left: bool,
    pub(super) is_full: bool,
    /// Whether the last attempt to join failed because too many members have joined.
    pub(super) is_crowded: bool,
    /// Time at which the member began to wait for an answer, or received the last answer.
    progress: Duration,
    announced: Duration,
    /// Description of the last faulty message.
    pub(super) last_passed: Option<String>,
}

impl Member {
    /// A member that draws, with its name and sender number, or a member that watches (`None`).
    pub(super) fn new(may_send: Option<(Who, Sender)>) -> Self {
        Self {
            log: Log::default(),
            outbox: may_send.map(|(who, sender)| Outbox::new(who, sender)),
            presence: Presence::default(),
            counts: Counts::default(),
            latency_us: Histogram::new_with_bounds(1, 3_600_000_000, 3).expect("bounds and digits that fit"),
            news: Vec::new(),
            last_sequence: 0,
            first_stamp_nanos: None,
            later_secs: 0.0,
            is_leaving: false,
            has_left: false,
            is_full: false,
            is_crowded: false,
            progress: Duration::ZERO,
            announced: Duration::ZERO,
            last_passed: None,
        }
    }

    pub(super) fn author(&self) -> Option<Author> {
        self.outbox.as_ref()?.author
    }

    pub(super) fn authors(&self) -> usize {
        self.presence.authors()
    }

    pub(super) fn pending(&self) -> usize {
        self.outbox.as_ref().map_or(0, |outbox| outbox.pending)
    }

    pub(super) fn may_send(&self) -> bool {
        self.outbox.is_some() && !self.has_left
    }

    /// Sets the estimated age of the session, which is used until the first own message comes back.
    pub(super) fn set_age(&mut self, age_secs: f64, now: Duration) {
        if let Some(outbox) = self.outbox.as_mut().filter(|outbox| outbox.author.is_none()) {
            outbox.later_secs = age_secs - now.as_secs_f64();
        }
    }

    /// Sets the largest message that the server accepts, bytes.
    pub(super) fn set_limit_bytes(&mut self, bytes: usize) {
        if let Some(outbox) = &mut self.outbox {
            outbox.set_limit_bytes(bytes);
        }
    }

    /// Adds this member's events of a frame. They belong to the author [`ME`](super::ME), and have times of this
    /// member's clock.
    pub(super) fn hand_over(&mut self, events: Vec<Event>, now: Duration) {
        if let Some(outbox) = &mut self.outbox {
            outbox.hand_over(events, now);
        }
        self.note_done();
    }

    fn note_done(&mut self) {
        let own = self.outbox.as_mut().map_or(0, Outbox::take_done);
        if own > 0 {
            self.news.push(News::Events { events: Vec::new(), own });
        }
    }

    /// Leaves the session after all events that were added before.
    pub(super) fn leave(&mut self, now: Duration) {
        if let Some(outbox) = self.outbox.as_mut().filter(|_| !self.is_leaving) {
            self.is_leaving = true;
            outbox.leave(now);
        }
    }

    pub(super) fn pump(&mut self, now: Duration) -> Vec<Outgoing> {
        let Some(outbox) = self.outbox.as_mut().filter(|_| !self.has_left && !self.is_full) else {
            return Vec::new();
        };
        if !outbox.awaits_answers() {
            self.progress = now;
        }
        let out = outbox.pump(now);
        let too_long = outbox.take_too_long();
        if too_long > 0 {
            let why = "an event is too long for a message".to_owned();
            self.news.push(News::Refused { why, own: usize::try_from(too_long).unwrap_or(usize::MAX) });
        }
        if !out.is_empty() {
            self.announced = now;
        }
        out
    }

    /// Time for which the member has waited for an answer; `None` if it does not wait.
    pub(super) fn waits_for(&self, now: Duration) -> Option<Duration> {
        let outbox = self.outbox.as_ref().filter(|outbox| outbox.awaits_answers() && !self.is_full)?;
        (!self.has_left && outbox.awaits_answers()).then(|| now.saturating_sub(self.progress))
    }

    /// Restarts the time of [`Self::waits_for`], because no answer can have come until now.
    pub(super) fn hold(&mut self, now: Duration) {
        self.progress = now;
    }

    pub(super) fn again(&mut self) -> Vec<Outgoing> {
        if self.has_left || self.is_full {
            return Vec::new();
        }
        let out = self.outbox.as_mut().map(Outbox::again).unwrap_or_default();
        self.counts.resent += out.len() as u64;
        out
    }

    /// A presence message for the other members, if it is due.
    pub(super) fn presence(&mut self, now: Duration) -> Option<String> {
        let outbox = self.outbox.as_ref().filter(|outbox| outbox.author.is_some() && !self.has_left)?;
        if now.saturating_sub(self.announced) < PRESENCE_EVERY {
            return None;
        }
        self.announced = now;
        Some(packet::presence(outbox.sender))
    }

    /// Processes a presence message of another member.
    pub(super) fn receive(&mut self, bytes: &[u8], now: Duration) {
        match packet::read_presence(bytes) {
            Some(sender) => self.presence.receive(sender, now),
            None => self.counts.garbage += 1,
        }
    }

    /// Records that no messages could be received until now.
    pub(super) fn interrupted(&mut self, now: Duration) {
        self.presence.interrupted(now);
    }

    /// A message about an author who was silent for a long time. Every member sends this message; only the first copy
    /// counts.
    pub(super) fn message_of_absence(&mut self, now: Duration) -> Option<Outgoing> {
        let outbox = self.outbox.as_ref().filter(|_| self.may_send())?;
        outbox.author?;
        let author = self.presence.gone(now, Some(outbox.sender))?;
        let number = self.log.next_of(Sender::HOST);
        let mut text = packet::head(Sender::HOST, number);
        let t = now.as_secs_f64() + self.later_secs;
        let is_written = packet::push(&mut text, &Event::Leave { t: round(t), author });
        // If several members send the same message, the server keeps one.
        let id = format!("host-{number}-{}", author.0);
        is_written.then(|| Outgoing { id, bytes: text.into_bytes() })
    }

    /// Processes a message of the log. Messages that came before are ignored.
    pub(super) fn take(&mut self, sequence: u64, stamp_nanos: u64, bytes: &[u8], now: Duration) {
        if sequence <= self.last_sequence {
            return;
        }
        self.last_sequence = sequence;
        let first = *self.first_stamp_nanos.get_or_insert(stamp_nanos);
        let me_sender = self.outbox.as_ref().map(|outbox| outbox.sender);
        let mut events = Vec::new();
        match self.log.take(bytes, stamp_nanos, &mut events) {
            Judged::Garbage(expected) => {
                self.counts.garbage += 1;
                self.last_passed = Some(format!("message {sequence}: expected {expected}"));
            }
            Judged::Taken(message) => {
                let author = self.log.author_of(message.sender).unwrap_or_default();
                self.counts.messages += 1;
                self.counts.events += events.len() as u64;
                self.presence.taken(message.sender, author, &events, now);
                let is_own = self.is_own(message.sender, bytes);
                let own = if is_own { self.answered(author, first, stamp_nanos, now) } else { 0 };
                let me = self.author();
                let is_me =
                    |event: &Event| matches!(event, Event::Leave { author, .. } if Some(*author) == me);
                let leaves = events.iter().any(is_me);
                if !events.is_empty() {
                    self.news.push(News::Events { events, own });
                }
                if leaves && is_own {
                    self.has_left = true;
                    self.news.push(News::Left);
                } else if leaves || (!is_own && me_sender == Some(message.sender)) {
                    self.join_again(now);
                }
            }
            Judged::PassedOver(sender, passed) => {
                let is_next = self.is_own(sender, bytes);
                if is_next && passed == Passed::Crowded {
                    // The message has been answered, although it does not count.
                    (self.is_crowded, self.progress) = (true, now);
                }
                self.pass_over(sequence, Some(sender) == me_sender, is_next, passed);
            }
            Judged::Refused(sender, why) => {
                self.counts.refused += 1;
                let is_own = self.is_own(sender, bytes);
                if is_own && let Some(outbox) = &mut self.outbox {
                    let own = outbox.refused().handed;
                    self.progress = now;
                    if own > 0 {
                        self.news.push(News::Refused { why: why.clone(), own });
                    }
                } else if me_sender == Some(sender) {
                    self.join_again(now);
                }
                self.last_passed = Some(format!("message {sequence}: {why}"));
            }
        }
    }

    fn pass_over(&mut self, sequence: u64, is_own: bool, is_next: bool, passed: Passed) {
        let (count, why) = match passed {
            Passed::Duplicate => (&mut self.counts.duplicates, "it is a duplicate"),
            Passed::Gap => (&mut self.counts.gaps, "an earlier message of its sender is missing"),
            Passed::Stranger => (&mut self.counts.strangers, "its sender has not joined, or has left"),
            Passed::TooFast => (&mut self.counts.beyond_limits, "its sender sends too much at once"),
            Passed::Crowded => (&mut self.counts.beyond_limits, "too many have joined before its sender"),
            Passed::Full => (&mut self.counts.beyond_limits, "the session holds as much as one may"),
        };
        *count += 1;
        if !matches!(passed, Passed::Duplicate | Passed::Gap) {
            self.last_passed = Some(format!("message {sequence}: {why}"));
        }
        if let (true, Some(outbox)) = (is_own, &mut self.outbox) {
            match passed {
                Passed::Gap | Passed::TooFast | Passed::Crowded => outbox.ignored(),
                // Only a message that this member sent marks the session as full, because others can use its sender
                // number.
                Passed::Full => self.is_full |= is_next,
                Passed::Duplicate | Passed::Stranger => {}
            }
        }
    }

    /// Processes a message of this member that has come back; returns the number of this member's events in it.
    fn answered(&mut self, author: Author, first_nanos: u64, stamp_nanos: u64, now: Duration) -> usize {
        let Some(outbox) = &mut self.outbox else { return 0 };
        let had_joined = outbox.author.is_some();
        let answered = outbox.taken(author);
        (self.progress, self.is_crowded) = (now, false);
        self.counts.own_messages += 1;
        if !had_joined {
            let session_secs = stamp_nanos.saturating_sub(first_nanos) as f64 / 1.0e9;
            self.later_secs = session_secs - now.as_secs_f64();
            outbox.later_secs = self.later_secs;
            self.news.push(News::Joined(author));
        } else if let Some(since) = answered.since {
            let took = now.saturating_sub(since).as_micros();
            self.latency_us.saturating_record(u64::try_from(took).unwrap_or(u64::MAX).max(1));
        }
        answered.handed
    }

    /// Whether a message of the log is this member's oldest message that the server has not returned yet.
    fn is_own(&self, sender: Sender, bytes: &[u8]) -> bool {
        self.outbox.as_ref().is_some_and(|outbox| outbox.sender == sender && outbox.is_next(bytes))
    }

    /// Joins again, because other members have declared this member gone, or because somebody uses its sender number.
    fn join_again(&mut self, now: Duration) {
        if let Some(outbox) = &mut self.outbox {
            outbox.later_secs = self.later_secs;
            outbox.join_again(new_sender());
            (self.progress, self.is_crowded) = (now, false);
        }
        self.note_done();
    }
}

/// Rounds a time to a tenth of a millisecond, so that its text is short.
fn round(t: f64) -> f64 {
    (t.max(0.0) * 1.0e4).round() / 1.0e4
}

/// A random sender number that no other member has.
pub(super) fn new_sender() -> Sender {
    use std::hash::{BuildHasher, RandomState};
    // The standard library gives each hasher a different seed, from random numbers of the system.
    let (a, b) = (RandomState::new().hash_one(std::process::id()), RandomState::new().hash_one(1u8));
    Sender((a ^ b.rotate_left(32)).max(1))
}
