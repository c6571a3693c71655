//! Writes a session to its file while it is drawn.
//!
//! ```text
//! event ──> History (its whole text, in memory) ──> SessionFile (at the chosen path)
//!                                               └─> SessionFile (the shelter, an autosave file, while the first fails)
//! ```

mod autosaves;
mod calendar;
mod contents;
mod history;
mod lock;
mod session_file;

use std::{
    collections::BTreeSet,
    mem::discriminant,
    path::{Path, PathBuf},
    time::Duration,
};

use thiserror::Error;

use history::History;
use osp_session::{
    platform::time::Instant,
    recording::{Event, Header, RecordingError, StrokeId},
};

pub use autosaves::{Autosave, Autosaves};
pub(super) use autosaves::{OURS, source_of_copy};
pub(super) use history::{Lines, Log, SourceFile};
pub use lock::OpenElsewhere;
pub(super) use lock::{NotTaken, SessionLock};
pub(super) use session_file::SessionFile;
pub use session_file::Trouble;

/// Time before a failed write is retried.
const RETRY: Duration = Duration::from_secs(3);

/// Saves a session while it is drawn: every event is written to the file, as its own line, before the next event.
///
/// Only one program at a time writes the file. If another program removes, replaces or changes the file, or the disk is
/// full, the journal no longer writes to it. The whole session is in memory; it is written to an autosave file (the
/// shelter) until the file is restored or another path is chosen.
#[derive(Debug)]
pub struct Journal {
    history: History,
    /// `None` for a read-only session.
    file: Option<SessionFile>,
    path: PathBuf,
    is_named: bool,
    /// Whether events have been added since the session was opened or last saved under a name.
    is_changed: bool,
    trouble: Option<Trouble>,
    tried_at: Instant,
    shelter: Option<SessionFile>,
    shelter_failed_at: Option<Instant>,
    autosaves: Autosaves,
    news: Vec<String>,
}

/// Events of a session that could not be written to its file.
#[derive(Debug, Error)]
#[error("{}: {trouble}; {}", path.display(), rest(*missing, kept_in.as_deref()))]
pub struct Unwritten {
    /// The session's file.
    pub path: PathBuf,
    /// Reason for which the file cannot be written.
    pub trouble: Box<Trouble>,
    /// Number of events that are only in memory.
    pub missing: u64,
    /// An autosave file with the whole session.
    pub kept_in: Option<PathBuf>,
}

fn rest(missing: u64, kept_in: Option<&Path>) -> String {
    match kept_in {
        Some(path) => {
            format!("the whole session is in {}, and the next `osp sketch` restores it", path.display())
        }
        None => format!("{missing} changes are in no file"),
    }
}

/// Reason for which a session was not saved.
#[derive(Debug, Error)]
pub enum SaveError {
    /// The name does not end in `.ron`. Only such a file can be continued.
    #[error("{}: expected a name that ends in .ron", .0.display())]
    Name(PathBuf),
    /// Another window has the session at this path open.
    #[error(transparent)]
    Held(OpenElsewhere),
    /// The file cannot be written.
    #[error("{}: {cause}", path.display())]
    Failed { path: PathBuf, cause: Trouble },
}

impl Journal {
    fn new(
        file: Option<SessionFile>,
        path: PathBuf,
        header: Header,
        autosaves: &Autosaves,
    ) -> Result<Self, RecordingError> {
        Ok(Self {
            history: History::new(header)?,
            file,
            path,
            is_named: true,
            is_changed: false,
            trouble: None,
            tried_at: Instant::now(),
            shelter: None,
            shelter_failed_at: None,
            autosaves: autosaves.clone(),
            news: Vec::new(),
        })
    }

    /// The journal of an unnamed session. The first event creates its file.
    ///
    /// # Errors
    /// The header has an invalid number.
    pub fn unnamed(autosaves: &Autosaves, stem: &str, header: Header) -> Result<Self, RecordingError> {
        let file = autosaves.new_file(stem);
        let path = file.path().to_owned();
        Ok(Self { is_named: false, ..Self::new(Some(file), path, header, autosaves)? })
    }

    /// The journal of a session under a path that the user chose.
    pub(super) fn named(
        file: SessionFile,
        header: Header,
        autosaves: &Autosaves,
    ) -> Result<Self, RecordingError> {
        let path = file.path().to_owned();
        Self::new(Some(file), path, header, autosaves)
    }

    pub(super) fn of_reader(
        path: &Path,
        header: Header,
        autosaves: &Autosaves,
    ) -> Result<Self, RecordingError> {
        Self::new(None, path.to_owned(), header, autosaves)
    }

    /// Keeps this file in place of the events' lines, until the first edit.
    pub(super) fn hold(mut self, source: SourceFile) -> Self {
        self.history.hold(source);
        self
    }

    /// Adds events that were read from the session's file.
    pub(super) fn note(&mut self, lines: &Lines) -> Result<(), RecordingError> {
        self.history.push_read(lines)
    }

    /// Records that the session was opened with the current events. Its file, if it exists, already has these events.
    pub(super) fn start(&mut self) -> Result<(), RecordingError> {
        match &mut self.file {
            Some(file) => file.follow_from_here(&self.history),
            None => Ok(()),
        }
    }

    /// Closes the session's file with `how`, without reporting an error.
    pub(super) fn give_back(self, how: fn(SessionFile)) {
        if let Some(file) = self.file {
            how(file);
        }
    }

    pub(super) fn forget_name(&mut self) {
        self.is_named = false;
    }

    /// The session's file; for a read-only session the file that was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The session's header.
    pub fn header(&self) -> &Header {
        self.history.header()
    }

    /// Whether the user has chosen the session's path.
    pub fn is_named(&self) -> bool {
        self.is_named
    }

    pub fn is_read_only(&self) -> bool {
        self.file.is_none()
    }

    /// Whether events were added since the session was opened or saved under a name.
    pub fn is_changed(&self) -> bool {
        self.is_changed
    }

    /// Reason for which the file cannot be written; `None` if it can.
    pub fn trouble(&self) -> Option<&Trouble> {
        self.trouble.as_ref()
    }

    /// The autosave file that holds the whole session while its own file cannot be written.
    pub fn shelter(&self) -> Option<&Path> {
        let shelter = self.shelter.as_ref().filter(|_| self.trouble.is_some())?;
        (shelter.missing(&self.history) == 0).then(|| shelter.path())
    }

    /// Number of events that are in no file.
    pub fn missing(&self) -> u64 {
        let Some(trouble) = &self.trouble else { return 0 };
        let file = self.file.as_ref().filter(|_| !trouble.is_lost());
        let of = |file: &SessionFile| file.missing(&self.history);
        let least = file.map(of).into_iter().chain(self.shelter.as_ref().map(of)).min();
        least.unwrap_or_else(|| self.history.events())
    }

    /// Whether all written data are on the disk, not only in the system's cache.
    pub fn is_synced(&self) -> bool {
        self.file.iter().chain(&self.shelter).all(SessionFile::is_synced)
    }

    /// A message with the path of the drawing, if its file is an autosave file. `None` if the user opened this autosave
    /// file and did not change it.
    pub(super) fn place_of_edits(&self) -> Option<String> {
        let is_made = self.file.as_ref().is_some_and(SessionFile::is_made) && self.trouble.is_none();
        let is_news = self.is_changed || !self.is_named;
        let is_there = is_made && is_news && self.autosaves.has(&self.path);
        let what = match autosaves::name_of_origin(self.header()) {
            Some(name) => format!("the edits of {name} are"),
            None => "the drawing without a name is".to_owned(),
        };
        is_there.then(|| format!("{what} in {}", self.path.display()))
    }

    pub(super) fn take_news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }

    pub(super) fn is_at(&self, path: &Path) -> bool {
        self.file.as_ref().is_some_and(|file| file.is_at(path))
    }

    /// Adds an event and writes it to the file: immediately or, if the file fails, later.
    ///
    /// # Errors
    /// The event is invalid in a recording, and is skipped.
    pub fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.history.push(event)?;
        self.write_pending();
        Ok(())
    }

    /// Adds an event that the next call of [`Journal::write_pending`] writes, together with others.
    pub(super) fn push(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.history.push(event)
    }

    /// The events that drew these strokes, in order.
    pub(super) fn events_of(&mut self, strokes: &BTreeSet<StrokeId>) -> std::io::Result<Vec<Event>> {
        self.history.write_lines().map_err(std::io::Error::other)?;
        self.history.events_of(strokes)
    }

    /// A copy of all events for another thread.
    pub(super) fn log(&self) -> Log {
        self.history.log()
    }

    /// Writes the added events to the file: immediately or, if the file fails, later.
    pub(super) fn write_pending(&mut self) {
        self.is_changed = true;
        match &self.trouble {
            None => self.catch_up(Instant::now()),
            Some(_) => self.take_shelter(Instant::now()),
        }
    }

    /// Checks the file, flushes it to the disk at pauses, and retries a failed write. Call it regularly, with or
    /// without new events.
    pub fn tend(&mut self, now: Instant) {
        let Some(file) = &mut self.file else { return };
        if self.trouble.is_none() {
            if let Err(trouble) = file.check().and_then(|()| file.sync_at_pauses(now)) {
                self.handle(trouble, now);
            }
            return;
        }
        if now.saturating_duration_since(self.tried_at) >= RETRY {
            self.catch_up(now);
        }
        if let Some(shelter) = &mut self.shelter
            && shelter.sync_at_pauses(now).is_err()
        {
            self.shelter_failed_at = Some(now);
        }
    }

    /// Retries a failed write immediately.
    pub fn retry(&mut self) {
        self.catch_up(Instant::now());
    }

    fn catch_up(&mut self, now: Instant) {
        let Some(file) = &mut self.file else { return };
        // A session without changes is not written, not even the ends of strokes that a crash left open.
        let outcome = if self.is_changed { file.catch_up(&self.history) } else { file.check() };
        match outcome {
            Ok(()) => self.leave_shelter(),
            Err(trouble) => self.handle(trouble, now),
        }
    }

    /// Removes the shelter once the file has all events and is flushed to the disk.
    fn leave_shelter(&mut self) {
        if self.trouble.is_none() {
            return;
        }
        if let Some(Err(trouble)) = self.file.as_mut().map(SessionFile::sync) {
            self.trouble = Some(trouble);
            return;
        }
        self.trouble = None;
        self.news.push(format!("{}: the file is complete again", self.path.display()));
        if let Some(shelter) = self.shelter.take() {
            shelter.remove();
        }
    }

    fn handle(&mut self, trouble: Trouble, now: Instant) {
        self.tried_at = now;
        let is_new = self.trouble.as_ref().is_none_or(|old| discriminant(old) != discriminant(&trouble));
        if is_new {
            self.news.push(format!("{}: {trouble}", self.path.display()));
        }
        self.trouble = Some(trouble);
        self.take_shelter(now);
    }

    /// Writes the session to an autosave file while its own file fails.
    fn take_shelter(&mut self, now: Instant) {
        let Some(trouble) = &self.trouble else { return };
        let is_on_the_same_disk = self.path.parent() == Some(self.autosaves.folder());
        if !trouble.is_lost() && is_on_the_same_disk {
            return;
        }
        if self.shelter_failed_at.is_some_and(|at| now.saturating_duration_since(at) < RETRY) {
            return;
        }
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let shelter = self.shelter.get_or_insert_with(|| self.autosaves.new_file(&stem));
        match shelter.catch_up(&self.history) {
            Ok(()) if !self.is_named => self.stay_in_shelter(),
            Ok(()) => self.shelter_failed_at = None,
            Err(trouble) => {
                self.shelter_failed_at = Some(now);
                if trouble.is_lost() {
                    self.shelter = None;
                }
            }
        }
    }

    /// Makes the shelter the session's file, because the user did not choose the path of the lost file.
    fn stay_in_shelter(&mut self) {
        let Some(shelter) = self.shelter.take() else { return };
        self.path = shelter.path().to_owned();
        self.news.push(format!("the session continues in {}", self.path.display()));
        if let Some(lost) = self.file.replace(shelter) {
            lost.release();
        }
        (self.trouble, self.shelter_failed_at) = (None, None);
    }

    /// Writes the whole session to the file `to`, which becomes the session's file. An existing file is replaced.
    ///
    /// # Errors
    /// The file cannot be written, or its name does not end in `.ron`; the session continues in its old file.
    pub fn save_as(&mut self, to: &Path) -> Result<(), SaveError> {
        if to.extension().is_none_or(|ending| ending != "ron") {
            return Err(SaveError::Name(to.to_owned()));
        }
        let failed = |cause| SaveError::Failed { path: to.to_owned(), cause };
        self.history.write_lines().map_err(|error| failed(Trouble::CannotWrite(error.to_string())))?;
        let is_own = self.is_at(to);
        if is_own {
            self.catch_up(Instant::now());
            if self.trouble.is_none() && self.file.as_ref().is_some_and(SessionFile::is_made) {
                self.note_name(to);
                return Ok(());
            }
        }
        let own_lock = self.file.as_mut().filter(|_| is_own).and_then(|file| file.lock.take());
        let lock = match own_lock.map_or_else(|| SessionLock::take(to), Ok) {
            Ok(lock) => lock,
            Err(NotTaken::Held(held)) => return Err(SaveError::Held(held)),
            Err(NotTaken::Failed(error)) => return Err(failed(Trouble::CannotWrite(error.to_string()))),
        };
        let saved = SessionFile::replace(to, lock, &self.history).and_then(|mut file| match file.sync() {
            Ok(()) => Ok(file),
            Err(trouble) => {
                file.release();
                Err(trouble)
            }
        });
        let file = match saved {
            Ok(file) => file,
            Err(trouble) => {
                if let Some(file) = self.file.as_mut().filter(|_| is_own) {
                    file.lock = SessionLock::take(to).ok();
                }
                return Err(failed(trouble));
            }
        };
        if let Some(old) = self.file.replace(file) {
            // A file whose path the user did not choose is removed, because the new file has all events.
            if self.is_named || is_own { old.release() } else { old.remove() }
        }
        if let Some(shelter) = self.shelter.take() {
            shelter.remove();
        }
        self.note_name(to);
        Ok(())
    }

    /// Records that the session was saved under a name: only later events count as unsaved.
    fn note_name(&mut self, to: &Path) {
        self.path = to.to_owned();
        (self.is_named, self.is_changed) = (true, false);
        (self.trouble, self.shelter_failed_at) = (None, None);
    }

    /// Writes all events to the file and flushes it to the disk.
    ///
    /// # Errors
    /// A part of the session could not be written.
    pub fn settle(&mut self) -> Result<(), Unwritten> {
        let now = Instant::now();
        if self.history.events() > 0 || self.is_changed {
            self.catch_up(now);
            if self.trouble.is_none()
                && let Some(file) = &mut self.file
                && let Err(trouble) = file.check_all().and_then(|()| file.sync())
            {
                self.handle(trouble, now);
            }
        } else {
            self.trouble = None;
        }
        let Some(trouble) = self.trouble.clone() else { return Ok(()) };
        if let Some(Err(_)) = self.shelter.as_mut().map(SessionFile::sync) {
            self.shelter_failed_at = Some(now);
        }
        let kept_in = self.shelter().map(Path::to_owned);
        Err(Unwritten {
            path: self.path.clone(),
            trouble: Box::new(trouble),
            missing: self.missing(),
            kept_in,
        })
    }

    /// Ends the session regularly. A session that stays marked as open was ended by a crash or could not be written.
    ///
    /// # Errors
    /// A part of the session could not be written.
    pub fn close(mut self) -> Result<(), Unwritten> {
        let settled = self.settle();
        if let Some(shelter) = self.shelter.take() {
            shelter.leave();
        }
        if let Some(file) = self.file.take() {
            match &settled {
                Err(_) if !self.is_named => file.leave(),
                // A web page shows no files to the user, so the next visit restores an unnamed session.
                Ok(()) if cfg!(target_arch = "wasm32") && !self.is_named && file.is_made() => file.leave(),
                _ => file.release(),
            }
        }
        settled
    }
}

#[cfg(feature = "live")]
impl Journal {
    /// Removes the session's file, because another file has its contents.
    pub(super) fn remove(self) {
        self.file.into_iter().chain(self.shelter).for_each(SessionFile::remove);
    }

    /// Ends the session but leaves it marked as open, so that the next `osp sketch` restores it.
    pub(super) fn leave_open(mut self) -> Result<(), Unwritten> {
        let settled = self.settle();
        self.file.into_iter().chain(self.shelter).for_each(SessionFile::leave);
        settled
    }
}

#[cfg(test)]
mod tests;
