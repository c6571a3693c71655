//! Whether there is memory left. WebAssembly ends a program that asks for more than there is, so large pieces are asked for first.

/// What objects take beside their lists, and ahead: an index grows by chunks of up to 0.7 MB, some of each kind in one commit.
const OTHER_BYTES: usize = 4 << 20;

/// So much memory, and some more, if it is there.
pub(crate) fn take(bytes: usize) -> Option<Vec<u8>> {
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
