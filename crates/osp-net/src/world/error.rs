use thiserror::Error;

/// An error of a world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// The folder or address cannot be used.
    #[error("{place}: {problem}")]
    Place {
        /// The folder or address, as the caller gave it.
        place: String,
        /// The error, or the expected form.
        problem: String,
    },
    /// An object (a file in a folder) cannot be read or written.
    #[error("{object}: {problem}")]
    Object {
        /// The place of the object.
        object: String,
        /// Message of the system or the server.
        problem: String,
    },
    /// An object has unexpected contents.
    #[error("{object}: byte {byte}: expected {expected}; found {found}")]
    Damaged {
        /// The place of the object.
        object: String,
        /// Offset in the object, from 0 on.
        byte: u64,
        /// Expected contents.
        expected: String,
        /// Found contents.
        found: String,
    },
    /// A world exists already.
    #[error("{place}: holds a world already")]
    Exists {
        /// The folder or address, as the caller gave it.
        place: String,
    },
    /// Another pack writes to this place.
    #[error("{place}: another pack writes here; expected that it has ended")]
    Busy {
        /// The folder or address, as the caller gave it.
        place: String,
    },
    /// The memory does not suffice for even a few blocks.
    #[error("expected at least {least} bytes of memory for the blocks of this world; found {given}")]
    Memory {
        /// Memory for a cache of one block and for the blocks that are being loaded, bytes.
        least: u64,
        /// Memory that the caller allows, bytes.
        given: u64,
    },
    /// The world has more polygons than there are ids.
    #[error("expected at most {most} polygons in a world; found more")]
    TooMany {
        /// The limit, [`WorldWriter::MOST_POLYGONS`](super::WorldWriter::MOST_POLYGONS).
        most: u64,
    },
}
