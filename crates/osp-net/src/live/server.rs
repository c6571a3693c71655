//! Requests to the server: the connection, the session's stream, and the stream's messages.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use async_nats::{
    Client, ConnectErrorKind, ConnectOptions, Event, ServerError,
    jetstream::{
        self, Context, ErrorCode,
        consumer::{AckPolicy, DeliverPolicy, ReplayPolicy, pull},
        context::{CreateStreamErrorKind, GetStreamErrorKind, RequestErrorKind},
        stream::{Config, DiscardPolicy, Info, RetentionPolicy, StorageType},
    },
};

use super::{Address, Credentials, LiveError, Role, packet};

/// Longest wait for an answer of the server.
const ANSWER: Duration = Duration::from_secs(1);

/// Longest pause between two tries to connect.
const RETRY: Duration = Duration::from_millis(500);

/// Largest number of messages that the server may send before the next request.
const BATCH_MESSAGES: usize = 256;

/// Largest number of different refusals that are stored.
const MOST_REFUSALS: usize = 64;

/// The last error of the server or the client, and the number of connections.
#[derive(Debug, Default)]
pub(super) struct Complaints {
    status: Mutex<(Option<String>, u64)>,
    /// Refusals of the server since the beginning of this connection.
    forbidden: Mutex<Vec<String>>,
}

impl Complaints {
    fn with<T>(&self, what: impl FnOnce(&mut (Option<String>, u64)) -> T) -> T {
        what(&mut self.status.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub(super) fn set(&self, text: impl Into<String>) {
        self.with(|(status, _)| *status = Some(text.into()));
    }

    pub(super) fn clear(&self) {
        self.with(|(status, _)| *status = None);
    }

    fn note_refusal(&self, text: String) {
        let mut forbidden = self.forbidden.lock().unwrap_or_else(PoisonError::into_inner);
        let is_of_rights = text.to_lowercase().contains("permissions violation for");
        if is_of_rights && forbidden.len() < MOST_REFUSALS && !forbidden.contains(&text) {
            forbidden.push(text.clone());
        }
        drop(forbidden);
        self.set(text);
    }

    fn connected(&self) {
        self.with(|(_, connections)| *connections += 1);
        self.forbidden.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// The server's reason if it has refused to publish or subscribe to a subject.
    pub(super) fn forbids(&self, subject: &str) -> Option<String> {
        let forbidden = self.forbidden.lock().unwrap_or_else(PoisonError::into_inner);
        let quoted = format!("\"{subject}\"");
        forbidden.iter().find(|text| text.contains(&quoted)).cloned()
    }

    /// The last error, and the number of connections so far.
    pub(super) fn get(&self) -> (Option<String>, u64) {
        self.with(|status| status.clone())
    }
}

/// Connects to the server; retries until the server answers.
pub(super) async fn connect(address: &Address, complaints: &Arc<Complaints>) -> Result<Client, LiveError> {
    let server = address.server();
    loop {
        let error = match options_of(address, complaints).connect(&server).await {
            Ok(client) => return Ok(client),
            Err(error) => error,
        };
        let why = full(&error);
        match error.kind() {
            ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication => {
                return Err(LiveError::NotAllowed { server, why });
            }
            ConnectErrorKind::Tls => return Err(LiveError::NotEncrypted { server, why }),
            ConnectErrorKind::Io if is_of_encryption(&error) => {
                return Err(LiveError::NotEncrypted { server, why });
            }
            _ => complaints.set(why),
        }
        tokio::time::sleep(RETRY).await;
    }
}

fn options_of(address: &Address, complaints: &Arc<Complaints>) -> ConnectOptions {
    let complaints = Arc::clone(complaints);
    let mut connect = ConnectOptions::new()
        .name("osp")
        .require_tls(address.is_encrypted)
        // The client connects only to the given server, not to other servers that this server announces.
        .ignore_discovered_servers()
        // The subscription has room for a batch of the log and for presence messages that the member has not read yet.
        .subscription_capacity(2 * BATCH_MESSAGES)
        .connection_timeout(Duration::from_secs(3))
        .request_timeout(Some(ANSWER))
        // Two unanswered pings end a dead connection.
        .ping_interval(Duration::from_secs(2))
        .reconnect_delay_callback(|tries| RETRY.min(Duration::from_millis(20 * tries as u64)))
        .event_callback(move |event| {
            match event {
                Event::Connected => complaints.connected(),
                Event::ServerError(ServerError::Other(text)) => complaints.note_refusal(text),
                Event::ServerError(error) => complaints.set(error.to_string()),
                Event::ClientError(error) => complaints.set(error.to_string()),
                Event::Disconnected => complaints.set("the server has gone"),
                _ => {}
            }
            std::future::ready(())
        });
    match &address.credentials {
        Credentials::None => {}
        Credentials::Token(token) => connect = connect.token(token.clone()),
        Credentials::User { name, password } => {
            connect = connect.user_and_password(name.clone(), password.clone());
        }
    }
    connect
}

/// Whether an error comes from encryption: the server does not encrypt, or its certificate is not trusted. The library
/// reports both as invalid data.
fn is_of_encryption(error: &(dyn std::error::Error + 'static)) -> bool {
    std::iter::successors(Some(error), |error| error.source()).any(|error| {
        let kind = error.downcast_ref::<std::io::Error>().map(std::io::Error::kind);
        kind == Some(std::io::ErrorKind::InvalidData)
    })
}

/// The text of an error with its causes, without repetitions.
fn full(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let more = error.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = error.source();
    }
    text
}

pub(super) fn logs(client: &Client) -> Context {
    let mut context = jetstream::new(client.clone());
    context.set_timeout(ANSWER);
    context
}

/// The reason why a request has no answer.
#[derive(Debug)]
pub(super) enum NoAnswer {
    /// A later request may have an answer.
    Later(String),
    /// The stream does not exist, and the request may not create it.
    NoStream,
    NoStreams(String),
}

fn of_code(code: ErrorCode, why: String) -> NoAnswer {
    match code {
        ErrorCode::STREAM_NOT_FOUND => NoAnswer::NoStream,
        ErrorCode::JETSTREAM_NOT_ENABLED | ErrorCode::JETSTREAM_NOT_ENABLED_FOR_ACCOUNT => {
            NoAnswer::NoStreams(why)
        }
        _ => NoAnswer::Later(why),
    }
}

/// The current state of the session's stream. A missing stream is created, unless the member only watches, or has read the
/// stream before.
pub(super) async fn stream(
    logs: &Context,
    address: &Address,
    role: &Role,
    was_there: bool,
) -> Result<Info, NoAnswer> {
    match logs.get_stream(address.stream()).await {
        Ok(stream) => return Ok(stream.cached_info().clone()),
        Err(error) => {
            let why = full(&error);
            let no_answer = match error.kind() {
                GetStreamErrorKind::JetStream(cause) => of_code(cause.error_code(), why),
                GetStreamErrorKind::Request if has_no_responder(&error) => NoAnswer::NoStreams(why),
                _ => NoAnswer::Later(why),
            };
            let may_make = !was_there && matches!(role, Role::Author(_));
            if !(may_make && matches!(no_answer, NoAnswer::NoStream)) {
                return Err(no_answer);
            }
        }
    }
    let config = Config {
        name: address.stream(),
        description: Some("a shared session of osp".to_owned()),
        subjects: vec![address.subject()],
        storage: StorageType::File,
        retention: RetentionPolicy::Limits,
        // A full server refuses new messages, and deletes no old messages.
        discard: DiscardPolicy::New,
        max_message_size: i32::try_from(packet::MAX_BYTES + 4096).unwrap_or(i32::MAX),
        duplicate_window: Duration::from_secs(120),
        deny_delete: true,
        deny_purge: true,
        num_replicas: 1,
        ..Config::default()
    };
    match logs.create_stream(config).await {
        Ok(stream) => Ok(stream.cached_info().clone()),
        Err(error) => {
            let why = full(&error);
            Err(match error.kind() {
                CreateStreamErrorKind::JetStream(cause) => of_code(cause.error_code(), why),
                CreateStreamErrorKind::JetStreamUnavailable => NoAnswer::NoStreams(why),
                _ => NoAnswer::Later(why),
            })
        }
    }
}

/// Whether no service of the server answers requests about streams.
fn has_no_responder(error: &(dyn std::error::Error + 'static)) -> bool {
    std::iter::successors(Some(error), |error| error.source()).any(|error| {
        let kind = error.downcast_ref::<jetstream::context::RequestError>().map(|error| error.kind());
        kind == Some(RequestErrorKind::NoResponders)
    })
}

/// The messages of the log from number `from` on, in order, as they are received.
pub(super) async fn messages(logs: &Context, address: &Address, from: u64) -> Result<pull::Stream, String> {
    let config = pull::Config {
        deliver_policy: match from {
            0 | 1 => DeliverPolicy::All,
            _ => DeliverPolicy::ByStartSequence { start_sequence: from },
        },
        ack_policy: AckPolicy::None,
        replay_policy: ReplayPolicy::Instant,
        inactive_threshold: Duration::from_secs(30),
        memory_storage: true,
        num_replicas: 1,
        ..pull::Config::default()
    };
    let consumer =
        logs.create_consumer_on_stream(config, address.stream()).await.map_err(|error| full(&error))?;
    let stream = consumer
        .stream()
        .max_messages_per_batch(BATCH_MESSAGES)
        // The times are long, because a slow connection needs some time for a long message.
        .heartbeat(Duration::from_secs(5))
        .expires(Duration::from_secs(30))
        .messages();
    stream.await.map_err(|error| full(&error))
}
