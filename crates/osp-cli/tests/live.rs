//! Several members in one session, with a real server of NATS on this machine: `nats-server` on the path, or the program
//! named by OSP_NATS_SERVER. Where there is none, each test says so and passes, unless CI is set.

#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

#[path = "../../../tests/support/repository.rs"]
mod repository;
#[path = "live/server.rs"]
mod server;

#[path = "live/members.rs"]
mod members;

#[cfg(unix)]
#[path = "live/cable.rs"]
mod cable;

#[path = "live/failing.rs"]
mod failing;

#[cfg(feature = "window")]
#[path = "live/flood.rs"]
mod flood;

#[cfg(feature = "window")]
#[path = "live/names.rs"]
mod names;

#[cfg(feature = "window")]
#[path = "live/same_file.rs"]
mod same_file;

#[cfg(feature = "window")]
#[path = "live/sketch.rs"]
mod sketch;

#[cfg(unix)]
#[path = "live/slow_line.rs"]
mod slow_line;

#[path = "live/strangers.rs"]
mod strangers;

#[path = "live/together.rs"]
mod together;

#[path = "live/wall.rs"]
mod wall;
