//! Pictures: what the renderer draws, on whatever adapter there is. Without one each test says so and passes, but
//! fails where `CI` is set and `OSP_GPU_TESTS` is 1.
#![cfg(feature = "render")]
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

#[path = "render/authors.rs"]
mod authors;
#[path = "render/commands.rs"]
mod commands;
#[path = "render/decoded_film.rs"]
mod decoded_film;
#[path = "../../../tests/support/edits.rs"]
mod editor;
#[path = "render/film.rs"]
mod film;
#[path = "render/hzb.rs"]
mod hzb;
#[path = "render/identity.rs"]
mod identity;
#[path = "render/jump.rs"]
mod jump;
#[path = "render/large.rs"]
mod large;
#[path = "render/margins.rs"]
mod margins;
#[path = "render/opengl.rs"]
mod opengl;
#[path = "render/order.rs"]
mod order;
#[path = "render/painted.rs"]
mod painted;
#[path = "render/painter.rs"]
mod painter;
#[path = "render/pictures.rs"]
mod pictures;
#[path = "../../../tests/support/repository.rs"]
mod repository;
#[path = "../../../tests/support/required.rs"]
mod required;
#[path = "render/rigs.rs"]
mod rigs;
#[path = "render/scenes.rs"]
mod scenes;
#[path = "render/shadows.rs"]
mod shadows;
#[path = "render/stale.rs"]
mod stale;
#[path = "render/unseen.rs"]
mod unseen;
#[path = "render/wgsl_grammar.rs"]
mod wgsl_grammar;
