//! Several members in one session, with a real server of NATS on this machine: `nats-server` on the path, or the program
//! named by OSP_NATS_SERVER. Where there is none, each test says so and passes, unless CI is set.

#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

mod server;

mod members;

#[cfg(unix)]
mod cable;

mod failing;

#[cfg(feature = "window")]
mod flood;

#[cfg(feature = "window")]
mod same_file;

#[cfg(feature = "window")]
mod sketch;

mod strangers;

mod together;
