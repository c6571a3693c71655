//! Options and state of a connection.

use std::path::PathBuf;
use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicUsize, Ordering},
};
use std::time::Instant;

use hdrhistogram::Histogram;

use super::{Counts, Who};
use osp_session::recording::{Author, Event};

/// Whether a member draws.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// An author, by name and colour.
    Author(Who),
    /// A watcher. It publishes nothing, and does not create a missing session.
    Watcher,
}

/// Options of a connection.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkOptions {
    /// Role in the session.
    pub role: Role,
    /// A file of certificates (PEM) to trust beside those of the system.
    pub certificates: Option<PathBuf>,
}

/// State of the connection.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Connection {
    /// There was none yet.
    #[default]
    Connecting,
    /// The log is read up to what it was when the connection began.
    Reading {
        /// Messages that were read.
        read: u64,
        /// Messages to read.
        of: u64,
    },
    /// Every message arrives at once.
    Live,
    /// The server does not answer. Own events are stored and sent once it does.
    Silent,
    /// More authors have joined than a session takes at once: this member tries again until it may join, too. Own events are
    /// stored until then.
    Crowded,
    /// The session is at its limit: it takes no more events, and nobody may join.
    Full,
}

/// State of a member's connection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// State of the connection.
    pub connection: Connection,
    /// Last error of the server or the system since the connection was live.
    pub trouble: Option<String>,
    /// Author number of this member.
    pub author: Option<Author>,
    /// Authors that are there.
    pub authors: usize,
    /// Own events that are not in the session yet.
    pub pending: usize,
    /// Whether the log was read to its end at least once.
    pub has_caught_up: bool,
    /// Counts.
    pub counts: Counts,
    /// Error of the last faulty message ([`Counts::faulty`]), with its number in the log.
    pub last_passed: Option<String>,
}

/// Commands to the thread.
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
    /// Events in news that nobody has taken yet.
    pub(super) untaken: AtomicUsize,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Whole values are put there.
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
