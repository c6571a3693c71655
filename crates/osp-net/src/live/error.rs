use thiserror::Error;

/// The reason why a connection has ended permanently.
#[derive(Debug, Error)]
pub enum LiveError {
    /// The system provides no thread or socket.
    #[error("no connection can be begun")]
    System(#[source] std::io::Error),
    /// The server refuses this member.
    #[error("{server}: the server does not let us in: {why}")]
    NotAllowed { server: String, why: String },
    /// The connection cannot be encrypted.
    #[error("{server}: no encrypted connection: {why}")]
    NotEncrypted { server: String, why: String },
    /// The server has no JetStream, so it cannot store a session.
    #[error("{server}: expected a server of NATS with JetStream (nats-server -js); {why}")]
    NoJetStream { server: String, why: String },
    /// The thread of the connection has ended without an error, or its error was read already.
    #[error("the connection has ended")]
    Ended,
    /// The session that was read is no longer on the server.
    #[error("{session}: the server has lost the session, or has another one of this name")]
    Lost { session: String },
}
