//! Ctrl+C during long work.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Interval between two checks of Python's signals. A longer interval delays Ctrl+C; a shorter interval lets Python's
/// threads delay the work more often.
const EVERY: Duration = Duration::from_millis(100);

/// Checks at intervals whether the user has pressed Ctrl+C.
pub(crate) struct Signals {
    checked: Instant,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self { checked: Instant::now() }
    }

    /// Long work without the interpreter's lock calls this often, and stops at an error.
    pub(crate) fn check(&mut self) -> PyResult<()> {
        if self.checked.elapsed() < EVERY {
            return Ok(());
        }
        self.checked = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}
