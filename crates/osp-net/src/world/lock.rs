//! The lock of a running pack: a locked file in the folder. The system unlocks it when the process ends in any way.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use osp_session::platform::fs::is_at;

const LOCK_FILE: &str = "packing.osp-world";

/// The lock of a folder; dropping it removes the file.
#[derive(Debug)]
pub(super) struct PackLock {
    path: PathBuf,
    /// The locked file.
    file: File,
}

/// The outcome of locking a folder.
pub(super) enum Locked {
    Taken(PackLock),
    /// Another pack runs.
    Busy,
    /// The file system has no locks.
    Unknown,
}

impl PackLock {
    pub(super) fn take(folder: &Path) -> std::io::Result<Locked> {
        let path = folder.join(LOCK_FILE);
        // A killed pack leaves a file without a lock.
        let file = File::options().write(true).create(true).truncate(false).open(&path)?;
        match file.try_lock() {
            Ok(()) if is_at(&file, &path) => Ok(Locked::Taken(Self { path, file })),
            // A pack that has just ended may have removed this file. Its lock would not exclude packs that create a new
            // file.
            Ok(()) | Err(TryLockError::WouldBlock) => Ok(Locked::Busy),
            Err(TryLockError::Error(_)) => {
                let _ = fs::remove_file(&path);
                Ok(Locked::Unknown)
            }
        }
    }
}

impl Drop for PackLock {
    fn drop(&mut self) {
        // The file is removed before it is unlocked, so that a process that has opened it meanwhile finds it removed.
        let _ = fs::remove_file(&self.path);
        let _ = self.file.unlock();
    }
}
