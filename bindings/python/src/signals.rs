//! Ctrl+C in work that takes long.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// How often Python is asked. Longer: Ctrl+C has to wait. Shorter: threads of Python hold the work up more often.
const EVERY: Duration = Duration::from_millis(100);

/// Asks Python now and then whether the work is to be stopped.
pub(crate) struct Signals {
    asked: Instant,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self { asked: Instant::now() }
    }

    /// Called often, from work that has released the interpreter. An error: stop, and hand it on.
    pub(crate) fn check(&mut self) -> PyResult<()> {
        if self.asked.elapsed() < EVERY {
            return Ok(());
        }
        self.asked = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}
