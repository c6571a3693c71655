//! The connection for messages of hub and computers. It has its own thread, because hub and computers wait only for
//! frames.
//!
//! Without a server, messages are dropped, because the frame they belong to is over when the server answers again.

use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use async_nats::{Client, Message, connection::State};
use futures_util::{StreamExt as _, stream::select_all};
use tokio::{runtime::Builder, sync::mpsc as queue};

use super::{WallError, message::MAX_BYTES};
use crate::live::{Address, Background, Complaints, LinkOptions, LiveError, Role, connect};

/// Subject of the hub's messages to all computers.
pub(super) const HUB: &str = "hub";
/// Subject of the computers' messages to the hub.
pub(super) const NODE: &str = "node";
/// Subject of requests for the state of the wall.
pub(super) const STATUS: &str = "status";

/// Largest number of unread messages; further messages are dropped.
const MOST_WAITING: usize = 4096;
/// Interval of checks for refusals of the server.
const CHECK_EVERY: Duration = Duration::from_millis(500);

/// A received message.
#[derive(Debug)]
pub(super) struct Received {
    /// Index of the message's subject among the subscribed subjects.
    pub(super) on: usize,
    pub(super) bytes: Vec<u8>,
    /// Subject for a reply.
    pub(super) reply: Option<String>,
}

/// The connection; see the [module](self). Dropping it closes the connection.
#[derive(Debug)]
pub(super) struct Wire {
    /// Messages to publish; `None` once the connection ends.
    outgoing: Option<queue::UnboundedSender<(String, String)>>,
    incoming: mpsc::Receiver<Result<Received, WallError>>,
    to: String,
    /// Dropping it closes the connection.
    _background: Background,
}

fn options(certificates: Option<PathBuf>) -> LinkOptions {
    LinkOptions { role: Role::Watcher, certificates }
}

impl Wire {
    /// Opens a connection. A thread connects, and retries until the server answers. It calls `wake` for every message.
    pub(super) fn open(
        address: &Address,
        certificates: Option<PathBuf>,
        subscriptions: &[&str],
        publishes_to: &str,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, WallError> {
        let (outgoing, queued) = queue::unbounded_channel();
        let (sink, incoming) = mpsc::sync_channel(MOST_WAITING);
        let subjects = Subjects {
            subscriptions: subscriptions.iter().map(|what| address.wall(what)).collect(),
            publishes_to: address.wall(publishes_to),
        };
        let to = subjects.publishes_to.clone();
        let (address, options) = (address.clone(), options(certificates));
        let work = move || async move {
            if let Err(error) = carry(&address, &options, &subjects, queued, &sink, &wake).await {
                // The error follows the waiting messages. If the queue is full, the queue just ends.
                let _ = sink.try_send(Err(error.into()));
                wake();
            }
        };
        let background = Background::start("wall", work).map_err(WallError::System)?;
        Ok(Self { outgoing: Some(outgoing), incoming, to, _background: background })
    }

    /// Publishes a message to all subscribers.
    pub(super) fn publish(&self, text: String) {
        self.answer(self.to.clone(), text);
    }

    /// Publishes a reply to a request.
    pub(super) fn answer(&self, reply: String, text: String) {
        // If the thread has ended, the next call of `receive` returns the reason.
        let _ = self.outgoing.as_ref().map(|outgoing| outgoing.send((reply, text)));
    }

    /// The next message, if it is received within `time`.
    pub(super) fn receive(&self, time: Duration) -> Result<Option<Received>, WallError> {
        match self.incoming.recv_timeout(time) {
            Ok(incoming) => incoming.map(Some),
            Err(mpsc::RecvTimeoutError::Timeout) => Ok(None),
            Err(mpsc::RecvTimeoutError::Disconnected) => Err(LiveError::Ended.into()),
        }
    }
}

/// Longest time for the last messages to reach the server.
const CLOSING_TIME: Duration = Duration::from_millis(300);

impl Drop for Wire {
    fn drop(&mut self) {
        drop(self.outgoing.take());
        // The thread ends after it has sent the waiting messages, if the server answers.
        let ending = Instant::now();
        while ending.elapsed() < CLOSING_TIME && self.incoming.recv_timeout(CLOSING_TIME).is_ok() {}
    }
}

/// Subjects of a connection.
struct Subjects {
    subscriptions: Vec<String>,
    publishes_to: String,
}

async fn carry(
    address: &Address,
    options: &LinkOptions,
    subjects: &Subjects,
    mut queued: queue::UnboundedReceiver<(String, String)>,
    sink: &mpsc::SyncSender<Result<Received, WallError>>,
    wake: &(dyn Fn() + Send),
) -> Result<(), LiveError> {
    let complaints = Arc::new(Complaints::default());
    let not_allowed = |why| LiveError::NotAllowed { server: address.server(), why };
    let mut connecting = std::pin::pin!(connect(address, options, &complaints));
    let client = loop {
        tokio::select! {
            client = &mut connecting => break client?,
            outgoing = queued.recv() => if outgoing.is_none() { return Ok(()) },
        }
    };
    let mut all = Vec::new();
    for (on, subject) in subjects.subscriptions.iter().enumerate() {
        let incoming =
            client.subscribe(subject.clone()).await.map_err(|error| not_allowed(error.to_string()))?;
        all.push(incoming.map(move |message| (on, message)).boxed());
    }
    let mut all = select_all(all);
    let mut looks = tokio::time::interval(CHECK_EVERY);
    looks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            // Messages to publish come before received messages.
            biased;
            outgoing = queued.recv() => {
                let Some((subject, text)) = outgoing else {
                    // The server may be gone.
                    let _ = tokio::time::timeout(CLOSING_TIME, client.flush()).await;
                    return Ok(());
                };
                publish(&client, subject, text).await;
            }
            _ = looks.tick() => {
                let used = subjects.subscriptions.iter().chain([&subjects.publishes_to]);
                if let Some(why) = used.filter_map(|subject| complaints.forbids(subject)).next() {
                    return Err(not_allowed(why));
                }
            }
            incoming = all.next() => {
                let Some((on, Message { payload, reply, .. })) = incoming else { return Ok(()) };
                // One byte beyond the limit is enough to detect that the message is too long.
                let bytes = payload[..payload.len().min(MAX_BYTES + 1)].to_vec();
                let incoming = Received { on, bytes, reply: reply.map(|subject| subject.to_string()) };
                match sink.try_send(Ok(incoming)) {
                    Ok(()) | Err(mpsc::TrySendError::Full(_)) => wake(),
                    Err(mpsc::TrySendError::Disconnected(_)) => return Ok(()),
                }
            }
        }
    }
}

async fn publish(client: &Client, subject: String, text: String) {
    if client.connection_state() == State::Connected {
        // The client library itself reports a lost server.
        let _ = client.publish(subject, text.into()).await;
    }
}

/// Requests the state of a wall; `None` without an answer.
pub(super) fn ask(
    address: &Address,
    certificates: Option<PathBuf>,
    patience: Duration,
) -> Result<Option<Vec<u8>>, WallError> {
    let runtime = Builder::new_current_thread().enable_all().build().map_err(WallError::System)?;
    let answer = runtime.block_on(async {
        let complaints = Arc::new(Complaints::default());
        let options = options(certificates);
        let connecting = connect(address, &options, &complaints);
        let Ok(client) = tokio::time::timeout(patience, connecting).await else {
            let why = complaints.get().0.unwrap_or_else(|| "it does not answer".to_owned());
            return Err(WallError::NoServer { server: address.server(), why });
        };
        let client = client?;
        let asked = client.request(address.wall(STATUS), "".into());
        Ok(match tokio::time::timeout(patience, asked).await {
            Ok(Ok(answer)) => Some(answer.payload.to_vec()),
            // No hub runs, no hub answers, or the server forbids the request.
            Ok(Err(_)) | Err(_) => match complaints.forbids(&address.wall(STATUS)) {
                Some(why) => return Err(LiveError::NotAllowed { server: address.server(), why }.into()),
                None => None,
            },
        })
    });
    // The shutdown does not wait, because a DNS look-up may hang.
    runtime.shutdown_background();
    answer
}
