//! The log of a session, as the server stores it, and the rules that decide which messages count. Every member applies
//! the same rules: they depend only on the contents of the log and on the server's time stamps.

use super::{
    ME, packet,
    rate::{JoinRate, Rates},
};
use osp_session::recording::{Author, Event, Limits, Message, Reduced, Reducer, Sender, Tally};

/// The outcome of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Judged {
    /// The data is no message, for this reason.
    Garbage(&'static str),
    /// The message counts: its events are the next events of the session.
    Taken(Message),
    /// The message does not count, and its number stays free, so that the sender may send it again.
    PassedOver(Sender, Passed),
    /// The message uses up its number, but its events have no effect, for this reason.
    Refused(Sender, String),
}

/// The reason why a message does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passed {
    Duplicate,
    Gap,
    Stranger,
    TooFast,
    /// Too many senders have joined recently; the sender may try again later.
    Crowded,
    /// The session is at its largest size.
    Full,
}

/// The state of the log; see the [module](self).
#[derive(Debug)]
pub(super) struct Log {
    reducer: Reducer,
    rates: Rates,
    joins: JoinRate,
    tally: Tally,
    joined: u32,
    /// The largest size of a session.
    limits: Limits,
}

impl Default for Log {
    /// The limits that every reader of recordings accepts by default, less a reserve for the ends of all strokes.
    fn default() -> Self {
        let limits = Limits { polygons: Limits::DEFAULT.polygons / 8 * 7, ..Limits::DEFAULT };
        Self {
            reducer: Reducer::default(),
            rates: Rates::default(),
            joins: JoinRate::default(),
            tally: Tally::default(),
            joined: 0,
            limits,
        }
    }
}

/// The limits for events that are allowed in a full session, too.
const LIMITS_WHEN_FULL: Limits = Limits { polygons: u64::MAX / 64, ..Limits::DEFAULT };

impl Log {
    /// Processes the next message, and appends its events to `out` if it is valid. `stamp_nanos` is the server's time stamp.
    pub(super) fn take(&mut self, bytes: &[u8], stamp_nanos: u64, out: &mut Vec<Event>) -> Judged {
        let message = match packet::read(bytes) {
            Ok(message) => message,
            Err(expected) => return Judged::Garbage(expected),
        };
        let sender = message.sender;
        let is_next = message.number == self.reducer.next_of(sender);
        if is_next && !self.rates.allow(sender, bytes.len(), stamp_nanos) {
            return Judged::PassedOver(sender, Passed::TooFast);
        }
        let joins = matches!(message.events.first(), Some(Event::Join { .. }));
        let is_new = joins && self.reducer.author_of(sender).is_none();
        // The last author number is excluded, because members use it for their own strokes.
        if is_new && self.joined + 1 >= ME.0 {
            return Judged::PassedOver(sender, Passed::Full);
        }
        if is_new && is_next && !self.joins.allow(stamp_nanos) {
            return Judged::PassedOver(sender, Passed::Crowded);
        }
        let is_known = self.reducer.author_of(sender).is_some() || joins;
        let counted = self.tally.clone();
        if is_next && is_known && !self.has_room(&message) {
            self.tally = counted;
            return Judged::PassedOver(sender, Passed::Full);
        }
        let reduced = self.reducer.take(&message, out);
        if matches!(reduced, Reduced::Taken | Reduced::Refused(_)) && self.reducer.author_of(sender).is_some()
        {
            self.rates.note(sender, bytes.len(), stamp_nanos);
        }
        if reduced != Reduced::Taken {
            // A message that does not count takes no room.
            self.tally = counted;
        }
        match reduced {
            Reduced::Taken => {
                if joins {
                    self.joined += 1;
                    self.joins.note(stamp_nanos);
                }
                Judged::Taken(message)
            }
            Reduced::Duplicate => Judged::PassedOver(sender, Passed::Duplicate),
            Reduced::Gap(_) => Judged::PassedOver(sender, Passed::Gap),
            Reduced::Stranger => Judged::PassedOver(sender, Passed::Stranger),
            Reduced::Refused(why) => Judged::Refused(sender, why),
        }
    }

    /// Whether the session has room for a message. The message's contents are counted in the same way as by readers of
    /// recordings. Events that end an open stroke or leave the session are allowed in a full session, too.
    fn has_room(&mut self, message: &Message) -> bool {
        message.events.iter().all(|event| {
            let is_farewell = match event {
                Event::Leave { .. } => true,
                Event::End { stroke, .. } => self.tally.is_open(*stroke),
                _ => false,
            };
            let limits = if is_farewell { &LIMITS_WHEN_FULL } else { &self.limits };
            self.tally.count(event, limits).is_ok()
        })
    }

    /// The author number of a sender that has joined.
    pub(super) fn author_of(&self, sender: Sender) -> Option<Author> {
        self.reducer.author_of(sender)
    }

    /// The number of the sender's next message that can count.
    pub(super) fn next_of(&self, sender: Sender) -> u64 {
        self.reducer.next_of(sender)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::rate::{JOINS_AT_ONCE, SECS_A_JOIN};
    use glam::Vec3;
    use osp_session::recording::StrokeId;

    fn bytes(sender: u64, number: u64, events: &[Event]) -> Vec<u8> {
        let mut text = packet::head(Sender(sender), number);
        assert!(events.iter().all(|event| packet::push(&mut text, event)));
        text.into_bytes()
    }

    fn join() -> Event {
        Event::Join { t: 0.0, author: Author(1), name: String::new(), color: None }
    }

    #[test]
    fn who_speaks_too_fast_is_passed_over_and_may_say_it_again() {
        let (mut log, mut out) = (Log::default(), Vec::new());
        assert!(matches!(log.take(&bytes(5, 0, &[join()]), 0, &mut out), Judged::Taken(_)));
        let strokes = vec![StrokeId(u32::MAX); 40_000];
        let event = Event::Move { t: 0.0, author: Author(1), strokes, by: Vec3::X };
        let mut number = 1;
        let passed = loop {
            match log.take(&bytes(5, number, std::slice::from_ref(&event)), 0, &mut out) {
                Judged::Taken(_) => number += 1,
                other => break other,
            }
        };
        assert_eq!(passed, Judged::PassedOver(Sender(5), Passed::TooFast));
        // The end of a stroke is small enough, but a message counts only after the sender's earlier ones.
        let end = Event::End { t: 0.0, stroke: StrokeId(1 << 20) };
        let too_early = log.take(&bytes(5, number + 1, std::slice::from_ref(&end)), 0, &mut out);
        assert_eq!(too_early, Judged::PassedOver(Sender(5), Passed::Gap));
        // A second later the message counts.
        let later = log.take(&bytes(5, number, &[event]), 1_000_000_000, &mut out);
        assert!(matches!(later, Judged::Taken(_)));
    }

    #[test]
    fn a_full_session_takes_ends_and_farewells_only() {
        let limits = Limits { polygons: 10_000, ..Limits::DEFAULT };
        let (mut log, mut out) = (Log { limits, ..Log::default() }, Vec::new());
        assert!(matches!(log.take(&bytes(5, 0, &[join()]), 0, &mut out), Judged::Taken(_)));
        let strokes = vec![StrokeId(u32::MAX); 999];
        let event = Event::Move { t: 0.0, author: Author(1), strokes, by: Vec3::X };
        let mut number = 1;
        let full = loop {
            let now = number * 1_000_000_000;
            match log.take(&bytes(5, number, std::slice::from_ref(&event)), now, &mut out) {
                Judged::Taken(_) => number += 1,
                other => break other,
            }
            out.clear();
        };
        assert_eq!(full, Judged::PassedOver(Sender(5), Passed::Full));
        assert_eq!(number, 40, "a thousand events each");
        let undo = Event::Undo { t: 0.0, author: Author(1) };
        let leave = Event::Leave { t: 0.0, author: Author(1) };
        let now = 1_000_000_000_000;
        // Small events may still have room, but not for ever.
        while matches!(
            log.take(&bytes(5, number, std::slice::from_ref(&undo)), now, &mut out),
            Judged::Taken(_)
        ) {
            number += 1;
        }
        let left = log.take(&bytes(5, number, &[leave]), now, &mut out);
        assert!(matches!(left, Judged::Taken(_)), "{left:?}");
    }

    #[test]
    fn the_last_number_of_an_author_is_not_given_away() {
        let (mut log, mut out) = (Log::default(), Vec::new());
        let at = |sender: u64| sender * SECS_A_JOIN * 1_000_000_000;
        for sender in 1..u64::from(ME.0) {
            let judged = log.take(&bytes(sender, 0, &[join()]), at(sender), &mut out);
            assert!(matches!(judged, Judged::Taken(_)), "{sender}");
        }
        let last = log.take(&bytes(9999, 0, &[join()]), at(9999), &mut out);
        assert_eq!(last, Judged::PassedOver(Sender(9999), Passed::Full));
        assert!(matches!(out.last(), Some(Event::Join { author: Author(4094), .. })));
    }

    #[test]
    fn who_joins_again_and_again_does_not_fill_the_room() {
        let (mut log, mut out) = (Log::default(), Vec::new());
        let second = 1_000_000_000;
        let mut joined = 0;
        for sender in 1..=u64::from(ME.0) {
            match log.take(&bytes(sender, 0, &[join()]), sender * second / 5000, &mut out) {
                Judged::Taken(_) => joined += 1,
                passed => assert_eq!(passed, Judged::PassedOver(Sender(sender), Passed::Crowded)),
            }
        }
        assert_eq!(joined, JOINS_AT_ONCE);
        // A sender whose join did not count sends it again, under the same number.
        let again = log.take(&bytes(4000, 0, &[join()]), (SECS_A_JOIN + 1) * second, &mut out);
        assert!(matches!(again, Judged::Taken(_)), "{again:?}");
        let at_once = log.take(&bytes(5000, 0, &[join()]), (SECS_A_JOIN + 1) * second, &mut out);
        assert_eq!(at_once, Judged::PassedOver(Sender(5000), Passed::Crowded));
        // Authors that have joined already are not delayed.
        let drawn = log.take(
            &bytes(1, 1, &[Event::Undo { t: 0.0, author: Author(1) }]),
            (SECS_A_JOIN + 1) * second,
            &mut out,
        );
        assert!(matches!(drawn, Judged::Taken(_)), "{drawn:?}");
    }

    #[test]
    fn garbage_and_strangers_cost_nothing() {
        let (mut log, mut out) = (Log::default(), Vec::new());
        assert!(matches!(log.take(b"\x00\x01", 0, &mut out), Judged::Garbage(_)));
        let stranger = log.take(&bytes(9, 0, &[Event::Undo { t: 0.0, author: Author(1) }]), 0, &mut out);
        assert_eq!(stranger, Judged::PassedOver(Sender(9), Passed::Stranger));
        assert!(out.is_empty() && log.author_of(Sender(9)).is_none() && log.next_of(Sender(9)) == 0);
        assert_eq!(format!("{:?}", log.rates), format!("{:?}", Rates::default()));
    }
}
