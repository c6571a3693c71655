use thiserror::Error;

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
        /// Its message.
        why: String,
    },
    /// The encryption fails.
    #[error("{server}: no encrypted connection: {why}")]
    NotEncrypted {
        /// The server.
        server: String,
        /// Reason.
        why: String,
    },
    /// The server has no log to keep a session in.
    #[error("{server}: expected a server of NATS with JetStream (nats-server -js); {why}")]
    NoJetStream {
        /// The server.
        server: String,
        /// Its message.
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
