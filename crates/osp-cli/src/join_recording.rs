//! The recording of a shared session. The file is new, or it already holds the beginning of the session.

use std::{
    fs::{File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use xxhash_rust::xxh3::Xxh3Default;

use osp_session::{
    recording::{Event, Flush, Header, RecordingError, RonWriter},
    small_file::open_regular,
};

/// Number of bytes of the file that are compared at once.
const COMPARED: usize = 1 << 16;

/// Writes a session to a file that may already hold its beginning. Compares the existing bytes, and appends the others.
struct Continued {
    file: File,
    /// Whether to replace different contents of the file. If false, they are an error.
    replaces: bool,
    /// Number of bytes that the file already had.
    known: u64,
    /// Number of bytes that were compared or written.
    at: u64,
    hash: Xxh3Default,
}

impl Write for Continued {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = if self.at < self.known {
            let left = usize::try_from(self.known - self.at).unwrap_or(usize::MAX);
            let mut there = [0; COMPARED];
            let there = &mut there[..bytes.len().min(left).min(COMPARED)];
            self.file.read_exact(there)?;
            if *there != bytes[..there.len()] && self.replaces {
                self.file.set_len(self.at)?;
                self.file.seek(SeekFrom::Start(self.at))?;
                self.known = self.at;
                return self.write(bytes);
            }
            if *there != bytes[..there.len()] {
                let why = "it is not the beginning of this session; --force replaces it";
                return Err(io::Error::new(io::ErrorKind::InvalidData, why));
            }
            there.len()
        } else {
            self.file.write(bytes)?
        };
        self.hash.update(&bytes[..written]);
        self.at += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[derive(Debug)]
pub(super) struct Written {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    /// Whether the session had no events. Such a recording leaves no new file.
    pub(super) is_empty: bool,
    /// Number of bytes in the file beyond the end of the session on the server.
    pub(super) beyond: u64,
    /// 128-bit XXH3 hash of the session.
    pub(super) hash: u128,
}

/// State of a [`SharedRecording`], which does not change the file before the first event.
enum State {
    Waiting(Continued, Header),
    Writing(RonWriter<Continued>),
    /// After an error at the first event.
    Failed,
}

/// The recording of a shared session. New or continued, see the [module](self).
pub(super) struct SharedRecording {
    state: State,
    path: PathBuf,
    /// Whether the file is new and has no event.
    is_empty: bool,
}

impl SharedRecording {
    /// Opens and locks the file. Returns an error if another program writes it.
    pub(super) fn open(path: &Path, header: &Header, force: bool) -> anyhow::Result<Self> {
        let about = || path.display().to_string();
        let is_new = !path.exists();
        ensure!(
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")),
            "{}: expected a name that ends in .ron",
            path.display()
        );
        if !is_new {
            open_regular(path).with_context(about)?;
        }
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let file = file.with_context(about)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                return Err(anyhow!("{}: another program writes it", path.display()));
            }
            Err(std::fs::TryLockError::Error(error)) => return Err(error).with_context(about),
        }
        let known = file.metadata().with_context(about)?.len();
        let out = Continued { file, replaces: force, known, at: 0, hash: Xxh3Default::new() };
        let state = State::Waiting(out, header.clone());
        Ok(Self { state, path: path.to_owned(), is_empty: is_new })
    }

    pub(super) fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.is_empty = false;
        if let State::Waiting(..) = self.state
            && let State::Waiting(out, header) = std::mem::replace(&mut self.state, State::Failed)
        {
            self.state = State::Writing(RonWriter::new(out, &self.path, &header, Flush::AtEnd)?);
        }
        match &mut self.state {
            State::Writing(writer) => writer.write(event),
            State::Waiting(..) | State::Failed => Ok(()),
        }
    }

    pub(super) fn flush(&mut self) -> anyhow::Result<()> {
        if let State::Writing(writer) = &mut self.state {
            writer.flush()?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> anyhow::Result<Written> {
        self.flush()?;
        let out = match &self.state {
            State::Writing(writer) => writer.get_ref(),
            State::Waiting(out, _) => out,
            State::Failed => bail!("{}: the recording could not be begun", self.path.display()),
        };
        if out.replaces {
            // Removes the remains of another session behind the new end.
            out.file.set_len(out.at).with_context(|| self.path.display().to_string())?;
        }
        out.file.sync_data().with_context(|| self.path.display().to_string())?;
        let (is_empty, hash) = (self.is_empty, out.hash.digest128());
        let bytes = if is_empty { 0 } else { out.at };
        let beyond = if out.replaces { 0 } else { out.known.saturating_sub(out.at) };
        Ok(Written { path: self.path.clone(), bytes, is_empty, beyond, hash })
    }
}

impl Drop for SharedRecording {
    fn drop(&mut self) {
        if self.is_empty {
            // Removes a new file without events.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::Author;

    fn events(n: u32) -> Vec<Event> {
        (1..=n).map(|n| Event::Undo { t: f64::from(n), author: Author::SOLE }).collect()
    }

    fn write(path: &Path, header: &Header, force: bool, n: u32) -> anyhow::Result<Written> {
        let mut recording = SharedRecording::open(path, header, force)?;
        for event in events(n) {
            recording.write(&event)?;
        }
        recording.finish()
    }

    #[test]
    fn a_recording_is_continued_and_another_is_not_touched() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, header) = (folder.path().join("a.ron"), osp_net::live::header("a"));
        let whole = write(&path, &header, false, 100).expect("written");
        let bytes = std::fs::read(&path).expect("read");
        assert_eq!(bytes.len() as u64, whole.bytes);
        // A file that was cut off in the middle of a line is continued.
        std::fs::write(&path, &bytes[..bytes.len() / 2 + 3]).expect("written");
        let again = write(&path, &header, false, 100).expect("continued");
        assert_eq!((again.bytes, again.beyond, again.hash), (whole.bytes, 0, whole.hash));
        assert_eq!(std::fs::read(&path).expect("read"), bytes);
        // The server has fewer events than the file.
        let less = write(&path, &header, false, 40).expect("compared");
        assert_eq!(less.bytes + less.beyond, whole.bytes);
        assert_eq!(std::fs::read(&path).expect("read"), bytes);
        // The file holds another session.
        let other = osp_net::live::header("b");
        let error = format!("{:#}", write(&path, &other, false, 5).expect_err("another session"));
        assert!(error.contains("a.ron: it is not the beginning of this session"), "{error}");
        assert_eq!(std::fs::read(&path).expect("read"), bytes);
        let held = SharedRecording::open(&path, &header, false).expect("opened");
        let error = SharedRecording::open(&path, &header, true).err().expect("held").to_string();
        assert!(error.ends_with("another program writes it"), "{error}");
        drop(held);
        assert_eq!(std::fs::read(&path).expect("read"), bytes);
        // If no event comes, no file is left behind.
        let none = folder.path().join("none.ron");
        assert!(write(&none, &header, false, 0).expect("nothing").is_empty && !none.exists());
        write(&path, &other, true, 5).expect("replaced");
        assert!(SharedRecording::open(folder.path(), &header, true).is_err());
    }
}
