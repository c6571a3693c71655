//! Ctrl+C during long work.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Interval between two checks of Python's signals. With a longer one, Ctrl+C takes longer. With a shorter one,
/// Python's threads delay the work more often.
const EVERY: Duration = Duration::from_millis(100);

/// Checks at intervals whether Python has requested a stop.
pub(crate) struct Signals {
    asked: Instant,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self { asked: Instant::now() }
    }

    /// Call this often, in work that has released the interpreter. On an error, stop and return it.
    pub(crate) fn check(&mut self) -> PyResult<()> {
        if self.asked.elapsed() < EVERY {
            return Ok(());
        }
        self.asked = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}
