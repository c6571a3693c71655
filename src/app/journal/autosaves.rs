use std::{
    path::{Path, PathBuf},
    time::SystemTime,
};

use super::{
    calendar::Moment,
    lock::{NotTaken, SessionLock},
    session_file::SessionFile,
};
use crate::platform::{self, fs, user_folder};

/// Bytes of another session's name that the name of a copy begins with.
const MOST_STEM_BYTES: usize = 100;

/// Autosave files: sessions without a name, in a folder of their own.
#[derive(Clone, Debug)]
pub struct Autosaves {
    folder: PathBuf,
}

impl Autosaves {
    /// The folder; `None` is the user's own data folder.
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder: folder.unwrap_or_else(default_folder) }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A new file with an unused name. It is made with the first event.
    pub(super) fn new_file(&self, stem: &str) -> SessionFile {
        // Without a folder the lock cannot be taken; the file says why when the first event comes.
        let _ = fs::create_dir_all(&self.folder);
        let stamp = Moment::now().for_file_name();
        let stem = shortened(stem);
        for number in 1..1000 {
            let name = if number == 1 {
                format!("{stem}-{stamp}.ron")
            } else {
                format!("{stem}-{stamp}-{number}.ron")
            };
            let path = self.folder.join(name);
            if fs::is_there(&path) || fs::is_there(&SessionLock::mark_of(&path)) {
                continue;
            }
            match SessionLock::take(&path) {
                // Another window may have had it, drawn and gone in the meantime.
                Ok(lock) if fs::is_there(&path) => lock.leave(),
                Ok(lock) => return SessionFile::new(path, Some(lock)),
                Err(NotTaken::Held(_)) => {}
                Err(NotTaken::Failed(_)) => break,
            }
        }
        SessionFile::new(self.folder.join(format!("{stem}-{stamp}-{}.ron", platform::process_id())), None)
    }

    /// The sessions that were left open, the newest first: by programs that are gone, or that live and have them.
    pub(in crate::app) fn marked(&self) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut found: Vec<(SystemTime, PathBuf)> = Vec::new();
        for mark in entries.flatten().map(|entry| entry.path()) {
            if mark.extension().is_none_or(|ending| ending != "open") {
                continue;
            }
            let session = mark.with_extension("");
            match fs::metadata(&session) {
                Ok(data) if data.len() > 0 => {
                    found.push((data.modified().unwrap_or(SystemTime::UNIX_EPOCH), session));
                }
                // Nothing was drawn, so there is only the mark. It is removed if its program has ended.
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

/// Its program may have drawn its first stroke and died since we looked.
fn release_if_empty(lock: SessionLock, session: &Path) {
    match fs::metadata(session) {
        Ok(data) if data.len() > 0 => lock.leave(),
        _ => lock.release(),
    }
}

/// The beginning of a name, so that with the time behind it and a mark's ending it is not too long for any disk.
fn shortened(stem: &str) -> &str {
    &stem[..stem.floor_char_boundary(MOST_STEM_BYTES)]
}

fn default_folder() -> PathBuf {
    user_folder("XDG_DATA_HOME", ".local/share/osp").join("sketches")
}
