//! Files for a target: in a folder of their own for each thread.

use std::{
    fs,
    path::{Path, PathBuf},
};

thread_local! {
    /// In memory where the system has such a place: a target writes thousands of files a second.
    static FOLDER: tempfile::TempDir = tempfile::tempdir_in("/dev/shm")
        .or_else(|_| tempfile::tempdir())
        .expect("a folder for temporary files");
}

/// A file of this thread's folder, with these bytes.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = path(name);
    fs::write(&path, bytes).expect("a file can be written");
    path
}

/// The path of a file of this thread's folder.
pub fn path(name: &str) -> PathBuf {
    let path = FOLDER.with(|folder| folder.path().join(name));
    fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).expect("a folder can be made");
    path
}
