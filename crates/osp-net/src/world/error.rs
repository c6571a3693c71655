use thiserror::Error;

/// Error of a world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// The folder or address cannot be used.
    #[error("{place}: {problem}")]
    Place {
        /// As it was given.
        place: String,
        /// Error, or expected form.
        problem: String,
    },
    /// An object (a file in a folder) cannot be read or written.
    #[error("{object}: {problem}")]
    Object {
        /// Its place.
        object: String,
        /// Message of the system or the server.
        problem: String,
    },
    /// An object does not hold what it should.
    #[error("{object}: byte {byte}: expected {expected}; found {found}")]
    Damaged {
        /// Its place.
        object: String,
        /// Offset in it, from 0.
        byte: u64,
        /// Expected contents.
        expected: String,
        /// Present contents.
        found: String,
    },
    /// A world exists already.
    #[error("{place}: holds a world already")]
    Exists {
        /// As it was given.
        place: String,
    },
    /// Another pack into this place runs still.
    #[error("{place}: another pack writes here; expected that it has ended")]
    Busy {
        /// As it was given.
        place: String,
    },
    /// There is not enough memory to hold even a few blocks.
    #[error("expected at least {least} bytes of memory for the blocks of this world; found {given}")]
    Memory {
        /// Memory for a cache of one block and of the blocks that are being loaded.
        least: u64,
        /// Memory that it may take.
        given: u64,
    },
    /// More polygons than numbers for them.
    #[error("expected at most {most} polygons in a world; found more")]
    TooMany {
        /// [`WorldWriter::MOST_POLYGONS`](super::WorldWriter::MOST_POLYGONS).
        most: u64,
    },
}
