//! Role and state of a connection.

use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicUsize, Ordering},
};
use std::time::Instant;

use hdrhistogram::Histogram;

use super::{Counts, Who};
use osp_session::recording::{Author, Event};

/// Whether a member draws or watches.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// An author, with name and colour.
    Author(Who),
    /// A watcher, which publishes nothing and does not create a missing session.
    Watcher,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Connection {
    /// The server has not answered yet.
    #[default]
    Connecting,
    /// The log is being read, up to its end at the time when the connection began.
    Reading {
        read: u64,
        /// Number of messages to read.
        of: u64,
    },
    /// The log is read; new messages are received without delay.
    Live,
    /// The server does not answer. This member's events are stored, and sent when it answers.
    Silent,
    /// More authors have joined within a short time than a session accepts. This member retries until it may join. This
    /// member's events are stored until then.
    Crowded,
    /// The session is at its largest size. It accepts no more events, and no author can join.
    Full,
}

/// State of a member's connection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    pub connection: Connection,
    /// The last error of the server or the system since the connection was live.
    pub trouble: Option<String>,
    /// The author number of this member.
    pub author: Option<Author>,
    /// Number of authors that are present.
    pub authors: usize,
    /// Number of this member's events that are not in the session yet.
    pub pending: usize,
    /// Whether the log was read to its end at least once.
    pub has_caught_up: bool,
    pub counts: Counts,
    /// The error of the last faulty message ([`Counts::faulty`]), with its number in the log.
    pub last_passed: Option<String>,
}

#[derive(Debug)]
pub(super) enum Command {
    Send(Vec<Event>, Instant),
    Leave,
}

/// State shared by the thread and the program.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) started: Instant,
    pub(super) status: Mutex<Status>,
    pub(super) latency_us: Mutex<Histogram<u64>>,
    /// Number of events that the thread has sent to the program and that the program has not read yet.
    pub(super) untaken: AtomicUsize,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // The values are replaced as a whole, so a panic leaves no half-written value.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    pub(super) fn set(&self, status: Status, latency_us: &Histogram<u64>) {
        *lock(&self.status) = status;
        let mut shown = lock(&self.latency_us);
        if shown.len() != latency_us.len() {
            shown.clone_from(latency_us);
        }
    }

    pub(super) fn note_untaken(&self, events: usize) {
        self.untaken.fetch_add(events, Ordering::Relaxed);
    }

    pub(super) fn untaken(&self) -> usize {
        self.untaken.load(Ordering::Relaxed)
    }
}
