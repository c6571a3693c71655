use super::{Event, Place, RecordingError};

/// A stream of events, whatever format they come from. Memory does not grow with what was read.
pub trait EventSource: Send {
    /// The next event; `None` at the end. After an error or the end, every further call gives `None`.
    ///
    /// # Errors
    /// The file is damaged at this place (and the source was not opened as lenient).
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError>;

    /// The line that the last event was read from, without its ending, if the file is a recording in lines. It can be
    /// written again as it is under a header of the same format, and under any format before
    /// [`AUTHORS_FORMAT`](super::AUTHORS_FORMAT) if its own is one.
    fn line(&self) -> Option<&str> {
        None
    }

    /// The remarks so far; complete once `next_event` has given `None`.
    fn notes(&self) -> Notes {
        Notes::default()
    }

    /// How far it has come, for messages.
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
