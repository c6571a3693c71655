//! Unacknowledged messages: this member's events on their way into the log.
//!
//! At most [`WINDOW`] messages are in flight. Later events are collected in the next message, so that a slow connection
//! carries fewer and longer messages. A message stays in the outbox until it comes back in the log. Unacknowledged
//! messages are sent again under the same number.

use std::collections::VecDeque;
use std::time::Duration;

use super::{own::Own, packet, rate::OwnRate};
use osp_session::recording::{Author, Event, Sender};

/// Largest number of messages in flight.
pub(super) const WINDOW: usize = 32;

/// Usual limit of a message, bytes; a single event may be longer. A slow connection carries such a message within a second.
const USUAL_BYTES: usize = 32 << 10;

/// A message to publish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Outgoing {
    /// The id of the message. The server drops a message whose id it has received within the last two minutes.
    pub(super) id: String,
    pub(super) bytes: Vec<u8>,
}

/// An event of this member that is not in the log yet.
#[derive(Clone, Debug)]
struct WaitingEvent {
    event: Event,
    /// Time at which the program sent the event.
    handed: Duration,
    /// Whether the program sent the event; otherwise the outbox added it.
    is_handed: bool,
    /// Whether the event needs a message of its own, because it was refused together with others.
    is_alone: bool,
}

impl WaitingEvent {
    fn added(event: Event, handed: Duration) -> Self {
        Self { event, handed, is_handed: false, is_alone: false }
    }
}

#[derive(Clone, Debug)]
struct InFlight {
    number: u64,
    /// The published bytes, which distinguish the message from another message under the same number.
    bytes: Vec<u8>,
    events: Vec<WaitingEvent>,
}

impl InFlight {
    fn answered(&self) -> Answered {
        Answered {
            handed: self.events.iter().filter(|waiting| waiting.is_handed).count(),
            since: self.events.first().map(|waiting| waiting.handed),
        }
    }
}

/// A message of this member that has come back in the log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Answered {
    /// Number of the message's events that the program sent.
    pub(super) handed: usize,
    /// Time at which the program sent the first of these events.
    pub(super) since: Option<Duration>,
}

/// The name and colour of this member in the session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Who {
    pub name: String,
    /// The colour in which the window shows this member's strokes: red, green, blue, each from 0 to 1, sRGB; `None` for
    /// no colour.
    pub color: Option<(f32, f32, f32)>,
}

/// The state of unacknowledged messages; see the [module](self).
#[derive(Debug)]
pub(super) struct Outbox {
    who: Who,
    pub(super) sender: Sender,
    pub(super) author: Option<Author>,
    own: Own,
    next: u64,
    in_flight: VecDeque<InFlight>,
    waiting: VecDeque<WaitingEvent>,
    /// Number of events that the program sent and that are not in the log.
    pub(super) pending: usize,
    /// A part of the message ids. It increases before messages that did not count are sent again, because the server
    /// drops known ids.
    attempt: u32,
    needs_new_ids: bool,
    /// The session's time minus this member's clock, seconds.
    pub(super) later_secs: f64,
    rate: OwnRate,
    /// Largest size of a message, bytes.
    limit_bytes: usize,
    /// Number of events that are too long for any message.
    too_long: u64,
    /// Number of events that were dropped, because nothing has to be sent for them.
    done: usize,
}

impl Outbox {
    pub(super) fn new(who: Who, sender: Sender) -> Self {
        Self {
            who,
            sender,
            author: None,
            own: Own::default(),
            next: 0,
            in_flight: VecDeque::new(),
            waiting: VecDeque::new(),
            pending: 0,
            attempt: 0,
            needs_new_ids: false,
            later_secs: 0.0,
            rate: OwnRate::default(),
            limit_bytes: packet::MAX_BYTES,
            too_long: 0,
            done: 0,
        }
    }

    pub(super) fn awaits_answers(&self) -> bool {
        !self.in_flight.is_empty()
    }

    /// Number of events skipped since the last call, because they are too long for any message.
    pub(super) fn take_too_long(&mut self) -> u64 {
        std::mem::take(&mut self.too_long)
    }

    pub(super) fn set_limit_bytes(&mut self, bytes: usize) {
        self.limit_bytes = bytes.min(packet::MAX_BYTES);
    }

    /// Adds this member's events, at a time of this member's clock.
    pub(super) fn hand_over(&mut self, events: Vec<Event>, now: Duration) {
        self.pending += events.len();
        for event in events {
            self.admit(WaitingEvent { event, handed: now, is_handed: true, is_alone: false });
        }
    }

    /// Appends an unsent event to the waiting events.
    fn admit(&mut self, waiting: WaitingEvent) {
        let WaitingEvent { event, handed, is_handed, is_alone } = waiting;
        match self.own.admit(event) {
            Some((before, event)) => {
                self.waiting.extend(before.into_iter().map(|event| WaitingEvent::added(event, handed)));
                self.waiting.push_back(WaitingEvent { event, handed, is_handed, is_alone });
            }
            None => {
                self.pending -= usize::from(is_handed);
                self.done += usize::from(is_handed);
            }
        }
    }

    /// Number of the program's events since the last call that need not be sent, because they end strokes that have ended
    /// already.
    pub(super) fn take_done(&mut self) -> usize {
        std::mem::take(&mut self.done)
    }

    /// Lets the author leave after all waiting events.
    pub(super) fn leave(&mut self, now: Duration) {
        let event = Event::Leave { t: now.as_secs_f64(), author: super::ME };
        self.waiting.push_back(WaitingEvent::added(event, now));
    }

    pub(super) fn pump(&mut self, now: Duration) -> Vec<Outgoing> {
        let mut out = Vec::new();
        if self.author.is_none() {
            if self.in_flight.is_empty() {
                let event = Event::Join {
                    t: now.as_secs_f64(),
                    author: super::ME,
                    name: self.who.name.clone(),
                    color: self.who.color,
                };
                out.extend(self.start(vec![WaitingEvent::added(event, now)]));
            }
            return out;
        }
        while self.in_flight.len() < WINDOW {
            let Some(events) = self.next_events(now) else { break };
            out.extend(self.start(events));
        }
        out
    }

    /// The events of the next message: as many waiting events as fit.
    fn next_events(&mut self, now: Duration) -> Option<Vec<WaitingEvent>> {
        let author = self.author?;
        loop {
            let (mut text, mut count) = (String::new(), 0);
            for waiting in self.waiting.iter().take(packet::MAX_EVENTS) {
                if waiting.is_alone && count > 0 {
                    break;
                }
                let before = text.len();
                let event = self.own.event(&waiting.event, author, self.later_secs);
                if !packet::push(&mut text, &event) {
                    break;
                }
                let most = if count == 0 { self.limit_bytes } else { self.limit_bytes.min(USUAL_BYTES) };
                if text.len() > most.saturating_sub(packet::HEAD_BYTES) {
                    text.truncate(before);
                    break;
                }
                count += 1;
                if waiting.is_alone {
                    break;
                }
            }
            if count == 0 {
                // The event is too long for a message by itself.
                let waiting = self.waiting.pop_front()?;
                self.pending -= usize::from(waiting.is_handed);
                self.too_long += u64::from(waiting.is_handed);
                continue;
            }
            let nanos = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
            return self.rate.take(text.len(), nanos).then(|| self.waiting.drain(..count).collect());
        }
    }

    fn start(&mut self, events: Vec<WaitingEvent>) -> Option<Outgoing> {
        // A member that has not joined yet gets its author number with the answer.
        let author = self.author.unwrap_or(Author(1));
        let mut text = packet::head(self.sender, self.next);
        for waiting in &events {
            if !packet::push(&mut text, &self.own.event(&waiting.event, author, self.later_secs)) {
                return None;
            }
        }
        let message = InFlight { number: self.next, bytes: text.into_bytes(), events };
        self.next += 1;
        let outgoing = self.outgoing(&message);
        self.in_flight.push_back(message);
        Some(outgoing)
    }

    fn outgoing(&self, message: &InFlight) -> Outgoing {
        let id = format!("{:016x}-{}-{}", self.sender.0, message.number, self.attempt);
        Outgoing { id, bytes: message.bytes.clone() }
    }

    pub(super) fn again(&mut self) -> Vec<Outgoing> {
        if std::mem::take(&mut self.needs_new_ids) {
            self.attempt += 1;
        }
        self.in_flight.iter().map(|message| self.outgoing(message)).collect()
    }

    /// Records that a message of this member did not count, although it can count later. The server has stored the
    /// message, and would drop a repetition under the same id.
    pub(super) fn ignored(&mut self) {
        self.needs_new_ids = true;
    }

    /// Whether these bytes are this member's message that has to come back next. The bytes are compared, because sender
    /// numbers are not secret: anybody with write access can use them.
    pub(super) fn is_next(&self, bytes: &[u8]) -> bool {
        self.in_flight.front().is_some_and(|message| message.bytes == bytes)
    }

    /// Records that the next own message counts in the log, as a message of this author.
    pub(super) fn taken(&mut self, author: Author) -> Answered {
        self.author = Some(author);
        let Some(message) = self.in_flight.pop_front() else { return Answered::default() };
        message.events.iter().for_each(|waiting| self.own.taken(&waiting.event, author));
        let answered = message.answered();
        self.pending -= answered.handed;
        answered
    }

    /// Records that the log has refused the next own message. Its events are sent once more, each in a message of its
    /// own, so that an impossible event does not affect the other events.
    pub(super) fn refused(&mut self) -> Answered {
        let Some(message) = self.in_flight.pop_front() else { return Answered::default() };
        if message.events.len() > 1 {
            for waiting in message.events.into_iter().rev() {
                self.waiting.push_front(WaitingEvent { is_alone: true, ..waiting });
            }
            return Answered::default();
        }
        let answered = message.answered();
        self.pending -= answered.handed;
        answered
    }

    /// Joins again under a new sender number, because the author was declared gone. The missing events are sent after that.
    pub(super) fn join_again(&mut self, sender: Sender) {
        let unacknowledged = self.in_flight.drain(..).flat_map(|message| message.events);
        let unacknowledged = unacknowledged.filter(|waiting| !matches!(waiting.event, Event::Join { .. }));
        let mut waiting: Vec<WaitingEvent> = unacknowledged.collect();
        waiting.extend(self.waiting.drain(..));
        self.own.interrupt();
        waiting.into_iter().for_each(|waiting| self.admit(waiting));
        (self.sender, self.author, self.next, self.attempt) = (sender, None, 0, 0);
        self.needs_new_ids = false;
    }
}
