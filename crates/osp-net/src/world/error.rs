use thiserror::Error;

/// What is wrong with a world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// The folder or address cannot be used.
    #[error("{place}: {problem}")]
    Place {
        /// As it was given.
        place: String,
        /// What is wrong with it, or what was expected.
        problem: String,
    },
    /// An object (a file in a folder) cannot be read or written.
    #[error("{object}: {problem}")]
    Object {
        /// Its place.
        object: String,
        /// What the system or the server says.
        problem: String,
    },
    /// An object does not hold what it should.
    #[error("{object}: byte {byte}: expected {expected}; found {found}")]
    Damaged {
        /// Its place.
        object: String,
        /// Where in it, from 0.
        byte: u64,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A world is there already.
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
        /// What a cache of one block and those that are being loaded need.
        least: u64,
        /// What it may take.
        given: u64,
    },
    /// More polygons than numbers for them.
    #[error("expected at most {most} polygons in a world; found more")]
    TooMany {
        /// [`WorldWriter::MOST_POLYGONS`](super::WorldWriter::MOST_POLYGONS).
        most: u64,
    },
}
