use std::{
    fmt,
    io::{self, ErrorKind, Read, Seek, Write},
    path::{Path, PathBuf},
    time::Duration,
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::calendar::for_people;
use crate::threads;
use osp_session::platform::{
    self,
    fs::{self, File, TryLockError, is_at, whole_path},
};

/// Largest lock file that is read, bytes; a longer file is not a lock file of osp.
const MOST_LOCK_BYTES: u64 = 4096;
/// Beginning of the text in every lock file.
const LOCK_TEXT_START: &[u8] = b"Open(";
/// Largest number of attempts to lock a lock file that other programs remove at the same time.
const MOST_ATTEMPTS: u32 = 100;

/// The program that has a session open, as stored in the lock file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename = "Open")]
struct LockOwner {
    process: u32,
    host: String,
    since: String,
}

impl LockOwner {
    fn ours() -> Self {
        Self { process: process_id(), host: host(), since: for_people(platform::time::now()) }
    }

    fn parse(text: &str) -> Option<Self> {
        let owner: Self = ron::from_str(text.trim()).ok()?;
        // Control characters are rejected, because the text is shown in a terminal and in a window.
        let is_printable = |text: &str| text.len() <= 255 && !text.chars().any(char::is_control);
        (is_printable(&owner.host) && is_printable(&owner.since)).then_some(owner)
    }

    /// Whether the process has certainly ended.
    fn is_gone(&self) -> bool {
        cfg!(target_os = "linux")
            && self.host == host()
            && Path::new("/proc/self").exists()
            && !Path::new("/proc").join(self.process.to_string()).exists()
    }
}

pub(super) fn process_id() -> u32 {
    if cfg!(target_arch = "wasm32") { 0 } else { std::process::id() }
}

fn host() -> String {
    platform::host_name()
}

/// The error of a session that cannot be opened for drawing because another window has it open.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}: is open in another window: {}", session.display(), self.holder())]
pub struct OpenElsewhere {
    session: PathBuf,
    owner: Option<LockOwner>,
}

impl OpenElsewhere {
    /// The error if another program has locked the session's own file, although the lock file is free.
    pub(super) fn by_somebody(session: &Path) -> Self {
        Self { session: session.to_owned(), owner: None }
    }

    pub fn session(&self) -> &Path {
        &self.session
    }

    /// The holder of the lock: process, machine, time of opening.
    pub fn holder(&self) -> impl fmt::Display + '_ {
        fmt::from_fn(|f| match &self.owner {
            Some(LockOwner { process, host, since }) => {
                write!(f, "process {process} on {host}, since {since}")
            }
            None => f.write_str("another program has it, perhaps under another file name"),
        })
    }
}

#[derive(Debug)]
pub(crate) enum NotTaken {
    Held(OpenElsewhere),
    /// The lock file can be neither created nor read.
    Failed(io::Error),
}

/// The right to write a session. One program has this right while the session is open.
///
/// It is an advisory lock on a lock file beside the session, `NAME.ron.open`. The session itself is not
/// locked, because it need not exist yet. Also, a program that replaces the session (by a rename) would leave the lock
/// on the old file, which no other program opens.
///
/// The lock file's name is derived from the session's canonical path, so symbolic links to one session share a lock
/// file. Hard links have separate lock files; therefore the file of an existing session is locked, too (see
/// [`SessionFile`](super::session_file::SessionFile)). The lock file contains the number of the process that has the
/// session. A regular closing of the session removes the lock file; after a crash it stays, but unlocked.
///
/// If the file system has no locks (some network shares), the process in the lock file's text counts as the owner. In
/// this case two programs that start at the same instant may both take the session.
#[derive(Debug)]
pub(crate) struct SessionLock {
    /// `None` if no file can be created in the folder.
    lock_file: Option<LockFile>,
}

#[derive(Debug)]
struct LockFile {
    path: PathBuf,
    file: File,
    /// Whether another program's file has the lock file's name. Such a file is locked, but neither written nor removed.
    is_foreign: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Content {
    /// The text of the last holder of the lock, if it is complete.
    Ours(Option<LockOwner>),
    /// Data of another program, which must not be overwritten.
    Foreign,
}

impl Content {
    fn of(file: &mut File) -> Self {
        let mut bytes = Vec::new();
        if file.rewind().is_err() || file.take(MOST_LOCK_BYTES + 1).read_to_end(&mut bytes).is_err() {
            return Self::Foreign;
        }
        // After a power failure a file may exist without its contents: empty, or with zeros only.
        let is_blank = bytes.iter().all(|&byte| byte == 0);
        // A disk image begins with zeros, too.
        let is_short = bytes.len() as u64 <= MOST_LOCK_BYTES;
        let is_ours = is_short && (is_blank || bytes.starts_with(LOCK_TEXT_START));
        match is_ours {
            true => Self::Ours(str::from_utf8(&bytes).ok().and_then(LockOwner::parse)),
            false => Self::Foreign,
        }
    }

    fn owner(self) -> Option<LockOwner> {
        match self {
            Self::Ours(owner) => owner,
            Self::Foreign => None,
        }
    }
}

impl SessionLock {
    /// The path of a session's lock file, beside the session's file after all symbolic links are resolved.
    pub(crate) fn path_of(session: &Path) -> PathBuf {
        let mut lock_file = true_path(session).into_os_string();
        lock_file.push(".open");
        PathBuf::from(lock_file)
    }

    /// Takes the lock of a session. The session need not exist, but its folder must.
    pub(crate) fn take(session: &Path) -> Result<Self, NotTaken> {
        Self::take_or_make(session, true)
    }

    /// Takes the lock of a session that an ended program has left open. `None` if another program has taken the lock,
    /// or has taken and released it since.
    pub(crate) fn take_over(session: &Path) -> Option<Self> {
        Self::take_or_make(session, false).ok().filter(|lock| lock.lock_file.is_some())
    }

    fn take_or_make(session: &Path, may_make: bool) -> Result<Self, NotTaken> {
        let lock_file = Self::path_of(session);
        for _ in 0..MOST_ATTEMPTS {
            let mut options = File::options();
            options.create(may_make).truncate(false).read(true).write(true);
            let (mut file, is_writable) = match options.open(&lock_file) {
                Ok(file) => (file, true),
                Err(error) if is_forbidden(&error) => match File::open(&lock_file) {
                    // The lock file belongs to another user, in a folder without write permission.
                    Ok(file) => (file, false),
                    Err(_) => return Ok(Self { lock_file: None }),
                },
                Err(error) => return Err(NotTaken::Failed(error)),
            };
            if !file.metadata().is_ok_and(|data| data.is_file()) {
                let not_a_file = format!("{}: expected a file", lock_file.display());
                return Err(NotTaken::Failed(io::Error::other(not_a_file)));
            }
            let has_lock = match try_lock_patiently(&file) {
                Ok(()) => true,
                Err(TryLockError::WouldBlock) => {
                    let owner = Content::of(&mut file).owner();
                    return Err(NotTaken::Held(OpenElsewhere { session: session.to_owned(), owner }));
                }
                Err(TryLockError::Error(_)) => false,
            };
            let content = Content::of(&mut file);
            let is_foreign = content == Content::Foreign;
            if !has_lock && let Some(owner) = content.owner().filter(|owner| !owner.is_gone()) {
                let owner = Some(owner);
                return Err(NotTaken::Held(OpenElsewhere { session: session.to_owned(), owner }));
            }
            // The former holder may have removed the lock file between the opening and the locking. The locked file
            // then has no name, and the next program would create a new lock file.
            if !is_at(&file, &lock_file) {
                continue;
            }
            if is_writable && !is_foreign {
                // If the lock file's text cannot be written, the lock is still valid.
                let _ = write_lock_text(&mut file);
            }
            return Ok(Self { lock_file: Some(LockFile { path: lock_file, file, is_foreign }) });
        }
        Err(NotTaken::Failed(io::Error::other(
            "another program creates and removes its lock file again and again",
        )))
    }

    pub(crate) fn release(self) {
        if let Some(LockFile { path, file, is_foreign: false }) = self.lock_file
            && is_at(&file, &path)
        {
            // If the lock file stays, the session is offered for restoring; no data are lost.
            let _ = fs::remove_file(path);
        }
    }

    /// Releases the lock but leaves the lock file, so that the session counts as left open.
    pub(crate) fn leave(self) {}
}

fn is_forbidden(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem)
}

fn write_lock_text(file: &mut File) -> io::Result<()> {
    let text = ron::to_string(&LockOwner::ours()).map_err(io::Error::other)?;
    file.set_len(0)?;
    file.rewind()?;
    // The type's name identifies the lock file; `ron` omits it, so it is written here.
    file.write_all(format!("Open{text}\n").as_bytes())
}

/// The canonical path, with every symbolic link resolved. The file need not exist.
pub(crate) fn true_path(path: &Path) -> PathBuf {
    whole_path(path).unwrap_or_else(|| path.to_owned())
}

/// Locks a file. A failed attempt is repeated, because a child process shares open files and their locks for a moment
/// at its start.
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
        assert!(SessionLock::path_of(&session).exists());
        SessionLock::take(&session).expect("a lock file without a lock holds nobody back").release();
    }

    #[test]
    fn a_mark_that_goes_while_it_is_locked_is_made_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("a.ron");
        let first = SessionLock::take(&session).expect("free");
        // Another program removes the lock file.
        fs::remove_file(SessionLock::path_of(&session)).expect("a lock file");
        let second = SessionLock::take(&session).expect("a lock file of its own");
        first.release();
        assert!(SessionLock::path_of(&session).exists(), "the lock file is not the first one's any more");
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
        let lock_file = SessionLock::path_of(&session);
        for (content, is_ours) in [
            (&b""[..], true),
            (&[0; 60], true),
            (b"Open(process:1", true),
            (b"\xff\xfe", false),
            (b"Opening hours", false),
            (&[b'x'; 100_000], false),
            (&[0; 100_000], false),
        ] {
            fs::write(&lock_file, content).expect("a lock file");
            let lock = SessionLock::take(&session).expect("free");
            assert_eq!(
                held(&session).to_string().contains("process"),
                is_ours,
                "the message names the program that has locked the file"
            );
            lock.release();
            assert_eq!(fs::read(&lock_file).ok().as_deref(), (!is_ours).then_some(content));
        }
        let escapes = "Open(process:1,host:\"a\\u{1b}[31m\",since:\"b\")";
        assert!(escapes.as_bytes().starts_with(LOCK_TEXT_START));
        assert_eq!(LockOwner::parse(escapes), None, "nothing of it controls a terminal");
        fs::remove_file(&lock_file).expect("a lock file");
        fs::create_dir(&lock_file).expect("a folder");
        assert!(matches!(SessionLock::take(&session), Err(NotTaken::Failed(_))));
    }

    #[test]
    fn where_there_are_no_locks_a_process_that_is_gone_holds_nothing() {
        assert!(!LockOwner::ours().is_gone());
        if cfg!(target_os = "linux") {
            assert!(LockOwner { process: u32::MAX, ..LockOwner::ours() }.is_gone());
        }
        assert!(
            !LockOwner { process: u32::MAX, host: "elsewhere".to_owned(), ..LockOwner::ours() }.is_gone()
        );
    }
}
