//! Whether there is memory left. WebAssembly ends a program that allocates more than there is, so large parts are
//! requested first.

use std::cell::Cell;

/// Memory for objects beside their lists, and in reserve. An index grows by chunks of up to 0.7 MB, some of each kind
/// in one commit.
const OTHER_BYTES: usize = 4 << 20;

thread_local! {
    /// Counts requests for memory, and uses without a request.
    static ASKED: Cell<u64> = const { Cell::new(0) };
}

/// Returns a number that changes with every request for memory. While it is the same, the available memory is the same,
/// except for memory that the last requester has taken.
pub(crate) fn asked() -> u64 {
    ASKED.get()
}

/// Call this when memory is taken without a request.
pub(crate) fn note_taken() {
    ASKED.set(ASKED.get() + 1);
}

/// Allocates this much memory, and a reserve, if it is available.
pub(crate) fn take(bytes: usize) -> Option<Vec<u8>> {
    note_taken();
    let mut trial = Vec::new();
    trial.try_reserve_exact(bytes.checked_add(OTHER_BYTES)?).ok()?;
    Some(trial)
}

/// Whether this much memory is available, and a reserve.
pub(crate) fn is_left(bytes: usize) -> bool {
    take(bytes).is_some()
}

/// Returns the memory of sets of ids up to the highest of these: a bit for each number, in lists that grow by a half,
/// three at a time.
pub(crate) fn bytes_of_sets(ids: &[u32]) -> usize {
    ids.iter().max().map_or(0, |&highest| highest as usize / 2)
}
