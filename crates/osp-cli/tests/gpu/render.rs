//! Pictures: what the renderer draws, on whatever adapter there is. Without one each test says so and passes, but
//! fails where `CI` is set and `OSP_GPU_TESTS` is 1.
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

mod authors;
mod commands;
mod decoded_film;
mod decoded_mp4;
mod film;
mod film_mp4;
mod hzb;
mod identity;
mod jump;
mod large;
mod margins;
mod opengl;
mod order;
mod painted;
mod painter;
mod pictures;
mod rigs;
mod scenes;
mod shadows;
mod stale;
mod stereo;
mod still;
mod thumbs;
mod unseen;
