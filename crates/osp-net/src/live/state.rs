//! What a connection is told, and what is known of it.

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
    /// Who draws, by name and colour.
    Author(Who),
    /// Who only looks. It publishes nothing, and does not make a session that is not there.
    Watcher,
}

/// How to connect.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkOptions {
    /// What one does there.
    pub role: Role,
    /// A file of certificates (PEM) to trust beside those of the system.
    pub certificates: Option<PathBuf>,
}

/// What the connection is doing.
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
    /// Everything said comes in at once.
    Live,
    /// The server does not answer. What is drawn is kept and sent once it does.
    Silent,
    /// More authors have joined than a session takes at once: this member tries again until it may join, too. What is drawn is
    /// kept until then.
    Crowded,
    /// The session holds as much as one may: what is drawn is not taken any more, and nobody may join.
    Full,
}

/// What a member knows of its connection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// What the connection is doing.
    pub connection: Connection,
    /// What the server or the system has complained about last, since the connection was live.
    pub trouble: Option<String>,
    /// Which author this member is.
    pub author: Option<Author>,
    /// Authors that are there.
    pub authors: usize,
    /// Own events that are not in the session yet.
    pub pending: usize,
    /// Whether the log was read to its end at least once.
    pub has_caught_up: bool,
    /// Counts.
    pub counts: Counts,
    /// What is wrong with the last faulty message ([`Counts::faulty`]), with its number in the log.
    pub last_passed: Option<String>,
}

/// What the thread is told.
#[derive(Debug)]
pub(super) enum Command {
    Send(Vec<Event>, Instant),
    Leave,
}

/// What the thread and the program share.
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
