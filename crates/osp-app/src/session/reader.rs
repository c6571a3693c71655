//! Reads a session for drawing, either in one call on several threads or piece by piece.

use std::{cell::Cell, io, path::Path, sync::Arc};

use super::{
    Session,
    model::PIECE,
    opening::{OpenError, Opened},
};
use crate::{
    journal::{Journal, Lines, SessionFile},
    threads,
};
use osp_session::recording::{self, EventSource, RecordingError};

/// Largest size of a piece, bytes; ordinary lines need less.
const PIECE_BYTES: usize = 1 << 18;
/// Largest number of pieces that wait for the journal or the model.
const PIECES_AHEAD: usize = 4;

#[derive(Debug)]
pub(crate) enum Started {
    Empty(Box<Session>),
    Reads(Box<SessionReader>),
}

impl Started {
    pub(super) fn read(self, go_on: &dyn Fn(u64) -> bool) -> Result<(Session, Opened), RecordingError> {
        match self {
            Self::Empty(session) => Ok((*session, Opened::default())),
            Self::Reads(reader) => reader.read(go_on),
        }
    }

    /// Reads the session. Calls `go_on` regularly with the number of events read; once it returns `false`, the error is
    /// [`OpenError::Cancelled`].
    pub(crate) fn read_watched(
        self,
        path: &Path,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(Session, Opened), OpenError> {
        let was_cancelled = Cell::new(false);
        let watch = |events| {
            let goes_on = go_on(events);
            was_cancelled.set(!goes_on);
            goes_on
        };
        let outcome = self.read(&watch);
        // The reader's error would only state that it was interrupted.
        if was_cancelled.get() { Err(OpenError::Cancelled(path.to_owned())) } else { Ok(outcome?) }
    }
}

#[derive(Debug)]
pub(crate) struct SessionReader {
    pub(super) session: Session,
    recorded: recording::Session,
    opened: Opened,
    remark: Option<String>,
    /// Releases the file if reading is aborted.
    give_back: fn(SessionFile),
    /// Whether to end strokes that a crash left open.
    pub(super) ends_strokes: bool,
    pub(crate) events: u64,
}

impl SessionReader {
    pub(super) fn new(recorded: recording::Session, journal: Journal, give_back: fn(SessionFile)) -> Self {
        let (opened, remark) = (Opened::default(), None);
        Self {
            session: Session::around(journal),
            recorded,
            opened,
            remark,
            give_back,
            ends_strokes: true,
            events: 0,
        }
    }

    /// Adds remarks before and after the reader's remarks.
    pub(super) fn remarking(mut self, before: Option<String>, after: Option<String>) -> Self {
        self.opened.remarks.extend(before);
        self.remark = after;
        self
    }

    /// Reads a piece into the journal and the model. Returns whether more events may follow.
    pub(crate) fn step(&mut self) -> Result<bool, RecordingError> {
        let mut piece = Lines::default();
        let outcome = read_piece(&mut *self.recorded.events, &mut piece);
        self.events += piece.events().len() as u64;
        self.session.journal.note(&piece)?;
        self.session.model.apply_read(piece.events());
        outcome
    }

    /// Reads the session to its end, with threads for the model and the journal. Calls `go_on` regularly with the
    /// number of events read.
    pub(super) fn read(mut self, go_on: &dyn Fn(u64) -> bool) -> Result<(Session, Opened), RecordingError> {
        let read = match cfg!(target_arch = "wasm32") {
            true => self.read_in_steps(go_on),
            false => self.read_on_threads(go_on),
        };
        match read {
            Ok(()) => self.finish(),
            Err(error) => {
                self.give_up();
                Err(error)
            }
        }
    }

    /// Reads the events piece by piece. One thread applies them to the model, another thread compresses their lines for
    /// the journal.
    fn read_on_threads(&mut self, go_on: &dyn Fn(u64) -> bool) -> Result<(), RecordingError> {
        let Session { model, journal, .. } = &mut self.session;
        let events = &mut *self.recorded.events;
        let path = journal.path().to_owned();
        let mut read = |to_journal: &mut dyn FnMut(Arc<Lines>) -> bool,
                        to_model: &mut dyn FnMut(Arc<Lines>) -> bool| {
            let mut count = 0;
            loop {
                let mut piece = Lines::default();
                let outcome = read_piece(events, &mut piece);
                count += piece.events().len() as u64;
                let piece = Arc::new(piece);
                // Reading ends if the journal refuses a piece.
                if !(to_journal(Arc::clone(&piece)) && to_model(piece) && outcome?) {
                    return Ok(());
                }
                if !go_on(count) {
                    return Err(interrupted(&path));
                }
            }
        };
        let note = |piece: Arc<Lines>| journal.note(&piece);
        let apply = |piece: Arc<Lines>| {
            model.apply_read(piece.events());
            Ok(())
        };
        let ((read, applied), noted) = threads::hand_over(PIECES_AHEAD, note, |to_journal| {
            threads::hand_over(PIECES_AHEAD, apply, |to_model| read(to_journal, to_model))
        });
        noted.and(applied).and(read)
    }

    /// Reads the events piece by piece on this thread.
    fn read_in_steps(&mut self, go_on: &dyn Fn(u64) -> bool) -> Result<(), RecordingError> {
        while self.step()? {
            if !go_on(self.events) {
                return Err(interrupted(self.session.path()));
            }
        }
        Ok(())
    }

    /// Returns the session after its last piece.
    pub(crate) fn finish(mut self) -> Result<(Session, Opened), RecordingError> {
        let notes = self.recorded.events.notes();
        self.opened.remarks.extend(notes.warnings);
        if notes.skipped > 0 {
            self.opened.remarks.push(format!("damaged parts skipped: {}", notes.skipped));
        }
        if let Err(error) = self.session.journal.start() {
            self.give_up();
            return Err(error);
        }
        if self.ends_strokes {
            self.session.end_open_strokes();
        }
        self.opened.remarks.extend(self.remark);
        Ok((self.session, self.opened))
    }

    /// Aborts reading. The file has not changed.
    pub(crate) fn give_up(self) {
        self.session.journal.give_back(self.give_back);
    }
}

fn interrupted(path: &Path) -> RecordingError {
    RecordingError::io(path, io::ErrorKind::Interrupted.into())
}

/// Reads the events of a piece. Events before an error stay in the piece. Returns whether more events may follow.
fn read_piece(events: &mut dyn EventSource, piece: &mut Lines) -> Result<bool, RecordingError> {
    while piece.events().len() < PIECE && piece.bytes() < PIECE_BYTES {
        let Some(event) = events.next_event()? else { return Ok(false) };
        piece.push(event, events.line());
    }
    Ok(true)
}
