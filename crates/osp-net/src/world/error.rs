use thiserror::Error;

/// An error of a world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "their messages describe them")]
pub enum WorldError {
    /// The folder or address cannot be used.
    #[error("{place}: {problem}")]
    Place { place: String, problem: String },
    /// An object (a file in a folder) cannot be read or written.
    #[error("{object}: {problem}")]
    Object { object: String, problem: String },
    /// An object has unexpected contents. Bytes count from 0.
    #[error("{object}: byte {byte}: expected {expected}; found {found}")]
    Damaged { object: String, byte: u64, expected: String, found: String },
    /// A world exists already.
    #[error("{place}: holds a world already")]
    Exists { place: String },
    /// Another pack writes to this place.
    #[error("{place}: another pack writes here; expected that it has ended")]
    Busy { place: String },
    /// The memory does not suffice for even a few blocks.
    #[error("expected at least {least} bytes of memory for the blocks of this world; found {given}")]
    Memory { least: u64, given: u64 },
    /// The world has more polygons than there are ids.
    #[error("expected at most {most} polygons in a world; found more")]
    TooMany { most: u64 },
}
