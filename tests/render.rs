//! Pictures: what the renderer draws, on whatever adapter there is. Without one each test says so and passes, but
//! fails where the environment variable `CI` is `true`.
#![cfg(feature = "render")]
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

#[path = "render/pictures.rs"]
mod pictures;
#[path = "render/scenes.rs"]
mod scenes;
#[path = "render/shaders.rs"]
mod shaders;
