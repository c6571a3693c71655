use std::path::Path;

use super::limits::Limited;
use super::{Event, Header, OpenOptions, Place, RecordingError};

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

/// An opened session: its header and its events.
pub struct Session {
    /// The header of the session.
    pub header: Header,
    /// Short name of the format, for `osp info`: `ron`, `ron.zst`, `tilt`, `apa`, `cassie`, `poses`, `obj`, `glb`, `gltf`.
    pub format: &'static str,
    /// The events.
    pub events: Box<dyn EventSource>,
}

impl Session {
    /// A session that `source` reads from `path`, up to the limits of the options.
    pub fn new(
        header: Header,
        format: &'static str,
        source: Box<dyn EventSource>,
        path: &Path,
        options: &OpenOptions,
    ) -> Self {
        Self { header, format, events: Box::new(Limited::new(source, path, options)) }
    }
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session")
            .field("header", &self.header)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl Iterator for Session {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.events.next_event().transpose()
    }
}
