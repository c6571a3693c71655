use std::{
    io::{self, BufRead, BufReader, ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{
        Arc,
        mpsc::{Receiver, TryRecvError, channel},
    },
    time::Duration,
};

use thiserror::Error;

use super::{
    contents::{Contents, Stamp},
    history::History,
    lock::{NotTaken, OpenElsewhere, SessionLock, true_path},
};
use crate::threads;
use osp_session::{
    atomic_file::{Destination, write_atomically},
    platform::{
        fs::{self, File, Identity, Metadata, TryLockError},
        time::Instant,
    },
    recording::{LastLine, RecordingError},
};

/// Time without writes after which the file is flushed to the disk.
const PAUSE: Duration = Duration::from_secs(1);
/// Error if the thread that flushes a file has ended without a result.
const NOT_FLUSHED: &str = "the file was not flushed to the disk";
/// Smallest interval between two comparisons of a file that another program may have changed.
const COMPARE_INTERVAL: Duration = Duration::from_secs(1);
/// Longest time between flushes if there is no pause.
const LONGEST_UNSYNCED: Duration = Duration::from_secs(10);

/// Reason for which events cannot be written to a session's file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Trouble {
    /// No file exists at the session's path any more.
    #[error("it was removed, or its folder was")]
    Removed,
    /// Another file exists at the session's path.
    #[error("another file was put in its place")]
    Replaced,
    /// Another program has written to the file.
    #[error("another program has changed it: it has {found} bytes, not {expected}")]
    Changed { expected: u64, found: u64 },
    /// Another program has overwritten a part of the file.
    #[error("another program has written over a part of it")]
    Overwritten,
    /// Another program has created the file since the session began.
    #[error("another program has made a file of this name")]
    Appeared,
    /// Another window has opened the file since the session began.
    #[error("{0}")]
    Held(OpenElsewhere),
    /// The file cannot be written: the disk is full or defective.
    #[error("{0}")]
    CannotWrite(String),
}

impl Trouble {
    fn io(error: &io::Error) -> Self {
        Self::CannotWrite(error.to_string())
    }

    /// Whether the file at the session's path no longer has the session's contents, or another window has opened it.
    pub fn is_lost(&self) -> bool {
        !matches!(self, Self::CannotWrite(_))
    }
}

impl From<NotTaken> for Trouble {
    fn from(reason: NotTaken) -> Self {
        match reason {
            NotTaken::Held(held) => Self::Held(held),
            NotTaken::Failed(error) => Self::io(&error),
        }
    }
}

/// A file with the text of a [`History`] up to some byte. Only this program may write it.
///
/// Before every write the file at the path is compared with the open one, to detect changes by other programs.
#[derive(Debug)]
pub(crate) struct SessionFile {
    path: PathBuf,
    /// `None` if the lock could not be taken yet, because the first event creates the folder.
    pub(super) lock: Option<SessionLock>,
    /// `None` until the first event creates the file.
    open: Option<OpenFile>,
    /// Number of bytes of the history that the file has.
    held: u64,
    /// Number of lines of the history that the file has.
    lines: u64,
}

#[derive(Debug)]
struct OpenFile {
    file: Arc<File>,
    identity: Identity,
    /// Length after this program's last write, bytes.
    bytes: u64,
    /// Size of the complete lines, bytes; the next line is written after them.
    whole_bytes: u64,
    /// A hash of the complete lines.
    contents: Contents,
    /// Time of this program's last change.
    touched: Stamp,
    /// Whether another program may have changed the file since the last comparison.
    is_suspect: bool,
    compared_at: Option<Instant>,
    /// Whether the last line has no newline yet.
    lacks_newline: bool,
    /// Whether a write has failed and its incomplete line could not be removed.
    is_torn: bool,
    /// Whether the last flush to the disk failed, so that written events may be lost.
    is_doubtful: bool,
    unsynced: Option<Unsynced>,
    syncing: Option<Receiver<io::Result<()>>>,
}

/// Times of the first and the last write that are not flushed to the disk.
#[derive(Clone, Copy, Debug)]
struct Unsynced {
    first: Instant,
    last: Instant,
}

impl SessionFile {
    /// A file that the first event will create.
    pub(crate) fn new(path: PathBuf, lock: Option<SessionLock>) -> Self {
        Self { path, lock, open: None, held: 0, lines: 0 }
    }

    /// Opens a session to continue it. The lock was taken before, so no other program changes the file afterwards.
    pub(crate) fn open(path: PathBuf, lock: SessionLock) -> Result<Self, (Trouble, SessionLock)> {
        match open_for_writing(&path) {
            Ok(open) => Ok(Self { path, lock: Some(lock), open: Some(open), held: 0, lines: 0 }),
            Err(trouble) => Err((trouble, lock)),
        }
    }

    /// Marks the file's contents as read into the history: new events are appended from here on.
    pub(super) fn follow_from_here(&mut self, history: &History) -> Result<(), RecordingError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        if open.bytes > 0 {
            (self.held, self.lines) = (history.bytes(), history.events() + 1);
        }
        let io = |error| RecordingError::io(&self.path, error);
        let mut file = &*open.file;
        file.rewind().map_err(io)?;
        let end = LastLine::find(&mut BufReader::with_capacity(1 << 16, file), &self.path)?;
        (open.whole_bytes, open.lacks_newline) = (end.whole_bytes, end.lacks_newline);
        open.learn_contents().map_err(io)
    }

    /// Writes a whole session to a path and continues in that file. An existing file is replaced.
    pub(super) fn replace(path: &Path, lock: SessionLock, history: &History) -> Result<Self, Trouble> {
        let mut file = Self::new(path.to_owned(), Some(lock));
        if let Err(trouble) = file.rewrite(history) {
            file.release();
            return Err(trouble);
        }
        Ok(file)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn is_made(&self) -> bool {
        self.open.is_some()
    }

    /// Whether this path leads to the file.
    pub(super) fn is_at(&self, path: &Path) -> bool {
        true_path(path) == true_path(&self.path)
    }

    /// Number of lines of the history, without its header, that the file lacks.
    pub(super) fn missing(&self, history: &History) -> u64 {
        if self.open.as_ref().is_some_and(|open| open.is_doubtful) {
            return history.events();
        }
        (history.events() + 1).saturating_sub(self.lines.max(1))
    }

    /// Whether all written data are flushed to the disk.
    pub(super) fn is_synced(&self) -> bool {
        self.open.as_ref().is_none_or(|open| open.unsynced.is_none() && open.syncing.is_none())
    }

    /// Checks that the file exists and is unchanged since this program's last write.
    pub(super) fn check(&mut self) -> Result<(), Trouble> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let found = match fs::metadata(&self.path) {
            Ok(found) => found,
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Err(Trouble::Removed);
            }
            Err(error) => return Err(Trouble::io(&error)),
        };
        if Identity::of(&found) != open.identity {
            return Err(Trouble::Replaced);
        }
        if found.len() != open.bytes && !open.is_torn {
            return Err(Trouble::Changed { expected: open.bytes, found: found.len() });
        }
        // A file of the same length may have other contents. Because reading a file costs more than reading its
        // metadata, it is read only if the metadata (times, permissions) have changed.
        let now = Instant::now();
        open.is_suspect |= Stamp::of(&found) != open.touched;
        let was_just_compared =
            open.compared_at.is_some_and(|at| now.saturating_duration_since(at) < COMPARE_INTERVAL);
        if open.is_suspect && !was_just_compared {
            open.compare(now)?;
            open.touched = Stamp::of(&found);
        }
        Ok(())
    }

    /// Does the same as [`SessionFile::check`], and compares the file's contents even if the metadata are unchanged.
    pub(super) fn check_all(&mut self) -> Result<(), Trouble> {
        self.check()?;
        self.open.as_mut().map_or(Ok(()), |open| open.compare(Instant::now()))
    }

    /// Writes the part of the history that the file lacks.
    pub(super) fn catch_up(&mut self, history: &History) -> Result<(), Trouble> {
        self.check()?;
        if self.open.as_ref().is_some_and(|open| open.is_doubtful) {
            return self.rewrite(history);
        }
        if self.open.is_none() {
            self.make()?;
        }
        if self.held == history.bytes() {
            return Ok(());
        }
        let Some(open) = &mut self.open else { return Ok(()) };
        open.prepare().map_err(|error| Trouble::io(&error))?;
        let mut text = history.text(self.held);
        loop {
            let piece = text.fill_buf().map_err(|error| Trouble::io(&error))?;
            if piece.is_empty() {
                return Ok(());
            }
            let (whole, result) = open.append(piece);
            self.held += whole.len() as u64;
            self.lines += whole.iter().filter(|&&byte| byte == b'\n').count() as u64;
            result.map_err(|error| Trouble::io(&error))?;
            let length = piece.len();
            text.consume(length);
        }
    }

    /// Creates the file, which must not exist.
    fn make(&mut self) -> Result<(), Trouble> {
        if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|error| Trouble::io(&error))?;
        }
        if self.lock.is_none() {
            self.lock = Some(SessionLock::take(&self.path)?);
        }
        // A link to a missing file does not count as an existing file.
        let place = match Destination::of(&self.path) {
            Ok(Destination::File(place)) => place,
            _ => self.path.clone(),
        };
        let made = File::options().read(true).write(true).create_new(true).open(place);
        let file = made.map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => Trouble::Appeared,
            _ => Trouble::io(&error),
        })?;
        lock_itself(&file, &self.path)?;
        let data = file.metadata().map_err(|error| Trouble::io(&error))?;
        self.open = Some(OpenFile::new(file, &data));
        (self.held, self.lines) = (0, 0);
        Ok(())
    }

    fn rewrite(&mut self, history: &History) -> Result<(), Trouble> {
        let place = true_path(&self.path);
        write_atomically(&place, |out| io::copy(&mut history.text(0), out).map(drop))
            .map_err(|error| Trouble::io(&error))?;
        let mut open = open_for_writing(&self.path)?;
        open.learn_contents().map_err(|error| Trouble::io(&error))?;
        // The file's new name may not be on the disk yet.
        open.note_write(Instant::now());
        self.open = Some(open);
        (self.held, self.lines) = (history.bytes(), history.events() + 1);
        Ok(())
    }

    /// Flushes the file to the disk at a pause, on a separate thread, because a disk may be slow.
    pub(super) fn sync_at_pauses(&mut self, now: Instant) -> Result<(), Trouble> {
        let Some(open) = &mut self.open else { return Ok(()) };
        open.take_synced()?;
        let is_due = open.unsynced.is_some_and(|unsynced| {
            now.saturating_duration_since(unsynced.last) >= PAUSE
                || now.saturating_duration_since(unsynced.first) >= LONGEST_UNSYNCED
        });
        if is_due && open.syncing.is_none() {
            let (sender, receiver) = channel();
            let (file, path) = (Arc::clone(&open.file), self.path.clone());
            let started = threads::in_background("sync", move || {
                // Sending fails if the session was closed meanwhile.
                let _ = sender.send(sync(&file, &path));
            });
            if started.is_ok() {
                (open.unsynced, open.syncing) = (None, Some(receiver));
            }
        }
        Ok(())
    }

    pub(super) fn sync(&mut self) -> Result<(), Trouble> {
        let Some(open) = &mut self.open else { return Ok(()) };
        if let Some(syncing) = open.syncing.take() {
            // A thread that ended without a result has flushed nothing.
            let result = syncing.recv().unwrap_or_else(|_| Err(io::Error::other(NOT_FLUSHED)));
            open.note_sync(result)?;
        }
        if open.unsynced.is_some() {
            let result = sync(&open.file, &self.path);
            open.note_sync(result)?;
            open.unsynced = None;
        }
        Ok(())
    }

    /// Closes the session regularly, so that it is no longer marked as open.
    pub(crate) fn release(mut self) {
        self.open = None;
        if let Some(lock) = self.lock.take() {
            lock.release();
        }
    }

    /// Closes the file but leaves the session marked as open, so that the next window restores it.
    pub(crate) fn leave(mut self) {
        self.open = None;
        if let Some(lock) = self.lock.take() {
            lock.leave();
        }
    }

    /// Closes the file, and removes it if no other program has changed it.
    pub(super) fn remove(mut self) {
        if self.open.is_some() && self.check().is_ok() {
            // If this fails, the unneeded file does no harm.
            let _ = fs::remove_file(&self.path);
        }
        self.release();
    }
}

impl OpenFile {
    /// An open file with complete lines only.
    fn new(file: File, data: &Metadata) -> Self {
        Self {
            file: Arc::new(file),
            identity: Identity::of(data),
            bytes: data.len(),
            whole_bytes: data.len(),
            contents: Contents::default(),
            touched: Stamp::of(data),
            is_suspect: false,
            compared_at: None,
            lacks_newline: false,
            is_torn: false,
            is_doubtful: false,
            unsynced: None,
            syncing: None,
        }
    }

    /// Reads and hashes the complete lines, to detect changes later.
    fn learn_contents(&mut self) -> io::Result<()> {
        self.touched = Stamp::of(&self.file.metadata()?);
        self.contents = Contents::read(&self.file, self.whole_bytes)?;
        self.is_suspect = false;
        Ok(())
    }

    /// Compares the complete lines with the hash of the data that were read and written.
    fn compare(&mut self, now: Instant) -> Result<(), Trouble> {
        let found = Contents::read(&self.file, self.whole_bytes).map_err(|error| Trouble::io(&error))?;
        self.is_suspect = found != self.contents;
        // A file that differs is read each time, because its contents may be restored.
        self.compared_at = (!self.is_suspect).then_some(now);
        if self.is_suspect { Err(Trouble::Overwritten) } else { Ok(()) }
    }

    /// Stores the time stamp of this program's own write.
    fn record_own_write(&mut self) {
        if let Ok(data) = self.file.metadata() {
            self.touched = Stamp::of(&data);
        }
    }

    /// Removes an incomplete line, or completes a line that lacks only its newline.
    fn prepare(&mut self) -> io::Result<()> {
        let mut file = &*self.file;
        if self.is_torn || self.bytes != self.whole_bytes {
            file.set_len(self.whole_bytes)?;
            (self.bytes, self.is_torn) = (self.whole_bytes, false);
        }
        file.seek(SeekFrom::Start(self.whole_bytes))?;
        if self.lacks_newline {
            file.write_all(b"\n")?;
            self.contents.push(b"\n");
            self.lacks_newline = false;
            self.whole_bytes += 1;
            self.bytes += 1;
        }
        self.record_own_write();
        Ok(())
    }

    /// Appends complete lines, in one write if the system can. Returns the lines that were written completely; an
    /// incomplete line is removed from the file.
    fn append<'p>(&mut self, lines: &'p [u8]) -> (&'p [u8], io::Result<()>) {
        let mut file = &*self.file;
        let mut written = 0;
        let result = loop {
            if written == lines.len() {
                break Ok(());
            }
            match file.write(&lines[written..]) {
                Ok(0) => break Err(ErrorKind::WriteZero.into()),
                Ok(count) => written += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => break Err(error),
            }
        };
        let whole = lines[..written].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        self.contents.push(&lines[..whole]);
        self.whole_bytes += whole as u64;
        self.bytes = self.whole_bytes;
        if whole < written {
            self.is_torn = file.set_len(self.whole_bytes).is_err();
        }
        self.record_own_write();
        if whole > 0 {
            self.note_write(Instant::now());
        }
        (&lines[..whole], result)
    }

    fn note_write(&mut self, now: Instant) {
        let first = self.unsynced.map_or(now, |unsynced| unsynced.first);
        self.unsynced = Some(Unsynced { first, last: now });
    }

    fn take_synced(&mut self) -> Result<(), Trouble> {
        let result = match self.syncing.as_ref().map(Receiver::try_recv) {
            Some(Ok(result)) => result,
            Some(Err(TryRecvError::Disconnected)) => Err(io::Error::other(NOT_FLUSHED)),
            Some(Err(TryRecvError::Empty)) | None => return Ok(()),
        };
        self.syncing = None;
        self.note_sync(result)
    }

    /// After a failed flush, marks the file to be written again, because the flush may have lost any part.
    fn note_sync(&mut self, result: io::Result<()>) -> Result<(), Trouble> {
        result.map_err(|error| {
            self.is_doubtful = true;
            Trouble::io(&error)
        })
    }
}

fn open_for_writing(path: &Path) -> Result<OpenFile, Trouble> {
    let open = || {
        let file = File::options().read(true).write(true).open(path)?;
        let data = file.metadata()?;
        Ok((file, data))
    };
    let (file, data) = open().map_err(|error| Trouble::io(&error))?;
    lock_itself(&file, path)?;
    Ok(OpenFile::new(file, &data))
}

/// Flushes a file's contents and its name to the disk.
fn sync(file: &File, path: &Path) -> io::Result<()> {
    match file.sync_all() {
        // Some network and virtual file systems cannot flush files. Then nothing more can be done.
        Err(error) if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {}
        result => result?,
    }
    if cfg!(unix)
        && let Some(folder) = true_path(path).parent()
        && let Ok(folder) = File::open(folder)
    {
        // Some file systems cannot flush a folder.
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Locks the session's file itself. Two paths of one file without a symbolic link (hard links, a folder mounted twice)
/// have different lock files, but the file has one lock. On systems other than Unix such a lock would exclude readers.
fn lock_itself(file: &File, path: &Path) -> Result<(), Trouble> {
    if cfg!(unix) && matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return Err(Trouble::Held(OpenElsewhere::by_somebody(path)));
    }
    Ok(())
}
