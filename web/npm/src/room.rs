//! Whether there is memory left. WebAssembly ends a program that asks for more than there is, so large pieces are asked for first.

use std::cell::Cell;

/// What objects take beside their lists, and ahead: an index grows by chunks of up to 0.7 MB, some of each kind in one commit.
const OTHER_BYTES: usize = 4 << 20;

thread_local! {
    /// Counts who has asked for memory, or has taken some.
    static ASKED: Cell<u64> = const { Cell::new(0) };
}

/// Changes as soon as anybody asks for memory. While it is the same, what was there is there still, but for what the one has taken
/// that asked last.
pub(crate) fn asked() -> u64 {
    ASKED.get()
}

/// To be called by whoever takes memory without asking.
pub(crate) fn note_taken() {
    ASKED.set(ASKED.get() + 1);
}

/// So much memory, and some more, if it is there.
pub(crate) fn take(bytes: usize) -> Option<Vec<u8>> {
    note_taken();
    let mut trial = Vec::new();
    trial.try_reserve_exact(bytes.checked_add(OTHER_BYTES)?).ok()?;
    Some(trial)
}

/// Whether so much memory is there, and some more.
pub(crate) fn is_left(bytes: usize) -> bool {
    take(bytes).is_some()
}

/// What sets of ids take that reach to the highest of these: a bit for each number, in lists that grow by a half, three at a time.
pub(crate) fn bytes_of_sets(ids: &[u32]) -> usize {
    ids.iter().max().map_or(0, |&highest| highest as usize / 2)
}
