use std::{
    fmt,
    io::{BufReader, Read},
    path::{Path, PathBuf},
    time::SystemTime,
};

use super::{
    calendar::{for_file_name, for_people},
    lock::{NotTaken, SessionLock, process_id, true_path},
    session_file::SessionFile,
};
use osp_session::{
    platform::{self, fs, user_folder},
    recording::{Header, OpenOptions, RonReader},
    small_file::open_regular,
};

/// Largest number of bytes of the original session's name in the name of a copy.
const MOST_STEM_BYTES: usize = 100;

/// Largest number of bytes that are read from an autosave file to find the session's source.
const MOST_HEADER_BYTES: u64 = 1 << 16;
/// Prefix of the header's field `source` in a session drawn with osp.
pub(crate) const OURS: &str = "osp sketch ";
/// Separator in a copy's field `source`, before the path of the original session.
const FROM: &str = ", from ";

/// The header's field `source` for a copy of a session.
pub(crate) fn source_of_copy(session: &Path, source: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!("{OURS}{version}{FROM}{}: {source}", true_path(session).display())
}

/// The origin in a copy's field `source`: the original session's path and its `source`.
fn origin(header: &Header) -> Option<&str> {
    header.source.strip_prefix(OURS)?.split_once(FROM).map(|(_, origin)| origin)
}

pub(super) fn name_of_origin(header: &Header) -> Option<String> {
    let (path, _) = origin(header)?.split_once(": ")?;
    Path::new(path).file_name().map(|name| name.to_string_lossy().into_owned())
}

/// An existing autosave file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Autosave {
    path: PathBuf,
    /// Name of the original session if the file is a copy, else the beginning of the file's own name.
    of: String,
    changed: SystemTime,
}

impl Autosave {
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Name of the original session if the file is a copy, else the beginning of the file's own name.
    pub fn of(&self) -> &str {
        &self.of
    }

    /// Time of the last change, as text.
    pub fn time(&self) -> String {
        for_people(self.changed)
    }
}

impl fmt::Display for Autosave {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.of, self.time())
    }
}

/// The folder of autosave files, which contain unnamed sessions.
#[derive(Clone, Debug)]
pub struct Autosaves {
    folder: PathBuf,
}

impl Autosaves {
    /// The autosave files in `folder`; `None` means the user's data folder.
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder: folder.unwrap_or_else(default_folder) }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A new file with an unused name. The first event creates it.
    pub(super) fn new_file(&self, stem: &str) -> SessionFile {
        // Without a folder no lock can be taken; the first event then reports the reason.
        let _ = fs::create_dir_all(&self.folder);
        let stamp = for_file_name(platform::time::now());
        let stem = shortened(stem);
        for number in 1..1000 {
            let name = if number == 1 {
                format!("{stem}-{stamp}.ron")
            } else {
                format!("{stem}-{stamp}-{number}.ron")
            };
            let path = self.folder.join(name);
            if fs::is_there(&path) || fs::is_there(&SessionLock::path_of(&path)) {
                continue;
            }
            match SessionLock::take(&path) {
                // Another window may have taken the name, drawn and closed in the meantime.
                Ok(lock) if fs::is_there(&path) => lock.leave(),
                Ok(lock) => return SessionFile::new(path, Some(lock)),
                Err(NotTaken::Held(_)) => {}
                Err(NotTaken::Failed(_)) => break,
            }
        }
        SessionFile::new(self.folder.join(format!("{stem}-{stamp}-{}.ron", process_id())), None)
    }

    /// Whether a file is an autosave file, judged by its folder and its name.
    pub(crate) fn has(&self, path: &Path) -> bool {
        name_without_time(path).is_some()
            && true_path(path).parent().is_some_and(|folder| folder == true_path(&self.folder))
    }

    /// All non-empty autosave files, newest first. Their names lack the time.
    fn files(&self) -> Vec<Autosave> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let found = entries.flatten().filter_map(|entry| {
            let path = entry.path();
            let data = fs::metadata(&path).ok().filter(|data| data.is_file() && data.len() > 0)?;
            let of = name_without_time(&path)?;
            Some(Autosave { path, of, changed: data.modified().unwrap_or(SystemTime::UNIX_EPOCH) })
        });
        let mut found: Vec<Autosave> = found.collect();
        found.sort_unstable_by(|a, b| (b.changed, &b.path).cmp(&(a.changed, &a.path)));
        found
    }

    /// At most `most` autosave files, newest first. A file whose header cannot be read is listed by its file name.
    pub fn last(&self, most: usize) -> Vec<Autosave> {
        let mut found = self.files();
        found.truncate(most);
        for autosave in &mut found {
            let header = read_header(&autosave.path);
            if let Some(name) = header.as_ref().and_then(name_of_origin) {
                autosave.of = name;
            }
        }
        found
    }

    /// The newest copy of this session. A copy exists only if the user edited it.
    pub(crate) fn edits_of(&self, session: &Path) -> Option<Autosave> {
        let stem = session.file_stem().unwrap_or_default().to_string_lossy();
        let from = format!("{}: ", true_path(session).display());
        let mut found = self.files().into_iter().filter(|autosave| autosave.of == shortened(&stem));
        let edits = found.find(|autosave| {
            let header = read_header(&autosave.path);
            header.is_some_and(|header| origin(&header).is_some_and(|origin| origin.starts_with(&from)))
        })?;
        let of = session.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Some(Autosave { of, ..edits })
    }

    /// The sessions that are marked as open, the newest first. Their programs have crashed, or still have them open.
    pub(crate) fn marked(&self) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut found: Vec<(SystemTime, PathBuf)> = Vec::new();
        for lock_file in entries.flatten().map(|entry| entry.path()) {
            if lock_file.extension().is_none_or(|ending| ending != "open") {
                continue;
            }
            let session = lock_file.with_extension("");
            match fs::metadata(&session) {
                Ok(data) if data.len() > 0 => {
                    found.push((data.modified().unwrap_or(SystemTime::UNIX_EPOCH), session));
                }
                // The session has no events, only a lock file, which is removed if its program has ended.
                _ => {
                    if let Some(lock) = SessionLock::take_over(&session) {
                        release_if_empty(lock, &session);
                    }
                }
            }
        }
        found.sort_unstable_by(|a, b| b.cmp(a));
        found.into_iter().map(|(_, session)| session).collect()
    }
}

/// Releases the lock if the session's file is empty. Since the caller's check, another program may have drawn a first
/// stroke.
fn release_if_empty(lock: SessionLock, session: &Path) {
    match fs::metadata(session) {
        Ok(data) if data.len() > 0 => lock.leave(),
        _ => lock.release(),
    }
}

/// The beginning of a name, short enough for any file system, even with the time and a lock file's ending appended.
fn shortened(stem: &str) -> &str {
    &stem[..stem.floor_char_boundary(MOST_STEM_BYTES)]
}

/// The name of an autosave file without its time, number and ending.
fn name_without_time(path: &Path) -> Option<String> {
    let is_ron = path.extension().is_some_and(|ending| ending == "ron");
    let name = path.file_stem().filter(|_| is_ron)?.to_string_lossy();
    unstamped(&name).map(str::to_owned)
}

fn unstamped(name: &str) -> Option<&str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let without_time = |name: &str| {
        let at = name.len().checked_sub("-20260131-235959".len())?;
        let mut parts = name.get(at..)?.split('-').skip(1);
        let is_time = parts.all(is_number) && name.as_bytes()[at] == b'-' && name.as_bytes()[at + 9] == b'-';
        is_time.then_some(at)
    };
    let of_numbered = || {
        let (name, number) = name.rsplit_once('-')?;
        if is_number(number) { without_time(name) } else { None }
    };
    without_time(name).or_else(of_numbered).map(|at| &name[..at])
}

fn read_header(path: &Path) -> Option<Header> {
    let file = open_regular(path).ok()?.take(MOST_HEADER_BYTES);
    let reader = RonReader::new(BufReader::new(file), path, OpenOptions::default()).ok()?;
    Some(reader.header().clone())
}

fn default_folder() -> PathBuf {
    user_folder("XDG_DATA_HOME", ".local/share/osp").join("sketches")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_an_autosave_has_a_time_and_perhaps_a_number() {
        let name = |name| unstamped(name);
        assert_eq!(name("sketch-20261124-172500"), Some("sketch"));
        assert_eq!(name("a-b 1-20261124-172500-2"), Some("a-b 1"));
        assert_eq!(name("-20261124-172500"), Some(""));
        assert_eq!(name("\u{e4}-20261124-172500-31337"), Some("\u{e4}"));
        let others = [
            "",
            "mine",
            "20261124-172500",
            "a-20261124_172500",
            "a-2026112-1725000",
            "a-20261124-17250x",
            "a-20261124-172500-",
            "a-20261124-172500-x",
            "\u{20ac}\u{20ac}\u{20ac}\u{20ac}\u{20ac}\u{20ac}",
        ];
        assert_eq!(others.map(name), [None; 9]);
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let file = autosaves.new_file("a.b");
        assert!(autosaves.has(file.path()));
        assert!(!autosaves.has(&folder.path().join("mine.ron")));
        assert!(!autosaves.has(&folder.path().join("in/a-20261124-172500.ron")));
        file.release();
    }
}
