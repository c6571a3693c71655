//! Opens sessions for drawing or read-only.

use std::{
    borrow::Cow,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use super::{
    Session,
    opening::{Access, OpenError, Opened, Opening},
    reader::{SessionReader, Started},
};
use crate::journal::{
    Autosaves, Journal, NotTaken, OURS, SessionFile, SessionLock, SourceFile, Trouble, source_of_copy,
};
use osp_session::{
    atomic_file::Destination,
    platform::fs,
    recording::{self, Header, Limits, ONE_AUTHOR_FORMAT, OpenOptions, RecordingError},
};

impl Session {
    /// An empty, unnamed session.
    pub fn new(autosaves: &Autosaves) -> Self {
        let journal = Journal::unnamed(autosaves, "sketch", our_header("sketch"));
        Self::around(journal.expect("a header without numbers is sound"))
    }

    /// Restores the newest readable session that a crash left open. Without such a session, begins an empty session.
    pub fn recover_or_new(autosaves: &Autosaves, limits: Limits) -> (Self, Opened) {
        let mut opened = Opened::default();
        for path in autosaves.marked() {
            // The lock is taken before reading, because another window may try to restore the same session.
            let Some(lock) = SessionLock::take_over(&path) else { continue };
            let file = match SessionFile::open(path.clone(), lock) {
                Ok(file) => file,
                Err((trouble, lock)) => {
                    opened.remarks.push(format!("{}: was not restored: {trouble}", path.display()));
                    lock.leave();
                    continue;
                }
            };
            let reader = Self::reader_to_continue(&path, limits, file, autosaves, SessionFile::leave);
            match reader.and_then(|reader| Ok(reader.read(&|_| true)?)) {
                Ok((mut session, mut recovered)) => {
                    session.journal.forget_name();
                    opened.remarks.push(format!("restored {}", path.display()));
                    opened.remarks.append(&mut recovered.remarks);
                    opened.is_recovered = true;
                    return (session, opened);
                }
                Err(error) => opened.remarks.push(format!(
                    "{error}; this session was not restored: `osp sketch --lenient {}` opens the readable part",
                    path.display()
                )),
            }
        }
        (Self::new(autosaves), opened)
    }

    /// Opens a session of any format. A session of `osp sketch` continues in its own file, which may be new. For any
    /// other session, the first new event creates a copy among the autosaves.
    ///
    /// # Errors
    /// The session cannot be read, has an unknown format, or is open for drawing in another window.
    pub fn open(path: &Path, autosaves: &Autosaves) -> Result<(Self, Opened), OpenError> {
        Self::open_as(path, autosaves, Opening::default())
    }

    /// Does the same as [`Session::open`], with options.
    ///
    /// # Errors
    /// The errors of [`Session::open`]. For read-only access or a copy, the session may be open in another window.
    pub fn open_as(path: &Path, autosaves: &Autosaves, how: Opening) -> Result<(Self, Opened), OpenError> {
        Self::start(path, autosaves, how)?.read_watched(path, &|_| true)
    }

    /// Begins to open a session like [`Session::open_as`]. The caller then reads the events.
    pub(crate) fn start(path: &Path, autosaves: &Autosaves, how: Opening) -> Result<Started, OpenError> {
        let may_begin = how.access == Access::Write && is_ron(path);
        let is_new = match fs::metadata(path) {
            Ok(data) => data.is_file() && data.len() == 0,
            Err(error) if error.kind() == ErrorKind::NotFound && may_begin => true,
            Err(error) => return Err(OpenError::io(path, error)),
        };
        if is_new && may_begin {
            let header = our_header(&stem(path));
            return Ok(Started::Empty(Box::new(Self::begin(path, header, autosaves)?)));
        }
        if how.access == Access::ReadOnly {
            return Ok(Self::reader_to_view(path, autosaves, how)?);
        }
        let session = recording::open(path, &how.options())?;
        let why_copied = match how.access {
            Access::Copy => Some("it stays as it is"),
            _ => reason_for_copy(&session, path, how.lenient),
        };
        let reader = match why_copied {
            Some(why) => {
                // `Access::Copy` requests a new copy, not the earlier one.
                let is_asked_for = how.access == Access::Copy && !how.lenient;
                let earlier = if is_asked_for { None } else { autosaves.edits_of(path) };
                let is_import = !is_asked_for && !session.header.source.starts_with(OURS);
                let mut reader = Self::to_copy(session, path, why, autosaves, how)?;
                (reader.session.earlier, reader.session.is_import) = (earlier, is_import);
                reader
            }
            None => Self::reader_of_own(path, how.limits, autosaves)?,
        };
        Ok(Started::Reads(Box::new(reader)))
    }

    fn reader_to_view(path: &Path, autosaves: &Autosaves, how: Opening) -> Result<Started, RecordingError> {
        if fs::metadata(path).map_or(true, |data| data.is_file() && data.len() == 0) {
            let journal = Journal::of_reader(path, our_header(&stem(path)), autosaves)?;
            return Ok(Started::Empty(Box::new(Self::around(journal))));
        }
        let session = recording::open(path, &how.options())?;
        let journal = Journal::of_reader(path, session.header.clone(), autosaves)?;
        let (session, journal) = held(session, journal, path, how)?;
        let remark = format!("{}: opened read-only", path.display());
        // A read-only session has no file to release.
        let reader = SessionReader::new(session, journal, SessionFile::release);
        Ok(Started::Reads(Box::new(reader.remarking(Some(remark), None))))
    }

    /// Opens the file of a shared session with this header, or begins a new file. For an existing file with events it
    /// also returns a second reader, to compare the events with the server's.
    #[cfg(feature = "live")]
    pub(crate) fn open_shared(
        path: &Path,
        header: Header,
        autosaves: &Autosaves,
        limits: Limits,
    ) -> Result<(Self, Opened, Option<recording::Session>), OpenError> {
        let refused = |why: &str| OpenError::io(path, io::Error::new(ErrorKind::InvalidInput, why));
        if !is_ron(path) {
            return Err(refused("expected a name that ends in .ron"));
        }
        match fs::metadata(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(OpenError::io(path, error)),
            Ok(data) if data.len() > 0 || !data.is_file() => {}
            _ => return Ok((Self::begin(path, header, autosaves)?, Opened::default(), None)),
        }
        let again = recording::open(path, &OpenOptions { limits, ..OpenOptions::STRICT })?;
        if again.header != header {
            let why = format!("expected the recording of the shared session {}, or a new file", header.name);
            return Err(refused(&why));
        }
        if again.format != "ron" {
            return Err(refused("expected a recording as plain text: a compressed one cannot be continued"));
        }
        if !may_be_written(path) {
            return Err(refused("it may not be written to"));
        }
        let mut reader = Self::reader_of_own(path, limits, autosaves)?;
        // Other authors of the shared session end unfinished strokes.
        reader.ends_strokes = false;
        let (session, opened) = reader.read(&|_| true)?;
        let has_events = session.event_count() > 0;
        Ok((session, opened, has_events.then_some(again)))
    }

    fn begin(path: &Path, header: Header, autosaves: &Autosaves) -> Result<Self, OpenError> {
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
                // The first event tries to take the lock again and reports the failure.
                Err(NotTaken::Failed(_)) => None,
            };
            SessionFile::new(path.to_owned(), lock)
        };
        let mut journal = Journal::named(file, header, autosaves)?;
        journal.start()?;
        Ok(Self::around(journal))
    }

    /// Starts to read a session that continues in its own file. A session that a crash left open stays marked if it
    /// cannot be read.
    fn reader_of_own(path: &Path, limits: Limits, autosaves: &Autosaves) -> Result<SessionReader, OpenError> {
        let was_left_open = fs::is_there(&SessionLock::path_of(path));
        let give_back = if was_left_open { SessionFile::leave } else { SessionFile::release };
        Self::reader_to_continue(path, limits, take(path)?, autosaves, give_back)
    }

    /// Starts to read a session that continues in `file`. On an error it calls `give_back` with the file.
    fn reader_to_continue(
        path: &Path,
        limits: Limits,
        file: SessionFile,
        autosaves: &Autosaves,
        give_back: fn(SessionFile),
    ) -> Result<SessionReader, OpenError> {
        // osp must not append after damage, because no reader would reach the new events.
        match recording::open(path, &OpenOptions { limits, ..OpenOptions::STRICT }) {
            Ok(session) => {
                let journal = Journal::named(file, session.header.clone(), autosaves)?;
                Ok(SessionReader::new(session, journal, give_back))
            }
            Err(error) => {
                give_back(file);
                Err(error.into())
            }
        }
    }

    /// Begins to copy a session into a new file in the folder of autosaves.
    fn to_copy(
        session: recording::Session,
        path: &Path,
        why: &str,
        autosaves: &Autosaves,
        how: Opening,
    ) -> Result<SessionReader, RecordingError> {
        let source = source_of_copy(path, &session.header.source);
        let format = session.header.format.max(ONE_AUTHOR_FORMAT);
        let header = Header { source, format, ..session.header.clone() };
        let journal = Journal::unnamed(autosaves, &stem(path), header)?;
        let (session, journal) = held(session, journal, path, how)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let remark = format!("{name}: {why}, so you draw on a copy, which is saved by itself");
        let mut reader = SessionReader::new(session, journal, SessionFile::release);
        reader.session.original = Some(path.to_owned());
        Ok(reader.remarking(None, Some(remark)))
    }
}

/// Reads a session from a copy of its file in memory, which the journal keeps until the first edit.
fn held(
    session: recording::Session,
    journal: Journal,
    path: &Path,
    how: Opening,
) -> Result<(recording::Session, Journal), RecordingError> {
    Ok(match SourceFile::read(path, session.format, how.options())? {
        Some(source) => (source.open()?, journal.hold(source)),
        None => (session, journal),
    })
}

/// The folder of a file, if this folder does not exist.
fn missing_folder(path: &Path) -> Option<PathBuf> {
    let Ok(Destination::File(target)) = Destination::of(path) else { return None };
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty())?;
    (!fs::is_folder(folder)).then(|| folder.to_owned())
}

fn stem(path: &Path) -> Cow<'_, str> {
    path.file_stem().unwrap_or_default().to_string_lossy()
}

fn is_ron(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "ron")
}

fn our_header(name: &str) -> Header {
    let source = format!("{OURS}{}", env!("CARGO_PKG_VERSION"));
    Header { format: ONE_AUTHOR_FORMAT, ..Header::new(name, source) }
}

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

/// The reason for which the user draws on a copy; `None` if the session itself can continue.
fn reason_for_copy(session: &recording::Session, path: &Path, lenient: bool) -> Option<&'static str> {
    if lenient {
        Some("its damaged parts are skipped")
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

/// Whether the file may be written. The read-only permission is checked, too, because the root user can write to any
/// file.
fn may_be_written(path: &Path) -> bool {
    let is_marked = fs::metadata(path).is_ok_and(|data| data.permissions().readonly());
    !is_marked && fs::File::options().write(true).open(path).is_ok()
}
