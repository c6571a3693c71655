use std::{
    fmt,
    io::{self, ErrorKind, Read, Seek, Write},
    path::{Path, PathBuf},
    time::Duration,
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::calendar::Moment;
use crate::threads;
use osp_session::platform::{
    self,
    fs::{self, File, Metadata, TryLockError},
};

/// Most bytes of a lock file that are read: a longer file is not ours.
const MOST_MARK_BYTES: u64 = 4096;
/// Beginning of the text in every lock file.
const WORD_START: &[u8] = b"Open(";
/// Lock files that may vanish while we open them, one after the other, before we give up.
const MOST_ATTEMPTS: u32 = 100;

/// The program that has a session open, as the lock file names it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename = "Open")]
struct Word {
    process: u32,
    host: String,
    since: String,
}

impl Word {
    fn ours() -> Self {
        Self { process: process_id(), host: host(), since: Moment::now().for_people() }
    }

    fn parse(text: &str) -> Option<Self> {
        let word: Self = ron::from_str(text.trim()).ok()?;
        // The text is shown in a terminal and in a window.
        let is_printable = |text: &str| text.len() <= 255 && !text.chars().any(char::is_control);
        (is_printable(&word.host) && is_printable(&word.since)).then_some(word)
    }

    /// Whether the process has certainly ended.
    fn is_gone(&self) -> bool {
        cfg!(target_os = "linux")
            && self.host == host()
            && Path::new("/proc/self").exists()
            && !Path::new("/proc").join(self.process.to_string()).exists()
    }
}

/// The process id of this program.
pub(super) fn process_id() -> u32 {
    if cfg!(target_arch = "wasm32") { 0 } else { std::process::id() }
}

fn host() -> String {
    platform::host_name()
}

/// A session that cannot be opened for drawing because another window has it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}: is open in another window: {}", session.display(), self.holder())]
pub struct OpenElsewhere {
    session: PathBuf,
    word: Option<Word>,
}

impl OpenElsewhere {
    /// A session that is locked itself, while its lock file is free.
    pub(super) fn by_somebody(session: &Path) -> Self {
        Self { session: session.to_owned(), word: None }
    }

    /// The session.
    pub fn session(&self) -> &Path {
        &self.session
    }

    /// The holder: process, machine, time of opening.
    pub fn holder(&self) -> impl fmt::Display + '_ {
        fmt::from_fn(|f| match &self.word {
            Some(Word { process, host, since }) => write!(f, "process {process} on {host}, since {since}"),
            None => f.write_str("under another name, or by an unknown program"),
        })
    }
}

/// Reason why a session's lock was not taken.
#[derive(Debug)]
pub(crate) enum NotTaken {
    Held(OpenElsewhere),
    /// The lock file can be neither made nor read.
    Failed(io::Error),
}

/// The right to write a session. One program has it, from opening to closing.
///
/// It is an advisory lock on a lock file beside the session, `NAME.ron.open` (the mark). The lock is not on the
/// session itself, because the session need not exist yet. Also, a program that replaces the session (by a rename)
/// would leave the lock on the old file, where no other program finds it.
///
/// The mark's name comes from the session's true name, so symbolic links to one session share it. Hard links do not;
/// therefore a session that exists is locked, too (see [`SessionFile`](super::session_file::SessionFile)). The mark
/// names the program that has the session. Closing the session on purpose removes it; after a crash it stays, without
/// its lock.
///
/// If the file system has no locks (some network shares), the mark's text counts. Then two programs that start within
/// the same instant may both take the session.
#[derive(Debug)]
pub(crate) struct SessionLock {
    /// None where the folder takes no files.
    mark: Option<Mark>,
}

#[derive(Debug)]
struct Mark {
    path: PathBuf,
    /// Holds the lock.
    file: File,
    /// Another file with the mark's name: it is locked, but neither written to nor removed.
    is_foreign: bool,
}

/// The contents of a mark.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Content {
    /// The text of the last program that held the lock, if it is whole.
    Ours(Option<Word>),
    /// Other data, which are not ours to overwrite.
    Foreign,
}

impl Content {
    fn of(file: &mut File) -> Self {
        let mut bytes = Vec::new();
        if file.rewind().is_err() || file.take(MOST_MARK_BYTES + 1).read_to_end(&mut bytes).is_err() {
            return Self::Foreign;
        }
        // After a power failure a file may exist without its contents: empty, or with zeros only.
        let is_blank = bytes.iter().all(|&byte| byte == 0);
        // A disk image begins with zeros, too.
        let is_short = bytes.len() as u64 <= MOST_MARK_BYTES;
        let is_ours = is_short && (is_blank || bytes.starts_with(WORD_START));
        match is_ours {
            true => Self::Ours(str::from_utf8(&bytes).ok().and_then(Word::parse)),
            false => Self::Foreign,
        }
    }

    fn word(self) -> Option<Word> {
        match self {
            Self::Ours(word) => word,
            Self::Foreign => None,
        }
    }
}

impl SessionLock {
    /// The mark's path: beside the file to which the name leads after all symbolic links.
    pub(crate) fn mark_of(session: &Path) -> PathBuf {
        let mut mark = true_path(session).into_os_string();
        mark.push(".open");
        PathBuf::from(mark)
    }

    /// Takes the lock of a session, which need not exist (but its folder must).
    pub(crate) fn take(session: &Path) -> Result<Self, NotTaken> {
        Self::take_or_make(session, true)
    }

    /// Takes the lock of a session that an ended program has left open. None if another program has taken it before
    /// us, or has taken and closed it since.
    pub(crate) fn take_over(session: &Path) -> Option<Self> {
        Self::take_or_make(session, false).ok().filter(|lock| lock.mark.is_some())
    }

    fn take_or_make(session: &Path, may_make: bool) -> Result<Self, NotTaken> {
        let mark = Self::mark_of(session);
        for _ in 0..MOST_ATTEMPTS {
            let mut options = File::options();
            options.create(may_make).truncate(false).read(true).write(true);
            let (mut file, is_writable) = match options.open(&mark) {
                Ok(file) => (file, true),
                Err(error) if is_forbidden(&error) => match File::open(&mark) {
                    // Another person's mark, in a folder that we may not write to.
                    Ok(file) => (file, false),
                    Err(_) => return Ok(Self { mark: None }),
                },
                Err(error) => return Err(NotTaken::Failed(error)),
            };
            if !file.metadata().is_ok_and(|data| data.is_file()) {
                let not_a_file = format!("{}: expected a file", mark.display());
                return Err(NotTaken::Failed(io::Error::other(not_a_file)));
            }
            let has_lock = match try_lock_patiently(&file) {
                Ok(()) => true,
                Err(TryLockError::WouldBlock) => {
                    let word = Content::of(&mut file).word();
                    return Err(NotTaken::Held(OpenElsewhere { session: session.to_owned(), word }));
                }
                Err(TryLockError::Error(_)) => false,
            };
            let content = Content::of(&mut file);
            let is_foreign = content == Content::Foreign;
            if !has_lock && let Some(word) = content.word().filter(|word| !word.is_gone()) {
                let word = Some(word);
                return Err(NotTaken::Held(OpenElsewhere { session: session.to_owned(), word }));
            }
            // The former holder may have removed the mark between our opening and our locking it. Then we hold a file
            // without a name, and the next program makes a new mark.
            if !is_at(&file, &mark) {
                continue;
            }
            if is_writable && !is_foreign {
                // If the mark's text cannot be written, the lock still counts.
                let _ = write_word(&mut file);
            }
            return Ok(Self { mark: Some(Mark { path: mark, file, is_foreign }) });
        }
        Err(NotTaken::Failed(io::Error::other("its mark comes and goes")))
    }

    /// Gives the lock back on purpose.
    pub(crate) fn release(self) {
        if let Some(Mark { path, file, is_foreign: false }) = self.mark
            && is_at(&file, &path)
        {
            // If the mark stays, the session is offered again: nothing is lost.
            let _ = fs::remove_file(path);
        }
    }

    /// Gives the lock back, but leaves the mark: the session counts as left open.
    pub(crate) fn leave(self) {}
}

fn is_forbidden(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem)
}

fn is_at(file: &File, path: &Path) -> bool {
    let identity = |data: io::Result<Metadata>| data.map(|data| Identity::of(&data)).ok();
    let held = identity(file.metadata());
    held.is_some() && held == identity(fs::metadata(path))
}

fn write_word(file: &mut File) -> io::Result<()> {
    let text = ron::to_string(&Word::ours()).map_err(io::Error::other)?;
    file.set_len(0)?;
    file.rewind()?;
    // The type's name marks our files; `ron` leaves it out.
    file.write_all(format!("Open{text}\n").as_bytes())
}

/// The name that a path stands for once every symbolic link is followed. The file need not exist.
pub(crate) fn true_path(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")));
        match (folder, path.file_name()) {
            (Ok(folder), Some(name)) => folder.join(name),
            _ => path.to_owned(),
        }
    })
}

/// Identity of a file, to detect another one under the same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    #[cfg(unix)]
    device_and_inode: (u64, u64),
    #[cfg(not(unix))]
    created: Option<std::time::SystemTime>,
}

impl Identity {
    #[cfg(unix)]
    pub(super) fn of(data: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self { device_and_inode: (data.dev(), data.ino()) }
    }

    #[cfg(not(unix))]
    pub(super) fn of(data: &Metadata) -> Self {
        Self { created: data.created().ok() }
    }
}

/// Locks a file. A child process shares our open files and their locks for a moment at its start. So a taken lock is
/// tried again before it is reported.
fn try_lock_patiently(file: &File) -> Result<(), TryLockError> {
    const TRIES: u32 = 10;
    const PAUSE: Duration = Duration::from_millis(10);
    for _ in 1..TRIES {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => threads::pause(PAUSE),
            outcome => return outcome,
        }
    }
    file.try_lock()
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    fn held(session: &Path) -> OpenElsewhere {
        match SessionLock::take(session) {
            Err(NotTaken::Held(held)) => held,
            other => panic!("held by another: {other:?}"),
        }
    }

    #[test]
    fn a_session_has_one_holder_whom_the_others_hear_of() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("a.ron");
        let lock = SessionLock::take(&session).expect("free");
        let said = held(&session).to_string();
        let process = format!("process {} on {}, since 20", std::process::id(), host());
        assert!(said.contains("a.ron: is open in another window") && said.contains(&process), "{said}");
        lock.release();
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0, "nothing is left");
        let lock = SessionLock::take(&session).expect("free again");
        lock.leave();
        assert!(SessionLock::mark_of(&session).exists());
        SessionLock::take(&session).expect("a mark without a lock holds nobody back").release();
    }

    #[cfg(unix)]
    #[test]
    fn links_to_a_session_share_its_lock() {
        let folder = tempfile::tempdir().expect("a folder");
        let (session, link) = (folder.path().join("a.ron"), folder.path().join("b.ron"));
        fs::write(&session, "").expect("a file");
        std::os::unix::fs::symlink(&session, &link).expect("a link");
        let lock = SessionLock::take(&link).expect("free");
        held(&session);
        lock.release();
        SessionLock::take(&session).expect("free").release();
    }

    #[test]
    fn a_mark_that_goes_while_it_is_locked_is_made_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("a.ron");
        let first = SessionLock::take(&session).expect("free");
        // Another program removes the mark.
        fs::remove_file(SessionLock::mark_of(&session)).expect("a mark");
        let second = SessionLock::take(&session).expect("a mark of its own");
        first.release();
        assert!(SessionLock::mark_of(&session).exists(), "the mark is not the first one's any more");
        held(&session);
        second.release();
    }

    #[test]
    fn of_many_that_come_at_once_one_gets_it() {
        let folder = tempfile::tempdir().expect("a folder");
        for round in 0..50 {
            let session = folder.path().join(format!("{round}.ron"));
            let start = std::sync::Barrier::new(8);
            let locks: Vec<_> = thread::scope(|scope| {
                let takers: Vec<_> = (0..8)
                    .map(|_| {
                        scope.spawn(|| {
                            start.wait();
                            SessionLock::take(&session).ok()
                        })
                    })
                    .collect();
                takers.into_iter().map(|taker| taker.join().expect("no panic")).collect()
            });
            assert_eq!(locks.iter().flatten().count(), 1, "round {round}");
        }
    }

    #[test]
    fn a_mark_may_hold_anything_and_what_is_not_ours_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("a.ron");
        let mark = SessionLock::mark_of(&session);
        for (content, is_ours) in [
            (&b""[..], true),
            (&[0; 60], true),
            (b"Open(process:1", true),
            (b"\xff\xfe", false),
            (b"Opening hours", false),
            (&[b'x'; 100_000], false),
            (&[0; 100_000], false),
        ] {
            fs::write(&mark, content).expect("a mark");
            let lock = SessionLock::take(&session).expect("free");
            assert_eq!(held(&session).to_string().contains("process"), is_ours, "who has it is said");
            lock.release();
            assert_eq!(fs::read(&mark).ok().as_deref(), (!is_ours).then_some(content));
        }
        let escapes = "Open(process:1,host:\"a\\u{1b}[31m\",since:\"b\")";
        assert!(escapes.as_bytes().starts_with(WORD_START));
        assert_eq!(Word::parse(escapes), None, "nothing of it controls a terminal");
        fs::remove_file(&mark).expect("a mark");
        fs::create_dir(&mark).expect("a folder");
        assert!(matches!(SessionLock::take(&session), Err(NotTaken::Failed(_))));
    }

    #[test]
    fn where_there_are_no_locks_a_process_that_is_gone_holds_nothing() {
        assert!(!Word::ours().is_gone());
        if cfg!(target_os = "linux") {
            assert!(Word { process: u32::MAX, ..Word::ours() }.is_gone());
        }
        assert!(!Word { process: u32::MAX, host: "elsewhere".to_owned(), ..Word::ours() }.is_gone());
    }
}
