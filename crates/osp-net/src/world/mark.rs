//! The mark of a pack that runs: a file in its folder, which the system unlocks when the process ends, however it ends.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

const MARK: &str = "packing.osp-world";

/// A mark that is set; taken away when it is dropped.
#[derive(Debug)]
pub(super) struct Mark {
    path: PathBuf,
    /// The lock is this file's.
    file: File,
}

/// Outcome of locking.
pub(super) enum Marked {
    Set(Mark),
    /// Another pack runs.
    Busy,
    /// The file system has no locks.
    Unknown,
}

impl Mark {
    pub(super) fn set(folder: &Path) -> std::io::Result<Marked> {
        let path = folder.join(MARK);
        // What one leaves behind that was killed is a file without a lock.
        let file = File::options().write(true).create(true).truncate(false).open(&path)?;
        match file.try_lock() {
            Ok(()) if is_at(&file, &path) => Ok(Marked::Set(Self { path, file })),
            // Taken away by one that ended just now: others lock the next one.
            Ok(()) | Err(TryLockError::WouldBlock) => Ok(Marked::Busy),
            Err(TryLockError::Error(_)) => {
                let _ = fs::remove_file(&path);
                Ok(Marked::Unknown)
            }
        }
    }
}

impl Drop for Mark {
    fn drop(&mut self) {
        // Before it is unlocked: whoever has opened it meanwhile finds it gone.
        let _ = fs::remove_file(&self.path);
        let _ = self.file.unlock();
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |data: &fs::Metadata| (data.dev(), data.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(a), Ok(b)) if place(&a) == place(&b))
}

/// Here a file keeps its name as long as somebody has it open.
#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists()
}
