//! Joins, follows and leaves a shared session.

use std::{path::Path, time::Duration};

use super::{Live, known::Known};
use crate::{
    journal::{Autosaves, Journal, Unwritten},
    session::{
        Session, Source,
        opening::{OpenError, Opened},
    },
    threads,
};
use osp_net::live::{self, Connection};
use osp_session::{
    platform::time::Instant,
    recording::{Event, Limits, RecordingError},
};

/// Work of a frame for events of other authors, in units of [`Scene::apply_within`](osp_session::scene::Scene). A long
/// session arrives over several frames.
const WORK_A_FRAME: u64 = 1 << 15;
/// Longest time for which a closing window waits for the server to return all of the user's events.
const CLOSING_TIME: Duration = Duration::from_secs(3);

/// The file of a shared session that has not been joined yet.
#[derive(Debug)]
pub struct Unjoined {
    session: Session,
    known: Option<Known>,
}

impl Unjoined {
    /// Opens the recording of the shared session with this name, or begins a new recording.
    ///
    /// # Errors
    /// The file cannot be read or written, another window has it open, or it has other contents.
    pub fn open(
        path: &Path,
        name: &str,
        autosaves: &Autosaves,
        limits: Limits,
    ) -> Result<(Self, Opened), OpenError> {
        let (session, opened, file) = Session::open_shared(path, live::header(name), autosaves, limits)?;
        let Some(file) = file else { return Ok((Self { session, known: None }, opened)) };
        let known = Known { file, path: path.to_owned(), left: session.event_count() };
        Ok((Self { session, known: Some(known) }, opened))
    }

    /// Joins the session. The window already shows the events of the file; newer events of the session are appended to
    /// the file.
    pub fn join(self, live: Live) -> Session {
        let Self { mut session, known } = self;
        session.source = Source::Live(Box::new(Live { known, ..live }));
        session
    }
}

impl Session {
    /// A shared session without a file. The session is empty until events are received.
    ///
    /// # Errors
    /// The session's name is invalid in a recording.
    pub fn joining(live: Live, autosaves: &Autosaves) -> Result<Self, RecordingError> {
        let journal = Journal::unnamed(autosaves, live.session(), live::header(live.session()))?;
        Ok(Self { source: Source::Live(Box::new(live)), ..Self::around(journal) })
    }

    /// Applies received events, as many as a frame has work for, as one frame.
    pub(crate) fn follow(&mut self) {
        let Self { source: Source::Live(live), model, journal, news, .. } = self else { return };
        live.fetch(news);
        live.has_unread_events = live.inbox.has_enough();
        let taken = model.apply_within(live.inbox.next(), WORK_A_FRAME);
        let events = live.take(taken, news);
        live.has_unread_events |= !live.inbox.is_empty();
        write_ordered(journal, &events, news);
        news.extend(live.note_left_out(&events, &model.scene));
        live.show_own(&model.scene);
    }

    /// Leaves the shared session, after a short wait for the server to return all of the user's events. Returns
    /// messages about missing events.
    pub(crate) fn leave(&mut self) -> Result<Vec<String>, Unwritten> {
        let Some(live) = self.live() else { return Ok(Vec::new()) };
        let status = live.link.status();
        // The server does not answer a watcher, or any window of a full session. A window without an author has nothing
        // to leave.
        let is_answered = !live.is_watcher
            && status.connection != Connection::Full
            && (status.author.is_some() || live.is_waiting());
        live.link.hand().leave();
        let since = Instant::now();
        while is_answered
            && since.elapsed() < CLOSING_TIME
            && self.live().is_some_and(|live| !live.has_left && live.ended.is_none())
        {
            self.follow();
            threads::pause(Duration::from_millis(5));
        }
        self.follow();
        let mut said = std::mem::take(&mut self.news);
        let source = std::mem::replace(&mut self.source, Source::File);
        let Source::Live(mut live) = source else { return Ok(said) };
        // The remaining events are added to the file, but not to the model. Among them, the user's events still count
        // as missing; the file of the user's own events contains them. The loop has a time limit, because other authors
        // may draw continuously.
        let since = Instant::now();
        while since.elapsed() < CLOSING_TIME
            && let Some(rest) = live.take_rest(&mut said)
        {
            write_ordered(&mut self.journal, &rest, &mut said);
        }
        let is_kept = self.journal.settle().is_ok();
        let Live { own, waiting, refused, .. } = *live;
        let missing = waiting.len() + refused;
        if missing == 0 && is_kept {
            own.remove();
            return Ok(said);
        }
        if own.is_changed() {
            let path = own.path().to_owned();
            own.leave_open()?;
            let path = path.display();
            said.push(format!(
                "{missing} of your changes are not in the session, or came too late; all that you have drawn is in {path}"
            ));
        }
        Ok(said)
    }
}

/// Writes the next events of a shared session to its file.
fn write_ordered(journal: &mut Journal, events: &[Event], news: &mut Vec<String>) {
    if events.is_empty() {
        return;
    }
    for event in events {
        if let Err(error) = journal.push(event) {
            news.push(error.to_string());
        }
    }
    journal.write_pending();
}
