//! A member's connection to a shared session: a thread that exchanges messages with the server, and the handles for the
//! rest of the program.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicUsize, Ordering},
    mpsc,
};
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tokio::sync::mpsc as queue;

use super::{
    Address, Latency, LiveError, News, Role, Status,
    background::Background,
    connection,
    state::{Command, Shared, lock},
};
use osp_session::recording::Event;

/// A handle for drawing into a shared session, from any thread.
#[derive(Clone, Debug)]
pub struct Hand {
    commands: queue::UnboundedSender<Command>,
    shared: Arc<Shared>,
}

impl Hand {
    /// The time of this member's events: seconds since the link was opened. This time is converted to the session's
    /// time later.
    pub fn now_secs(&self) -> f64 {
        self.shared.started.elapsed().as_secs_f64()
    }

    /// Sends a frame's events. In the events, this member's strokes and groups belong to the author [`ME`](super::ME).
    /// The member's author number replaces this author later. The events come back in [`News::Events`]. A watcher sends
    /// nothing.
    pub fn send(&self, events: Vec<Event>) {
        if !events.is_empty() {
            // If the thread has ended, the last news has the reason.
            let _ = self.commands.send(Command::Send(events, Instant::now()));
        }
    }

    /// Number of this member's events that are not in the session yet, by the last state of the connection.
    pub fn pending(&self) -> usize {
        lock(&self.shared.status).pending
    }

    /// Leaves the session after all sent events; [`News::Left`] follows. Events of the session continue to arrive.
    pub fn leave(&self) {
        let _ = self.commands.send(Command::Leave);
    }
}

/// A member's connection; see the [module](super). Dropping it closes the connection. Call [`Hand::leave`] first, so
/// that the other members are informed.
#[derive(Debug)]
pub struct Link {
    /// Dropping it closes the connection.
    _background: Background,
    commands: queue::UnboundedSender<Command>,
    news: mpsc::Receiver<Result<News, LiveError>>,
    shared: Arc<Shared>,
}

impl Link {
    /// Opens a link. A thread connects, and retries until the server answers. It calls `wake` whenever there is news.
    ///
    /// # Errors
    /// The system provides no thread.
    pub fn open(address: &Address, role: &Role, wake: impl Fn() + Send + 'static) -> Result<Self, LiveError> {
        let (commands, todo) = queue::unbounded_channel();
        let (out, news) = mpsc::channel();
        let shared = Arc::new(Shared {
            started: Instant::now(),
            status: Mutex::default(),
            latency_us: Mutex::new(Histogram::new(3).expect("three digits are allowed")),
            untaken: AtomicUsize::new(0),
        });
        let (address, role, with) = (address.clone(), role.clone(), Arc::clone(&shared));
        let work = move || async move {
            if let Err(error) = connection::exchange(&address, &role, todo, &out, &wake, &with).await {
                let _ = out.send(Err(error));
                wake();
            }
        };
        let background = Background::start("live", work).map_err(LiveError::System)?;
        Ok(Self { _background: background, commands, news, shared })
    }

    /// A handle for drawing, which any thread can use.
    pub fn hand(&self) -> Hand {
        Hand { commands: self.commands.clone(), shared: Arc::clone(&self.shared) }
    }

    /// The next news, if any was received.
    ///
    /// # Errors
    /// The connection has ended permanently.
    pub fn news(&self) -> Result<Option<News>, LiveError> {
        match self.news.try_recv() {
            Err(mpsc::TryRecvError::Disconnected) => Err(LiveError::Ended),
            news => self.take(news.ok()),
        }
    }

    /// The next news, if any is received within `time`.
    ///
    /// # Errors
    /// The connection has ended permanently.
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

    /// State of the connection.
    pub fn status(&self) -> Status {
        lock(&self.shared.status).clone()
    }

    /// Round-trip times of this member's messages.
    pub fn latency(&self) -> Latency {
        Latency::of(&lock(&self.shared.latency_us))
    }
}
