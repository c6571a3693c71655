use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Excess, Place};

/// An error of a recording. Every message has the file, the position in the file and the expected form.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The file could not be opened, read or written.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A text file is damaged.
    #[error("{}, line {line}: expected {expected}; found {found}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The form that the format requires at this position.
        expected: String,
        /// The text at this position, shortened.
        found: String,
    },
    /// A binary file is damaged.
    #[error("{}, byte {offset}: expected {expected}; found {found}", path.display())]
    Byte {
        /// The file, or the entry of an archive as `FILE/ENTRY`.
        path: PathBuf,
        /// The offset, from 0.
        offset: u64,
        /// The form that the format requires at this position.
        expected: String,
        /// The contents at this position.
        found: String,
    },
    /// The session is larger than its [`Limits`](super::Limits) allow.
    #[error("{0}")]
    Limit(Box<Excess>),
    /// The format of the file cannot be read.
    #[error("{}: expected {expected}; found {found}", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
        /// The formats that can be read.
        expected: String,
        /// The format of the file.
        found: String,
    },
}

impl RecordingError {
    /// An input or output error of a file.
    pub fn io(path: &Path, cause: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), cause }
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
