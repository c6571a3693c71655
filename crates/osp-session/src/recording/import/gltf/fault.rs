use std::path::Path;

use crate::recording::{Notes, RecordingError};

/// Largest number of damaged parts that get a warning. Further damaged parts are only counted.
const MOST_WARNINGS: u64 = 16;

pub(super) struct Fault {
    pub(super) expected: String,
    pub(super) found: String,
}

impl Fault {
    pub(super) fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { expected: expected.into(), found: found.into() }
    }

    pub(super) fn in_file(self, path: &Path) -> RecordingError {
        RecordingError::Unknown { path: path.to_owned(), expected: self.expected, found: self.found }
    }
}

/// The damage that a lenient reader has skipped.
pub(super) struct Damage {
    pub(super) is_lenient: bool,
    pub(super) notes: Notes,
}

impl Damage {
    pub(super) fn note(&mut self, path: &Path, fault: Fault) -> Result<(), RecordingError> {
        let error = fault.in_file(path);
        if !self.is_lenient {
            return Err(error);
        }
        self.notes.skipped += 1;
        if self.notes.skipped <= MOST_WARNINGS {
            self.notes.warnings.push(format!("{error}; it was passed over"));
        }
        Ok(())
    }
}
