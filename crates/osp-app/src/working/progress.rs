use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The progress of background work, and whether it was cancelled.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    pub(super) done: AtomicU64,
    pub(super) is_cancelled: AtomicBool,
    /// Whether a window waits for the work and shows frames meanwhile.
    pub(super) has_window: AtomicBool,
}

impl Progress {
    /// Stores the progress. Returns `false` if the work was cancelled.
    pub(crate) fn note(&self, done: u64) -> bool {
        self.done.store(done, Relaxed);
        !self.is_cancelled.load(Relaxed)
    }

    /// Whether the work should also insert the model into an index. Without a waiting window, the studio inserts it.
    pub(super) fn wants_index(&self) -> bool {
        self.has_window.load(Relaxed) && !self.is_cancelled.load(Relaxed)
    }
}
