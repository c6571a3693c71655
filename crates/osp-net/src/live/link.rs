//! A member's end of a shared session: a thread that speaks with the server, and what the rest of the program sees of it.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicUsize, Ordering},
    mpsc,
};
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use tokio::sync::mpsc as queue;

use super::{
    Address, Latency, LinkOptions, LiveError, News, Status,
    background::Background,
    connection,
    state::{Command, Shared, lock},
};
use osp_session::recording::Event;

/// Handle for drawing into a shared session, from any thread.
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

    /// Own events that are not in the session yet, by the connection's last state.
    pub fn pending(&self) -> usize {
        lock(&self.shared.status).pending
    }

    /// Leaves the session after what was sent: [`News::Left`] follows. The session continues to come in.
    pub fn leave(&self) {
        let _ = self.commands.send(Command::Leave);
    }
}

/// See the [module](super). Dropping it ends the connection; [`Hand::leave`] first informs the others.
#[derive(Debug)]
pub struct Link {
    /// Dropping it ends the connection.
    _background: Background,
    commands: queue::UnboundedSender<Command>,
    news: mpsc::Receiver<Result<News, LiveError>>,
    shared: Arc<Shared>,
}

impl Link {
    /// Begins to connect, on a thread of its own, and continues until there is a server. `wake` is called there whenever
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

    /// The handle for drawing, for any thread.
    pub fn hand(&self) -> Hand {
        Hand { commands: self.commands.clone(), shared: Arc::clone(&self.shared) }
    }

    /// The next news, if any.
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

    /// State of the connection.
    pub fn status(&self) -> Status {
        lock(&self.shared.status).clone()
    }

    /// Times of own messages until they came back.
    pub fn latency(&self) -> Latency {
        Latency::of(&lock(&self.shared.latency_us))
    }
}
