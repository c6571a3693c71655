//! The window as a person meets it: a real X server, a real pointer, a real file. Without a display server each test
//! says so and passes, but fails where `CI` is set and `OSP_GPU_TESTS` is 1.
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

mod desk;
mod keeping;
mod replaying;
mod sketching;
mod tracker_keys;
mod tracking;
mod walls;
mod wayland;
