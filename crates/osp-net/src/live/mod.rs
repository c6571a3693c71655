//! Several authors draw in one session, over a server of [NATS](https://nats.io) with JetStream.
//!
//! A session is a stream of the server: an ordered log, which the server stores in a file, and which every member reads
//! from its first message on. An author publishes one message a frame. The order in which the server receives the messages
//! is the order of the session. Each member applies the messages in this order by a
//! [`Reducer`](osp_session::recording::Reducer), so the recordings of all members are equal, byte for byte.
//!
//! ```text
//! events to send ──> outbox (numbers, at most 32 unacknowledged messages) ──> server's stream ──┐
//!                                                                                               v
//! News: the session's events, and which are this member's <── log (what counts) <── all messages in order
//! ```
//!
//! A [`Link`] is a member's connection, on a thread of its own. [`Hand::send`] accepts this member's events at any
//! time, with or without a server, and [`Link::news`] returns the events of the session. This member's strokes and
//! groups belong to the author [`ME`] until they are sent: `ME.number(n)`. Without a server a member can continue to
//! draw; its events are sent when the server is back. No call waits for the network.
//!
//! A client with write access can write any data. Members skip and count data that is no message. They also skip
//! messages that come out of order, exceed the limits, or come from senders that have not joined. The server controls
//! read and write access.

mod address;
mod background;
mod connection;
mod counts;
mod error;
mod link;
mod log;
mod member;
mod outbox;
mod own;
mod packet;
mod presence;
mod rate;
mod server;
mod state;
#[cfg(test)]
mod tests;

pub use address::{Address, AddressError, Credentials};
pub use counts::{Counts, Latency};
pub use error::LiveError;
pub use link::{Hand, Link};
pub use member::News;
pub use outbox::Who;
pub use own::ME;
pub use state::{Connection, Role, Status};

use osp_session::recording::{AUTHORS_FORMAT, Header};

/// The header of the recording of a shared session, the same for all members that write a recording.
pub fn header(session: &str) -> Header {
    Header { format: AUTHORS_FORMAT, ..Header::new(session, "osp live") }
}
