//! Makes one session from the messages of several authors.
//!
//! Every author sends messages, numbered from 0, to a shared log. All authors read the log in the same order. A
//! [`Reducer`] converts the log to the events of the session, the same events for every author. A sender repeats a
//! message until it is acknowledged, so messages may arrive twice, late or after a gap:
//!
//! - A message counts only if its number is its sender's next number. Every reducer ignores all other messages.
//! - The first message of a sender begins with [`Event::Join`]. The reducer gives the sender the next [`Author`]
//!   number, whatever number the event contains. All later events of the sender must have this author, and their
//!   strokes must have the author's numbers.
//! - A message with an invalid event has no effect, but its number counts: the sender continues with the next number.
//!   An author whose joining message is invalid has not joined.
//! - [`Event::Leave`] is the last event of an author. The host may send it for an author who has long been inactive.
//!
//! A reducer uses no clock and no random numbers.

use std::collections::BTreeMap;

use super::{
    Author, Event,
    members::{Admitted, AuthorNumbers, Members},
};

/// Identifier of a sender of messages: a random number that each sender chooses when it joins; 0 is the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Sender(pub u64);

impl Sender {
    /// The process that runs the session. It need not join. Its events have the author [`Author::SOLE`], like all
    /// events before the first join. It may send [`Event::Leave`] for other authors.
    pub const HOST: Self = Self(0);
}

/// Events that a sender sends together, usually those of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    pub sender: Sender,
    /// The number of the message among the sender's messages, from 0.
    pub number: u64,
    pub events: Vec<Event>,
}

/// Effect of a message on the session.
#[derive(Clone, Debug, PartialEq)]
pub enum Reduced {
    /// The message counts. Its events are the next events of the session.
    Taken,
    /// The message has counted before.
    Duplicate,
    /// Messages are missing: the sender's next message must have this number.
    Gap(u64),
    /// The sender has not joined, or has left.
    Stranger,
    /// The message has the sender's next number, but is invalid and has no effect. Contains the reason.
    Refused(String),
}

#[derive(Clone, Copy, Debug)]
struct State {
    author: Author,
    next: u64,
}

/// Converts messages to the events of a session; see the [module](self).
#[derive(Clone, Debug, Default)]
pub struct Reducer {
    members: Members,
    senders: BTreeMap<Sender, State>,
}

impl Reducer {
    pub fn new() -> Self {
        Self::default()
    }

    /// The author of a sender; `None` before the sender has joined.
    pub fn author_of(&self, sender: Sender) -> Option<Author> {
        match sender {
            Sender::HOST => Some(Author::SOLE),
            _ => self.senders.get(&sender).map(|state| state.author),
        }
    }

    /// The number that the sender's next message must have.
    pub fn next_of(&self, sender: Sender) -> u64 {
        self.senders.get(&sender).map_or(0, |state| state.next)
    }

    /// Processes the next message of the log and appends its events to `out`.
    pub fn take(&mut self, message: &Message, out: &mut Vec<Event>) -> Reduced {
        let next = self.next_of(message.sender);
        match message.number.cmp(&next) {
            std::cmp::Ordering::Less => return Reduced::Duplicate,
            std::cmp::Ordering::Greater => return Reduced::Gap(next),
            std::cmp::Ordering::Equal => {}
        }
        let known = self.author_of(message.sender);
        let joins = known.is_none() && matches!(message.events.first(), Some(Event::Join { .. }));
        let author = match (known, self.members.next()) {
            (Some(author), _) if author.is_sole() || self.members.is_present(author) => author,
            (None, Some(next)) if joins => next,
            (None, None) if joins => {
                return Reduced::Refused(format!("expected at most {} authors", Author::MAX - 1));
            }
            _ => return Reduced::Stranger,
        };
        let first = out.len();
        let mut admitted = Vec::new();
        for (event, place) in message.events.iter().zip(0..) {
            let mut event = event.clone();
            let may_join = joins && place == 0;
            if let Event::Join { author: of, .. } = &mut event
                && may_join
            {
                *of = author;
            }
            match admit(&mut self.members, &event, author, may_join) {
                Ok(step) => admitted.push(step),
                Err(why) => {
                    admitted.into_iter().rev().for_each(|step| self.members.take_back(step));
                    out.truncate(first);
                    // A sender whose joining message is invalid has not joined.
                    if !joins {
                        self.senders.insert(message.sender, State { author, next: next + 1 });
                    }
                    return Reduced::Refused(format!("event {}: {why}", place + 1));
                }
            }
            out.push(event);
        }
        self.senders.insert(message.sender, State { author, next: next + 1 });
        Reduced::Taken
    }
}

fn admit(members: &mut Members, event: &Event, author: Author, may_join: bool) -> Result<Admitted, String> {
    event.check().map_err(|expected| format!("expected {expected}"))?;
    let is_allowed = match event {
        Event::Join { .. } => may_join,
        Event::Leave { author: of, .. } => *of == author || author.is_sole(),
        Event::Point { stroke, .. } | Event::End { stroke, .. } => stroke.author() == author,
        _ => event.author() == Some(author),
    };
    if !is_allowed {
        return Err(format!("expected an event of author {author}"));
    }
    members.admit(event, AuthorNumbers::Consecutive).map_err(|expected| format!("expected {expected}"))
}
