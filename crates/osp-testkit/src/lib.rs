//! Shared parts of the tests and benchmarks of several crates: boxes and views, random edits, memory counts, the
//! program and its files.

mod altered;
pub mod boxes;
mod counting;
mod editor;
pub mod events;
mod program;
mod random;
mod repository;
mod sketch;
mod waiting;

pub use altered::Altered;
pub use counting::{Counting, allocations, held_bytes, peak_of};
pub use editor::{Editor, STROKES};
pub use program::{Program, json, make_pipe, names, shipped_session, stderr, stdout, temp};
pub use random::Random;
pub use repository::{ROOT, at, packages};
pub use sketch::add_to_sketch;
pub use waiting::{wait_for, wait_until};

/// Whether a missing graphics adapter, display or tool makes a test fail instead of skipping it. True if `CI` is set
/// and `OSP_GPU_TESTS=1`.
pub fn nothing_may_be_skipped() -> bool {
    std::env::var_os("CI").is_some_and(|ci| !ci.is_empty())
        && std::env::var("OSP_GPU_TESTS").as_deref() == Ok("1")
}
