use std::{
    cell::Cell,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use thiserror::Error;

use super::Document;
use crate::{
    app::journal::{Autosaves, Journal, NotTaken, OpenElsewhere, SessionFile, SessionLock, Trouble},
    atomic_file::Destination,
    platform::fs,
    recording::{self, Header, Limits, ONE_AUTHOR_FORMAT, OpenOptions, RecordingError, Session},
};

/// How the source in the header of a session begins if osp drew it.
const OURS: &str = "osp sketch ";

/// What a session is opened for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// Draw on it.
    #[default]
    Write,
    /// Read it only.
    ReadOnly,
    /// Draw on a copy of it.
    Copy,
}

/// How a session is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// What it is opened for.
    pub access: Access,
    /// Leave out damaged pieces, instead of refusing the session. Then a copy is drawn on.
    pub lenient: bool,
    /// How much the session may hold.
    pub limits: Limits,
}

impl Opening {
    /// For this access, damaged sessions refused.
    pub fn with(access: Access) -> Self {
        Self { access, ..Self::default() }
    }

    fn options(self) -> OpenOptions {
        OpenOptions { lenient: self.lenient, limits: self.limits }
    }
}

/// The remarks from opening a session.
#[derive(Clone, Debug, Default)]
pub struct Opened {
    /// One line each, for people.
    pub remarks: Vec<String>,
    /// The session was left open by a program that is gone.
    pub is_recovered: bool,
}

/// Why a session was not opened.
#[derive(Debug, Error)]
pub enum OpenError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Another window draws on it.
    #[error(transparent)]
    Held(OpenElsewhere),
    /// Somebody did not want to wait.
    #[error("{}: opening it was cancelled", .0.display())]
    Cancelled(PathBuf),
}

impl OpenError {
    fn io(path: &Path, error: io::Error) -> Self {
        Self::Recording(RecordingError::io(path, error))
    }

    /// Whether the session can be read but for damaged pieces, or up to a limit.
    pub fn is_damage(&self) -> bool {
        matches!(
            self,
            Self::Recording(
                RecordingError::Line { .. } | RecordingError::Byte { .. } | RecordingError::Limit { .. }
            )
        )
    }
}

impl Document {
    /// An empty session without a name.
    pub fn new(autosaves: &Autosaves) -> Self {
        let journal = Journal::unnamed(autosaves, "sketch", our_header("sketch"));
        Self::around(journal.expect("a header without numbers is sound"))
    }

    /// The newest session that a crash left open and that can be read, or an empty one.
    pub fn recover_or_new(autosaves: &Autosaves) -> (Self, Opened) {
        Self::recover_or_new_within(autosaves, Limits::DEFAULT)
    }

    /// [`Document::recover_or_new`] with limits.
    pub fn recover_or_new_within(autosaves: &Autosaves, limits: Limits) -> (Self, Opened) {
        let mut opened = Opened::default();
        for path in autosaves.marked() {
            // The lock comes before anything is read: another window may be looking for the same.
            let Some(lock) = SessionLock::take_over(&path) else { continue };
            let file = match SessionFile::open(path.clone(), lock) {
                Ok(file) => file,
                Err((trouble, lock)) => {
                    opened.remarks.push(format!("{}: was left open: {trouble}", path.display()));
                    lock.leave();
                    continue;
                }
            };
            let mut recovered = Opened { is_recovered: true, ..Opened::default() };
            let all = &|_| true;
            match Self::go_on(&path, limits, file, autosaves, &mut recovered, SessionFile::leave, all) {
                Ok(mut document) => {
                    document.journal.forget_name();
                    opened.remarks.push(format!("brought back {}", path.display()));
                    opened.remarks.append(&mut recovered.remarks);
                    opened.is_recovered = true;
                    return (document, opened);
                }
                Err(error) => opened.remarks.push(format!(
                    "{error}; this session was left open: `osp sketch --lenient {}` opens what can be read",
                    path.display()
                )),
            }
        }
        (Self::new(autosaves), opened)
    }

    /// Opens a session of any format. One that was drawn here goes on in its file (which is made if it is not there); of
    /// any other a copy is made among the autosaves, with the first event that is drawn.
    ///
    /// # Errors
    /// The session cannot be read, is of no known format, or is to be drawn on while another window has it.
    pub fn open(path: &Path, autosaves: &Autosaves) -> Result<(Self, Opened), OpenError> {
        Self::open_as(path, autosaves, Opening::default())
    }

    /// [`Document::open`] with options.
    ///
    /// # Errors
    /// As there; a session that is opened read-only or as a copy may be open in another window.
    pub fn open_as(path: &Path, autosaves: &Autosaves, how: Opening) -> Result<(Self, Opened), OpenError> {
        Self::open_watched(path, autosaves, how, &|_| true)
    }

    /// [`Document::open_as`]; `go_on` is asked from time to time, with the number of events that were read.
    ///
    /// # Errors
    /// As there, and `go_on` said no.
    pub fn open_watched(
        path: &Path,
        autosaves: &Autosaves,
        how: Opening,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(Self, Opened), OpenError> {
        let was_cancelled = Cell::new(false);
        let watch = |events| {
            let goes_on = go_on(events);
            was_cancelled.set(!goes_on);
            goes_on
        };
        let outcome = Self::open_asking(path, autosaves, how, &watch);
        // The reader's error is that it was interrupted.
        if was_cancelled.get() { Err(OpenError::Cancelled(path.to_owned())) } else { outcome }
    }

    fn open_asking(
        path: &Path,
        autosaves: &Autosaves,
        how: Opening,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(Self, Opened), OpenError> {
        let may_begin = how.access == Access::Write && is_ron(path);
        let is_new = match fs::metadata(path) {
            Ok(data) => data.is_file() && data.len() == 0,
            Err(error) if error.kind() == ErrorKind::NotFound && may_begin => true,
            Err(error) => return Err(OpenError::io(path, error)),
        };
        if is_new && may_begin {
            return Ok((Self::begin(path, autosaves)?, Opened::default()));
        }
        if how.access == Access::ReadOnly {
            return Ok(Self::look_at_asking(path, autosaves, how, go_on)?);
        }
        let session = recording::open(path, &how.options())?;
        let why_copied = match how.access {
            Access::Copy => Some("as asked"),
            _ => why_not_itself(&session, path, how.lenient),
        };
        let mut opened = Opened::default();
        let document = match why_copied {
            Some(why) => Self::copy(session, path, why, autosaves, &mut opened, go_on)?,
            None => {
                // One that a crash left open stays marked if it is not opened now.
                let was_left_open = fs::is_there(&SessionLock::mark_of(path));
                let file = take(path)?;
                let give_back = if was_left_open { SessionFile::leave } else { SessionFile::release };
                Self::go_on(path, how.limits, file, autosaves, &mut opened, give_back, go_on)?
            }
        };
        Ok((document, opened))
    }

    /// Opens a session that another window has, read-only. It may be empty.
    ///
    /// # Errors
    /// The session cannot be read, or is of no known format.
    pub fn look_at(
        path: &Path,
        autosaves: &Autosaves,
        how: Opening,
    ) -> Result<(Self, Opened), RecordingError> {
        Self::look_at_asking(path, autosaves, how, &|_| true)
    }

    fn look_at_asking(
        path: &Path,
        autosaves: &Autosaves,
        how: Opening,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(Self, Opened), RecordingError> {
        if fs::metadata(path).map_or(true, |data| data.is_file() && data.len() == 0) {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let journal = Journal::of_reader(path, our_header(&stem), autosaves)?;
            return Ok((Self::around(journal), Opened::default()));
        }
        let session = recording::open(path, &how.options())?;
        let journal = Journal::of_reader(path, session.header.clone(), autosaves)?;
        let mut opened = Opened::default();
        opened.remarks.push(format!("{}: opened read-only", path.display()));
        let document = Self::of_session(session, journal, &mut opened, go_on).map_err(|(error, _)| error)?;
        Ok((document, opened))
    }

    /// A session that is not there yet, or an empty file.
    fn begin(path: &Path, autosaves: &Autosaves) -> Result<Self, OpenError> {
        let file = if fs::is_there(path) {
            take(path)?
        } else {
            if let Some(folder) = missing_folder(path) {
                let cause = format!("the folder {} does not exist", folder.display());
                return Err(OpenError::io(path, io::Error::new(ErrorKind::NotFound, cause)));
            }
            let lock = match SessionLock::take(path) {
                Ok(lock) => Some(lock),
                Err(NotTaken::Held(held)) => return Err(OpenError::Held(held)),
                // The first event makes the folder, and says why if it cannot.
                Err(NotTaken::Failed(_)) => None,
            };
            SessionFile::new(path.to_owned(), lock)
        };
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut journal = Journal::named(file, our_header(&stem), autosaves)?;
        journal.start()?;
        Ok(Self::around(journal))
    }

    /// Opens a session to continue in its file, whose lock we have. If it cannot be read, the lock is released.
    fn go_on(
        path: &Path,
        limits: Limits,
        file: SessionFile,
        autosaves: &Autosaves,
        opened: &mut Opened,
        give_back: fn(SessionFile),
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<Self, OpenError> {
        // Nothing may be appended behind damage: it would not be read again.
        match recording::open(path, &OpenOptions { lenient: false, limits }) {
            Ok(session) => {
                let journal = Journal::named(file, session.header.clone(), autosaves)?;
                Self::of_session(session, journal, opened, go_on).map_err(|(error, journal)| {
                    journal.give_back(give_back);
                    error.into()
                })
            }
            Err(error) => {
                give_back(file);
                Err(error.into())
            }
        }
    }

    /// Reads a session into a new one among the autosaves.
    fn copy(
        session: Session,
        path: &Path,
        why: &str,
        autosaves: &Autosaves,
        opened: &mut Opened,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<Self, OpenError> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let source = format!("{}, from {}: {}", our_header("").source, path.display(), session.header.source);
        let format = session.header.format.max(ONE_AUTHOR_FORMAT);
        let header = Header { source, format, ..session.header.clone() };
        let journal = Journal::unnamed(autosaves, &stem, header)?;
        let document = Self::of_session(session, journal, opened, go_on).map_err(|(error, journal)| {
            journal.give_back(SessionFile::release);
            error
        })?;
        opened.remarks.push(format!("{}: {why}: a copy is drawn on", path.display()));
        Ok(document)
    }

    fn of_session(
        session: Session,
        journal: Journal,
        opened: &mut Opened,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<Self, (RecordingError, Box<Journal>)> {
        let mut document = Self::around(journal);
        match document.read_whole(session, opened, go_on).and_then(|()| document.journal.start()) {
            Ok(()) => {
                document.end_open_strokes();
                Ok(document)
            }
            Err(error) => Err((error, Box::new(document.journal))),
        }
    }

    fn read_whole(
        &mut self,
        mut session: Session,
        opened: &mut Opened,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(), RecordingError> {
        self.read(&mut *session.events, go_on)?;
        let notes = session.events.notes();
        opened.remarks.extend(notes.warnings);
        if notes.skipped > 0 {
            opened.remarks.push(format!("{} damaged pieces were left out", notes.skipped));
        }
        Ok(())
    }
}

/// The folder of a file that is not there, if it is missing, too.
fn missing_folder(path: &Path) -> Option<PathBuf> {
    let Ok(Destination::File(target)) = Destination::of(path) else { return None };
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty())?;
    (!fs::is_folder(folder)).then(|| folder.to_owned())
}

fn is_ron(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "ron")
}

fn our_header(name: &str) -> Header {
    let source = concat!("osp sketch ", env!("CARGO_PKG_VERSION"));
    Header { format: ONE_AUTHOR_FORMAT, ..Header::new(name, source) }
}

/// The file of a session, with its lock.
fn take(path: &Path) -> Result<SessionFile, OpenError> {
    let lock = SessionLock::take(path).map_err(|reason| match reason {
        NotTaken::Held(held) => OpenError::Held(held),
        NotTaken::Failed(error) => OpenError::io(path, error),
    })?;
    SessionFile::open(path.to_owned(), lock).map_err(|(trouble, lock)| {
        lock.release();
        match trouble {
            Trouble::Held(held) => OpenError::Held(held),
            trouble => OpenError::io(path, io::Error::other(trouble.to_string())),
        }
    })
}

/// Why a copy is drawn on, and not the session itself.
fn why_not_itself(session: &Session, path: &Path, lenient: bool) -> Option<&'static str> {
    if lenient {
        Some("its damaged pieces are left out")
    } else if session.format != "ron" || !is_ron(path) {
        Some("is of another format")
    } else if !session.header.source.starts_with(OURS) {
        Some("was not drawn with `osp sketch`")
    } else if !may_be_written(path) {
        Some("may not be written to")
    } else {
        None
    }
}

/// Root may write everything, but respects the file's own permissions, too.
fn may_be_written(path: &Path) -> bool {
    let is_marked = fs::metadata(path).is_ok_and(|data| data.permissions().readonly());
    !is_marked && fs::File::options().write(true).open(path).is_ok()
}
