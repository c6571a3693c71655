//! A member's end of a shared session: a thread that speaks with the server, and what the rest of the program sees of it.

use std::path::PathBuf;
use std::sync::{
    Arc, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicUsize, Ordering},
    mpsc,
};
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use thiserror::Error;
use tokio::sync::mpsc as queue;

use super::{Address, Counts, Latency, News, Who, background::Background, connection};
use osp_session::recording::{Author, Event};

/// Why a connection has ended for good.
#[derive(Debug, Error)]
pub enum LiveError {
    /// The system gives no thread or socket.
    #[error("no connection can be begun")]
    System(#[source] std::io::Error),
    /// The server does not let this member in.
    #[error("{server}: the server does not let us in: {why}")]
    NotAllowed {
        /// The server.
        server: String,
        /// What it said.
        why: String,
    },
    /// The encryption fails.
    #[error("{server}: no encrypted connection: {why}")]
    NotEncrypted {
        /// The server.
        server: String,
        /// What is wrong.
        why: String,
    },
    /// The server has no log to keep a session in.
    #[error("{server}: expected a server of NATS with JetStream (nats-server -js); {why}")]
    NoJetStream {
        /// The server.
        server: String,
        /// What it said.
        why: String,
    },
    /// The thread of the connection has ended without a word, or its last error was taken already.
    #[error("the connection has ended")]
    Ended,
    /// The session that was read is not on the server any more.
    #[error("{session}: the server has lost the session, or has another one of this name")]
    Lost {
        /// The session.
        session: String,
    },
}

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
    status: Mutex<Status>,
    latency_us: Mutex<Histogram<u64>>,
    /// Events in news that nobody has taken yet.
    untaken: AtomicUsize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
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

/// What draws into a shared session, from any thread.
#[derive(Clone, Debug)]
pub struct Hand {
    commands: queue::UnboundedSender<Command>,
    shared: Arc<Shared>,
}

impl Hand {
    /// The time of events: seconds since the link was opened. The session's own time follows from it.
    pub fn now_secs(&self) -> f64 {
        self.shared.started.elapsed().as_secs_f64()
    }

    /// Sends a frame's events, which may name own strokes and groups as [`ME`](super::ME)'s; who the author is, is filled
    /// in. They come back in [`News::Events`]. For a watcher it does nothing.
    pub fn send(&self, events: Vec<Event>) {
        if !events.is_empty() {
            // Where the thread has ended, the last news says why.
            let _ = self.commands.send(Command::Send(events, Instant::now()));
        }
    }

    /// Own events that are not in the session yet, as far as the connection knows of them.
    pub fn pending(&self) -> usize {
        lock(&self.shared.status).pending
    }

    /// Leaves the session after what was sent: [`News::Left`] follows. The session goes on to come in.
    pub fn leave(&self) {
        let _ = self.commands.send(Command::Leave);
    }
}

/// See the [module](super). Dropping it ends the connection; [`Hand::leave`] first tells the others.
#[derive(Debug)]
pub struct Link {
    /// Dropping it ends the connection.
    _background: Background,
    commands: queue::UnboundedSender<Command>,
    news: mpsc::Receiver<Result<News, LiveError>>,
    shared: Arc<Shared>,
}

impl Link {
    /// Begins to connect, on a thread of its own, and goes on until there is a server. `wake` is called there whenever
    /// there is news.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn open(
        address: &Address,
        options: &LinkOptions,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, LiveError> {
        let (commands, todo) = queue::unbounded_channel();
        let (tell, news) = mpsc::channel();
        let shared = Arc::new(Shared {
            started: Instant::now(),
            status: Mutex::default(),
            latency_us: Mutex::new(Histogram::new(3).expect("three digits are allowed")),
            untaken: AtomicUsize::new(0),
        });
        let (address, options, with) = (address.clone(), options.clone(), Arc::clone(&shared));
        let work = move || async move {
            if let Err(error) = connection::talk(&address, &options, todo, &tell, &wake, &with).await {
                let _ = tell.send(Err(error));
                wake();
            }
        };
        let background = Background::start("live", work).map_err(LiveError::System)?;
        Ok(Self { _background: background, commands, news, shared })
    }

    /// What draws, for any thread.
    pub fn hand(&self) -> Hand {
        Hand { commands: self.commands.clone(), shared: Arc::clone(&self.shared) }
    }

    /// The next news that is there.
    ///
    /// # Errors
    /// The connection has ended for good.
    pub fn news(&self) -> Result<Option<News>, LiveError> {
        match self.news.try_recv() {
            Err(mpsc::TryRecvError::Disconnected) => Err(LiveError::Ended),
            news => self.take(news.ok()),
        }
    }

    /// The next news, if there is some before so much time is over.
    ///
    /// # Errors
    /// The connection has ended for good.
    pub fn news_within(&self, time: Duration) -> Result<Option<News>, LiveError> {
        match self.news.recv_timeout(time) {
            Err(mpsc::RecvTimeoutError::Disconnected) => Err(LiveError::Ended),
            news => self.take(news.ok()),
        }
    }

    fn take(&self, news: Option<Result<News, LiveError>>) -> Result<Option<News>, LiveError> {
        let news = news.transpose()?;
        if let Some(News::Events { events, .. }) = &news {
            self.shared.untaken.fetch_sub(events.len(), Ordering::Relaxed);
        }
        Ok(news)
    }

    /// What is known of the connection.
    pub fn status(&self) -> Status {
        lock(&self.shared.status).clone()
    }

    /// How long own messages took to come back.
    pub fn latency(&self) -> Latency {
        Latency::of(&lock(&self.shared.latency_us))
    }
}
