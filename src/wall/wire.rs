//! The connection that carries what hub and nodes say: on a thread of its own, for the rest waits for nothing but a frame.
//!
//! Nothing is kept for later: what cannot be sent at once is about a frame that is over by then.

use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use async_nats::{Client, Message, connection::State};
use futures_util::{StreamExt as _, stream::select_all};
use tokio::{
    runtime::{Builder, Runtime},
    sync::{mpsc as queue, oneshot},
};

use super::WallError;
use crate::live::{Address, Complaints, LinkOptions, LiveError, Role, connect};

/// What the hub says to all nodes.
pub(super) const HUB: &str = "hub";
/// What nodes say to the hub.
pub(super) const NODE: &str = "node";
/// Questions for the state of the wall.
pub(super) const STATUS: &str = "status";

/// Something that was said.
#[derive(Debug)]
pub(super) struct Heard {
    pub(super) bytes: Vec<u8>,
    /// Where an answer goes.
    pub(super) reply: Option<String>,
}

/// See the [module](self). Dropping it ends the connection.
#[derive(Debug)]
pub(super) struct Wire {
    /// `None` once it ends.
    said: Option<queue::UnboundedSender<(String, String)>>,
    heard: mpsc::Receiver<Result<Heard, WallError>>,
    to: String,
    close: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

fn runtime() -> Result<Runtime, WallError> {
    Builder::new_current_thread().enable_all().build().map_err(WallError::System)
}

fn options(certificates: Option<PathBuf>) -> LinkOptions {
    LinkOptions { role: Role::Watcher, certificates }
}

impl Wire {
    /// Begins to connect, and goes on until there is a server. `wake` is called whenever something was said.
    pub(super) fn open(
        address: &Address,
        certificates: Option<PathBuf>,
        listens_to: &[&str],
        speaks_to: &str,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, WallError> {
        let runtime = runtime()?;
        let (said, to_say) = queue::unbounded_channel();
        let (tell, heard) = mpsc::channel();
        let (close, closing) = oneshot::channel();
        let subjects = listens_to.iter().map(|what| address.wall(what)).collect();
        let of_thread = address.clone();
        let work = move || {
            runtime.block_on(async {
                let options = options(certificates);
                tokio::select! {
                    ended = carry(&of_thread, &options, subjects, to_say, &tell, &wake) => {
                        if let Err(error) = ended {
                            let _ = tell.send(Err(error.into()));
                            wake();
                        }
                    }
                    _ = closing => {}
                }
            });
            // A look-up of a name may hang.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("wall".to_owned()).spawn(work);
        let thread = Some(thread.map_err(WallError::System)?);
        Ok(Self { said: Some(said), heard, to: address.wall(speaks_to), close: Some(close), thread })
    }

    /// Says something to all who listen.
    pub(super) fn say(&self, text: String) {
        self.answer(self.to.clone(), text);
    }

    /// Answers a question.
    pub(super) fn answer(&self, reply: String, text: String) {
        // Where the thread has ended, what is heard next says why.
        let _ = self.said.as_ref().map(|said| said.send((reply, text)));
    }

    /// What was said next, if it comes before so much time is over.
    pub(super) fn hear(&self, time: Duration) -> Result<Option<Heard>, WallError> {
        match self.heard.recv_timeout(time) {
            Ok(heard) => heard.map(Some),
            Err(mpsc::RecvTimeoutError::Timeout) => Ok(None),
            Err(mpsc::RecvTimeoutError::Disconnected) => Err(LiveError::Ended.into()),
        }
    }
}

/// How long the last words may take to reach the server.
const FAREWELL: Duration = Duration::from_millis(300);

impl Drop for Wire {
    fn drop(&mut self) {
        drop(self.said.take());
        // The thread ends once it has sent what there was, if there is a server.
        let ending = Instant::now();
        while ending.elapsed() < FAREWELL && self.heard.recv_timeout(FAREWELL).is_ok() {}
        drop(self.close.take());
        if let Some(thread) = self.thread.take() {
            // A panic there was printed there.
            let _ = thread.join();
        }
    }
}

async fn carry(
    address: &Address,
    options: &LinkOptions,
    subjects: Vec<String>,
    mut to_say: queue::UnboundedReceiver<(String, String)>,
    tell: &mpsc::Sender<Result<Heard, WallError>>,
    wake: &(dyn Fn() + Send),
) -> Result<(), LiveError> {
    let client = connect(address, options, &Arc::new(Complaints::default())).await?;
    let not_allowed = |error: async_nats::SubscribeError| LiveError::NotAllowed {
        server: address.server(),
        why: error.to_string(),
    };
    let mut all = Vec::new();
    for subject in subjects {
        all.push(client.subscribe(subject).await.map_err(not_allowed)?);
    }
    let mut all = select_all(all);
    loop {
        tokio::select! {
            // What is to be shown goes before what else there is to hear.
            biased;
            said = to_say.recv() => {
                let Some((subject, text)) = said else {
                    // It may be that there is no server any more.
                    let _ = tokio::time::timeout(FAREWELL, client.flush()).await;
                    return Ok(());
                };
                say(&client, subject, text).await;
            }
            heard = all.next() => {
                let Some(Message { payload, reply, .. }) = heard else { return Ok(()) };
                let heard = Heard { bytes: payload.to_vec(), reply: reply.map(|subject| subject.to_string()) };
                if tell.send(Ok(heard)).is_err() {
                    return Ok(());
                }
                wake();
            }
        }
    }
}

async fn say(client: &Client, subject: String, text: String) {
    if client.connection_state() == State::Connected {
        // The client says so itself when it has lost the server.
        let _ = client.publish(subject, text.into()).await;
    }
}

/// Asks for the state of a wall; `None` if nobody answers.
pub(super) fn ask(
    address: &Address,
    certificates: Option<PathBuf>,
    patience: Duration,
) -> Result<Option<Vec<u8>>, WallError> {
    runtime()?.block_on(async {
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
            // Nobody listens, or nobody answers.
            Ok(Err(_)) | Err(_) => None,
        })
    })
}
