use super::{Event, Place, RecordingError};

/// A stream of events, whatever format they come from. Memory does not grow with what was read.
pub trait EventSource: Send {
    /// The next event; `None` at the end. After an error or the end, every further call gives `None`.
    ///
    /// # Errors
    /// The file is damaged at this place (and the source was not opened as lenient).
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError>;

    /// The line that the last event was read from, without its ending, if the file is a recording in lines. It can be
    /// copied unchanged under a header of the same format. Formats before [`AUTHORS_FORMAT`](super::AUTHORS_FORMAT)
    /// can be mixed: a line of one of them fits a header of any other.
    fn line(&self) -> Option<&str> {
        None
    }

    /// The remarks so far; complete once `next_event` has returned `None`.
    fn notes(&self) -> Notes {
        Notes::default()
    }

    /// Position that was reached, for messages.
    fn place(&self) -> Place {
        Place::File
    }
}

/// The remarks of a reader: damage that did not stop it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// One line for each thing that a person should know (a file that ends in the middle of a line).
    pub warnings: Vec<String>,
    /// Damaged pieces passed over, for a lenient reader.
    pub skipped: u64,
}
