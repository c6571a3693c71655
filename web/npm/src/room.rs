//! Whether there is memory left. WebAssembly ends a program that allocates more than there is, so large parts are
//! requested first.

use std::cell::Cell;

use crate::refusal::{Outcome, refused};

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

/// Whether this much memory is available, and a reserve.
pub(crate) fn is_left(bytes: usize) -> bool {
    note_taken();
    bytes.checked_add(OTHER_BYTES).is_some_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok())
}

/// Resizes a list. JavaScript overwrites its contents.
pub(crate) fn resize<T: Clone>(list: &mut Vec<T>, len: usize, blank: T) -> Outcome<()> {
    list.truncate(len);
    if list.capacity() < len {
        note_taken();
    }
    if list.try_reserve(len - list.len()).is_err() {
        *list = Vec::new();
        return refused("there is no memory left for so many numbers at once");
    }
    list.resize(len, blank);
    Ok(())
}
