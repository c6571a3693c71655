//! A shared session that goes on in the file in which it was left.

use std::path::{Path, PathBuf};

use super::Shared;
use crate::{
    document::{Document, OpenError, Opened},
    journal::Autosaves,
};
use osp_net::live;
use osp_session::recording::{Event, Limits, Session};

/// What a file holds of a session already. It is read beside the session, which brings the same events again.
#[derive(Debug)]
pub(super) struct Known {
    file: Session,
    path: PathBuf,
    left: u64,
}

impl Known {
    /// Takes those events away that the file has.
    ///
    /// # Errors
    /// The session has other ones: why nothing may be appended to the file.
    pub(super) fn pass_over(&mut self, events: &mut Vec<Event>) -> Result<(), String> {
        let mut there = 0;
        for event in events.iter().take(usize::try_from(self.left).unwrap_or(usize::MAX)) {
            if !matches!(self.file.events.next_event(), Ok(Some(known)) if known == *event) {
                return Err(self.is_other());
            }
            there += 1;
        }
        self.left -= there as u64;
        events.drain(..there);
        Ok(())
    }

    /// Whether the session has brought all that the file holds.
    pub(super) fn is_over(&self) -> bool {
        self.left == 0
    }

    /// What to say where the file is of another session.
    pub(super) fn is_other(&self) -> String {
        format!(
            "{}: expected the beginning of this session; the file is another's, and is left as it is",
            self.path.display()
        )
    }
}

/// The file of a session that somebody is about to join.
#[derive(Debug)]
pub struct Unjoined {
    document: Document,
    known: Option<Known>,
}

impl Unjoined {
    /// The recording of the shared session of this name: one that was left, to be continued, or a new one.
    ///
    /// # Errors
    /// The file cannot be read or written, another window has it, or it holds something else.
    pub fn open(
        path: &Path,
        session: &str,
        autosaves: &Autosaves,
        limits: Limits,
    ) -> Result<(Self, Opened), OpenError> {
        let (document, opened, file) = Document::left(path, live::header(session), autosaves, limits)?;
        let Some(file) = file else { return Ok((Self { document, known: None }, opened)) };
        let known = Known { file, path: path.to_owned(), left: document.event_count() };
        Ok((Self { document, known: Some(known) }, opened))
    }

    /// The document, which follows the session from now on. What the file has is shown already; what has come to the session
    /// since is appended to it.
    pub fn join(self, shared: Shared) -> Document {
        let Self { mut document, known } = self;
        document.shared = Some(Shared { known, ..shared });
        document
    }
}
