use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Excess, Place};

/// An error of a recording. Every message has the file, the position in the file and the expected form.
#[derive(Debug, Error)]
pub enum RecordingError {
    #[error("{}: {cause}", path.display())]
    Io { path: PathBuf, cause: std::io::Error },
    /// A text file is damaged. Lines count from 1.
    #[error("{}, line {line}: expected {expected}; found {found}", path.display())]
    Line { path: PathBuf, line: u64, expected: String, found: String },
    /// A binary file, or an entry of an archive (as `FILE/ENTRY`), is damaged. Bytes count from 0.
    #[error("{}, byte {offset}: expected {expected}; found {found}", path.display())]
    Byte { path: PathBuf, offset: u64, expected: String, found: String },
    /// The session is larger than its [`Limits`](super::Limits) allow.
    #[error("{0}")]
    Limit(Box<Excess>),
    #[error("{}: expected {expected}; found {found}", path.display())]
    Unknown { path: PathBuf, expected: String, found: String },
}

pub(super) type Result<T, E = RecordingError> = std::result::Result<T, E>;

impl RecordingError {
    pub fn io(path: &Path, cause: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), cause }
    }
}

/// The expected form of a part of a file, and what was found instead.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Mismatch {
    pub(super) expected: String,
    pub(super) found: String,
}

impl Mismatch {
    pub(super) fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { expected: expected.into(), found: found.into() }
    }

    /// The error of a part that no line or byte locates.
    pub(super) fn in_file(self, path: &Path) -> RecordingError {
        RecordingError::Unknown { path: path.to_owned(), expected: self.expected, found: self.found }
    }

    pub(super) fn at_byte(self, path: &Path, offset: u64) -> RecordingError {
        RecordingError::Byte { path: path.to_owned(), offset, expected: self.expected, found: self.found }
    }

    pub(super) fn in_line(self, path: &Path, line: u64) -> RecordingError {
        RecordingError::Line { path: path.to_owned(), line, expected: self.expected, found: self.found }
    }
}

/// The option that raises [`Limits::polygons`](super::Limits::polygons), and with it the limits computed from this
/// limit.
const MAX_POLYGONS: &str = "--max-polygons N";

/// The error of an exceeded limit: more than `most` of `what`. [`Limited`](super::limited::Limited) adds the amounts
/// that were read.
pub(super) fn beyond(path: &Path, place: Place, most: u64, what: &str) -> RecordingError {
    RecordingError::Limit(Box::new(Excess {
        path: path.to_owned(),
        place,
        most,
        what: what.to_owned(),
        option: MAX_POLYGONS,
        read: None,
    }))
}
