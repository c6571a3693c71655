use super::{Event, Place, RecordingError};

/// A stream of events from any format. Its memory does not grow with the number of events.
pub trait EventSource: Send {
    /// Returns the next event; `None` at the end. After an error or the end, every further call returns `None`.
    ///
    /// # Errors
    /// The file is damaged at this position, and the source is not lenient.
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError>;

    /// The line of the last event, without its ending, if the file is a recording in text lines. The line can be copied
    /// unchanged to a recording of the same format. All formats before [`AUTHORS_FORMAT`](super::AUTHORS_FORMAT) accept
    /// the same lines.
    fn line(&self) -> Option<&str> {
        None
    }

    /// The notes so far. They are complete after `next_event` has returned `None`.
    fn notes(&self) -> Notes {
        Notes::default()
    }

    /// Current position in the file, for messages.
    fn place(&self) -> Place {
        Place::File
    }
}

/// The notes of a reader: damage that did not stop it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// One line for each problem that a person should read about (for example, a file that ends in the middle of a
    /// line).
    pub warnings: Vec<String>,
    /// Number of damaged parts that a lenient reader skipped.
    pub skipped: u64,
}

impl Notes {
    /// Largest number of damaged parts that get a warning. Further parts are only counted.
    const MOST_WARNINGS: u64 = 16;

    /// Notes damage that a lenient reader skips; returns it as an error if the reader is not lenient. `part` names what
    /// is skipped.
    pub(super) fn skip(
        &mut self,
        is_lenient: bool,
        error: RecordingError,
        part: &str,
    ) -> Result<(), RecordingError> {
        if !is_lenient {
            return Err(error);
        }
        self.skipped += 1;
        if self.skipped <= Self::MOST_WARNINGS {
            self.warnings.push(format!("{error}; {part} was passed over"));
        }
        Ok(())
    }
}
