//! Makes one session from the messages of several authors.
//!
//! Every author sends messages, numbered from 0, into one log that all read in the same order: a message server's
//! stream, a file, a test's list. A [`Reducer`] turns that order into the events of the session; every author's
//! reducer makes the same events. A sender repeats a message until it is acknowledged, so messages may come twice,
//! late or after a gap:
//!
//! - A message counts only if its number is the next one of its sender. Every reducer passes over all others.
//! - The first message of a sender begins with [`Event::Join`]. It gets the next [`Author`] number, whatever number
//!   the event names. All later events have to be of this author, and their strokes have to have its numbers.
//! - A message with an invalid event has no effect, but its number is used: the sender continues with the next. An
//!   author whose joining message is invalid has not joined.
//! - [`Event::Leave`] is the last event of an author. The host may send it for an author who has been silent for long.
//!
//! A reducer has no clock and no random numbers.

use std::collections::BTreeMap;

use super::{
    Author, Event,
    members::{Admitted, Members, Numbers},
};

/// Sender of messages: a number that each sender chooses at random whenever it joins; 0 is the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Sender(pub u64);

impl Sender {
    /// The process that runs the session. It need not join. Its events are those of [`Author::SOLE`], the author of
    /// everything before the first join, and it may send [`Event::Leave`] for other authors.
    pub const HOST: Self = Self(0);
}

/// Events that a sender sends together, most often those of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The sender.
    pub sender: Sender,
    /// The number of the message among those of its sender, from 0.
    pub number: u64,
    /// The events.
    pub events: Vec<Event>,
}

/// Effect of a message on the session.
#[derive(Clone, Debug, PartialEq)]
pub enum Reduced {
    /// It counts; its events are the next ones of the session.
    Taken,
    /// It has counted before.
    Duplicate,
    /// A message with this number of the same sender has to come first.
    Gap(u64),
    /// The sender has not joined, or has left.
    Stranger,
    /// It was the next one of its sender, but is invalid for this reason: it has no effect.
    Refused(String),
}

#[derive(Clone, Copy, Debug)]
struct State {
    author: Author,
    next: u64,
}

/// Makes a session of messages; see the [module](self).
#[derive(Clone, Debug, Default)]
pub struct Reducer {
    members: Members,
    senders: BTreeMap<Sender, State>,
}

impl Reducer {
    /// Before the first message.
    pub fn new() -> Self {
        Self::default()
    }

    /// The author that a sender has become; none before it has joined.
    pub fn author_of(&self, sender: Sender) -> Option<Author> {
        match sender {
            Sender::HOST => Some(Author::SOLE),
            _ => self.senders.get(&sender).map(|state| state.author),
        }
    }

    /// The number of a sender's next message that will count.
    pub fn next_of(&self, sender: Sender) -> u64 {
        self.senders.get(&sender).map_or(0, |state| state.next)
    }

    /// Takes the next message of the log and appends its events to `out`.
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
                    // The sender of an invalid joining message remains unknown.
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
    members.admit(event, Numbers::EachInTurn).map_err(|expected| format!("expected {expected}"))
}
