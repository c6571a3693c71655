use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// How far some work has come, and whether it is to end.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    pub(super) done: AtomicU64,
    pub(super) is_cancelled: AtomicBool,
    /// A window waits for it, and goes on meanwhile.
    pub(super) has_window: AtomicBool,
}

impl Progress {
    /// Notes how much is done; returns whether to go on.
    pub(crate) fn note(&self, done: u64) -> bool {
        self.done.store(done, Relaxed);
        !self.is_cancelled.load(Relaxed)
    }

    /// Whether the model is to be inserted, too: a window that does not go on meanwhile inserts it itself.
    pub(super) fn wants_index(&self) -> bool {
        self.has_window.load(Relaxed) && !self.is_cancelled.load(Relaxed)
    }
}
