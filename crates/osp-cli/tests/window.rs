//! The window as a person meets it: a real X server, a real pointer, a real file. Without a display server each test
//! says so and passes, but fails where `CI` is set and `OSP_GPU_TESTS` is 1.
#![cfg(all(feature = "window", target_os = "linux"))]
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

#[path = "window/desk.rs"]
mod desk;
#[path = "window/keeping.rs"]
mod keeping;
#[path = "window/replaying.rs"]
mod replaying;
#[path = "../../../tests/support/repository.rs"]
mod repository;
#[path = "../../../tests/support/required.rs"]
mod required;
#[cfg(feature = "live")]
#[path = "live/server.rs"]
#[expect(dead_code, reason = "the tests of shared sessions use more of it")]
mod server;
#[path = "window/sketching.rs"]
mod sketching;
#[path = "window/tasks.rs"]
mod tasks;
#[path = "window/tracker_keys.rs"]
mod tracker_keys;
#[path = "window/tracking.rs"]
mod tracking;
#[cfg(feature = "live")]
#[path = "window/wall_node.rs"]
mod wall_node;
#[path = "window/walls.rs"]
mod walls;
#[path = "window/wayland.rs"]
mod wayland;
