//! What is kept of each session that was measured: one file of JSON a session, in a folder of their own.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::StudyRow;
use osp_session::{atomic_file::write_atomically, small_file};

/// The file that says what the folder is: no sessions are looked for in it.
const MARK: &str = "osp-study.txt";
const MARK_TEXT: &str = "Sessions that `osp study` has measured, a file each: its name is a hash of the session, the options\n\
    and the build of osp. `osp study` with the same options goes on from here; `osp study merge` makes a table of them.\n";
/// Ending of the files of sessions.
const ENDING: &str = "json";
/// Largest file of a session that is read: that of thousands of indexes.
const MOST_BYTES: u64 = 16 << 20;
/// The form of these files.
const FORM: u32 = 1;

/// A session that was measured: a row for each index, or one with its error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPart {
    /// The form of the file.
    study: u32,
    /// The rows.
    pub rows: Vec<StudyRow>,
}

/// A part that cannot be used.
#[derive(Debug, Error)]
pub enum PartError {
    /// It cannot be read or written.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// It is a folder, a pipe or a device: neither read nor written to.
    #[error("{}: expected a regular file, in which `osp study` keeps a session; found {found}", path.display())]
    NoFile {
        /// What is there.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// It is something else.
    #[error("{}: expected a session as `osp study` keeps it; {cause}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        cause: String,
    },
}

impl StudyPart {
    /// The part with these rows.
    pub fn new(rows: Vec<StudyRow>) -> Self {
        Self { study: FORM, rows }
    }

    fn read(path: &Path) -> Result<Self, PartError> {
        let other = |cause: String| PartError::Other { path: path.to_owned(), cause };
        let text = small_file::read_text(path, MOST_BYTES)
            .map_err(|cause| PartError::Io { path: path.to_owned(), cause })?;
        let part: Self = serde_json::from_str(&text).map_err(|error| other(error.to_string()))?;
        match part.study {
            FORM => Ok(part),
            form => Err(other(format!("found form {form}, not {FORM}"))),
        }
    }
}

/// The folder of the parts.
#[derive(Clone, Debug)]
pub struct WorkFolder(PathBuf);

impl WorkFolder {
    /// Makes the folder if there is none. A folder with other files in it is not taken: they might be taken for parts.
    ///
    /// # Errors
    /// It cannot be made or written to, or holds something else.
    pub fn create(path: &Path) -> Result<Self, PartError> {
        let io = |cause| PartError::Io { path: path.to_owned(), cause };
        let mark = path.join(MARK);
        if !mark.is_file() {
            check_place(&mark)?;
            fs::create_dir_all(path).map_err(io)?;
            // Another process may begin at the same time: its mark is no stranger.
            let is_strange = |name: &str| name != MARK && !name.starts_with(".unfinished-");
            for entry in fs::read_dir(path).map_err(io)? {
                let name = entry.map_err(io)?.file_name();
                // Unless another process has begun meanwhile.
                if is_strange(&name.to_string_lossy()) && !mark.is_file() {
                    let found =
                        format!("expected an empty folder, or one of `osp study`; found {}", name.display());
                    return Err(io(io::Error::other(found)));
                }
            }
            write_atomically(&mark, |out| out.write_all(MARK_TEXT.as_bytes())).map_err(io)?;
        }
        Ok(Self(path.to_owned()))
    }

    /// The folder, if it is one of parts.
    ///
    /// # Errors
    /// It is not.
    pub fn open(path: &Path) -> Result<Self, PartError> {
        match Self::is_one(path) {
            true => Ok(Self(path.to_owned())),
            false => Err(PartError::Other {
                path: path.to_owned(),
                cause: format!("found a folder without {MARK}"),
            }),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Whether a folder is one of parts.
    pub fn is_one(path: &Path) -> bool {
        path.join(MARK).is_file()
    }

    /// The name of the part of a session: by the hash of its contents, how it was measured, and the build of osp.
    pub fn name_of(file_hash: &str, options: &str, build: &str) -> String {
        let key = xxhash_rust::xxh3::xxh3_128(format!("{file_hash}\n{options}\n{build}").as_bytes());
        format!("{key:032x}.{ENDING}")
    }

    /// The part of this name; `None` if there is none.
    ///
    /// # Errors
    /// It cannot be read, or is no regular file.
    pub fn part(&self, name: &str) -> Result<Option<StudyPart>, PartError> {
        check_place(&self.0.join(name))?;
        match StudyPart::read(&self.0.join(name)) {
            Err(PartError::Io { cause, .. }) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
            part => part.map(Some),
        }
    }

    /// Keeps a part: the file is whole or not there.
    ///
    /// # Errors
    /// It cannot be written, or there is something else than a regular file.
    pub fn keep(&self, name: &str, part: &StudyPart) -> Result<(), PartError> {
        let path = self.0.join(name);
        check_place(&path)?;
        let write = || {
            let text = serde_json::to_string(part).map_err(io::Error::other)?;
            write_atomically(&path, |out| writeln!(out, "{text}"))
        };
        write().map_err(|cause| PartError::Io { path: path.clone(), cause })
    }

    /// All parts, sorted by name; memory holds one at a time.
    ///
    /// # Errors
    /// The folder cannot be listed.
    pub fn parts(&self) -> Result<impl Iterator<Item = Result<StudyPart, PartError>>, PartError> {
        let io = |cause| PartError::Io { path: self.0.clone(), cause };
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.0).map_err(io)? {
            let path = entry.map_err(io)?.path();
            let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
            if !is_hidden && path.extension().is_some_and(|ending| ending == ENDING) {
                names.push(path);
            }
        }
        names.sort();
        Ok(names.into_iter().map(|path| StudyPart::read(&path)))
    }
}

/// Whether a file is there, or may be written: a pipe would wait for a reader, a device take everything.
fn check_place(path: &Path) -> Result<(), PartError> {
    let found = match fs::metadata(path) {
        Ok(data) if data.is_dir() => "a folder",
        Ok(data) if !data.is_file() => "a pipe or a device",
        // That it cannot be looked at shows when it is read or written.
        _ => return Ok(()),
    };
    Err(PartError::NoFile { path: path.to_owned(), found })
}
