//! Reads a session that is to be drawn on, either with threads' help or piece by piece.

use super::{Document, Opened, read_piece};
use crate::journal::{Autosave, Journal, Lines, SessionFile};
use osp_session::recording::{RecordingError, Session};

/// A session on its way to a [`Document`].
#[derive(Debug)]
pub(crate) struct DocumentReader {
    document: Document,
    session: Session,
    opened: Opened,
    /// A remark that comes after those of the reader.
    remark: Option<String>,
    /// What becomes of its file if it is not read to its end.
    give_back: fn(SessionFile),
    /// Whether strokes that a crash has left open are ended.
    ends_strokes: bool,
    events: u64,
}

impl DocumentReader {
    pub(super) fn new(session: Session, journal: Journal, give_back: fn(SessionFile)) -> Self {
        let (opened, remark) = (Opened::default(), None);
        Self {
            document: Document::around(journal),
            session,
            opened,
            remark,
            give_back,
            ends_strokes: true,
            events: 0,
        }
    }

    /// Says something before the remarks of the reader, or after them.
    pub(super) fn remarking(mut self, before: Option<String>, after: Option<String>) -> Self {
        self.opened.remarks.extend(before);
        self.remark = after;
        self
    }

    /// Offers to go on with earlier edits of the same session instead.
    pub(super) fn offering(mut self, earlier: Option<Autosave>) -> Self {
        self.document.earlier = earlier;
        self
    }

    /// Strokes that are open stay so: in a session of several, the others say when they end.
    #[cfg(feature = "live")]
    pub(super) fn without_ends(self) -> Self {
        Self { ends_strokes: false, ..self }
    }

    /// Events that were read.
    pub(crate) fn events(&self) -> u64 {
        self.events
    }

    /// Reads a piece into the journal and the model. Returns whether there may be more.
    ///
    /// # Errors
    /// The session is damaged, or no recording can hold what it holds. Then it is to be given up.
    pub(crate) fn step(&mut self) -> Result<bool, RecordingError> {
        let mut piece = Lines::default();
        let outcome = read_piece(&mut *self.session.events, &mut piece);
        self.events += piece.events().len() as u64;
        self.document.journal.note(&piece)?;
        self.document.drawn.apply_read(piece.events());
        outcome
    }

    /// Reads it to its end, the model and the journal on threads of their own; `go_on` is asked from time to time, with the
    /// number of events that were read.
    ///
    /// # Errors
    /// As there, or of kind `Interrupted` if `go_on` said no.
    pub(super) fn read(mut self, go_on: &dyn Fn(u64) -> bool) -> Result<(Document, Opened), RecordingError> {
        match self.document.read(&mut *self.session.events, go_on) {
            Ok(()) => self.finish(),
            Err(error) => {
                self.give_up();
                Err(error)
            }
        }
    }

    /// The session, when it was read to its end.
    ///
    /// # Errors
    /// Its file is not what was read.
    pub(crate) fn finish(mut self) -> Result<(Document, Opened), RecordingError> {
        let notes = self.session.events.notes();
        self.opened.remarks.extend(notes.warnings);
        if notes.skipped > 0 {
            self.opened.remarks.push(format!("{} damaged pieces were left out", notes.skipped));
        }
        if let Err(error) = self.document.journal.start() {
            self.give_up();
            return Err(error);
        }
        if self.ends_strokes {
            self.document.end_open_strokes();
        }
        self.opened.remarks.extend(self.remark);
        Ok((self.document, self.opened))
    }

    /// Ends the reading: the file is what it was before.
    pub(crate) fn give_up(self) {
        self.document.journal.give_back(self.give_back);
    }
}
