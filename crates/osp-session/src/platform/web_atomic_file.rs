//! Outputs on a web page. As on a disk, an output appears complete or not at all. The browser offers every file outside
//! the program's own folder for download.
#![allow(missing_debug_implementations, reason = "as in what it stands for")]

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use crate::platform::{USER_FOLDER, fs};

/// Files that the browser should save.
static DOWNLOADS: Mutex<Vec<(PathBuf, Vec<u8>)>> = Mutex::new(Vec::new());

/// Files for download that were written since the last call.
pub fn take_downloads() -> Vec<(PathBuf, Vec<u8>)> {
    std::mem::take(&mut DOWNLOADS.lock().unwrap_or_else(PoisonError::into_inner))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    File(PathBuf),
    Special(PathBuf),
    StandardOutput,
    StandardError,
}

impl Destination {
    pub fn of(path: &Path) -> io::Result<Self> {
        if path.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(io::Error::new(io::ErrorKind::InvalidFilename, "expected the name of a file"));
        }
        Ok(Self::File(path.to_owned()))
    }
}

#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl AtomicFile {
    pub fn create(path: &Path) -> io::Result<Self> {
        Destination::of(path)?;
        Ok(Self { path: path.to_owned(), bytes: Vec::new() })
    }

    /// Always an error, because no file exists before the commit.
    pub fn handle(&mut self) -> io::Result<fs::File> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub fn commit(self) -> io::Result<Option<u64>> {
        let bytes = self.bytes.len() as u64;
        if !self.path.starts_with(USER_FOLDER) {
            let mut downloads = DOWNLOADS.lock().unwrap_or_else(PoisonError::into_inner);
            downloads.push((self.path.clone(), self.bytes.clone()));
        }
        fs::write(&self.path, self.bytes);
        Ok(Some(bytes))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file)?;
    file.commit().map(drop)
}

pub fn open_stream(path: &Path) -> io::Result<fs::File> {
    fs::File::create(path)
}
