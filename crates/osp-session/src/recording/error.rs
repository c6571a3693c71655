use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Excess, Place};

/// The error of a recording. Every message names the file, the place in it and what was expected.
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
        /// Form that the format requires there.
        expected: String,
        /// Text found there, shortened.
        found: String,
    },
    /// A binary file is damaged.
    #[error("{}, byte {offset}: expected {expected}; found {found}", path.display())]
    Byte {
        /// The file, or the entry of an archive as `FILE/ENTRY`.
        path: PathBuf,
        /// The offset, from 0.
        offset: u64,
        /// Form that the format requires there.
        expected: String,
        /// Contents found there.
        found: String,
    },
    /// The session is larger than its [`Limits`](super::Limits) allow.
    #[error("{0}")]
    Limit(Box<Excess>),
    /// The file is of a format that cannot be read.
    #[error("{}: expected {expected}; found {found}", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
        /// Readable forms.
        expected: String,
        /// Form found.
        found: String,
    },
}

impl RecordingError {
    /// An input or output error with its file.
    pub fn io(path: &Path, cause: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), cause }
    }
}

/// Names the option that raises [`Limits::polygons`](super::Limits::polygons), and with it the limits that follow from it.
const MAX_POLYGONS: &str = "--max-polygons N";

/// The error for more than `most` of something; [`Limited`](super::limited::Limited) adds what was read.
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
