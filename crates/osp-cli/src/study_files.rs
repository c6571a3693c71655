//! The sessions of a study: which they are, and what is in them.

use std::{
    collections::BTreeMap,
    fs, io,
    io::Read,
    path::{Path, PathBuf},
};

use anyhow::Context;
use walkdir::WalkDir;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::verify_all::{Part, name_in, sessions};
use osp_session::recording::import::files_beside;

/// Bytes read at once.
const CHUNK: usize = 1 << 20;

/// A session that is to be measured.
#[derive(Clone, Debug)]
pub(super) struct StudyFile {
    pub(super) path: PathBuf,
    /// What the rows call it.
    pub(super) name: String,
    pub(super) contents: Contents,
}

/// What is in the files of a session.
#[derive(Clone, Debug)]
pub(super) struct Contents {
    pub(super) bytes: u64,
    /// 32 hexadecimal digits, or why the files cannot be read.
    pub(super) hash: Result<String, String>,
}

/// The sessions that are named and those of folders, before anything is read of them.
pub(super) fn study_files(paths: &[PathBuf]) -> anyhow::Result<Vec<StudyFile>> {
    for path in paths {
        // A name that is mistyped is no damaged session.
        fs::metadata(path).with_context(|| path.display().to_string())?;
    }
    let named = |path: PathBuf| {
        let name = name_in(paths, &path);
        let name = if cfg!(windows) { name.replace('\\', "/") } else { name };
        StudyFile { path, name, contents: Contents::NOT_READ }
    };
    Ok(sessions(paths, Part::WHOLE)?.into_iter().map(named).collect())
}

impl Contents {
    const NOT_READ: Self = Self { bytes: 0, hash: Err(String::new()) };

    /// Reads all files of a session. Of a session that is one file the hash is that of the file; of several, that of a list
    /// of their names and hashes.
    pub(super) fn of(session: &Path) -> Self {
        let mut bytes = 0;
        let mut hashes = || {
            let mut hashes = BTreeMap::new();
            for (label, path) in files_of(session)? {
                let (hash, length) = hash_of(&path)?;
                bytes += length;
                hashes.insert(label, hash);
            }
            Ok(hashes)
        };
        let hash = match hashes() {
            Ok(hashes) => Ok(one_hash(&hashes)),
            Err(error) => {
                let error: io::Error = error;
                Err(format!("{}: {error}", session.display()))
            }
        };
        Self { bytes, hash }
    }

    /// Whether the session belongs to a shard. What has no hash goes by its name.
    pub(super) fn is_in(&self, shard: Part, name: &str) -> bool {
        let number = match &self.hash {
            Ok(hash) => u128::from_str_radix(hash, 16).unwrap_or(0),
            Err(_) => xxh3_128(name.as_bytes()),
        };
        shard.holds_hash(number)
    }
}

fn one_hash(hashes: &BTreeMap<String, u128>) -> String {
    let list = || hashes.iter().map(|(label, hash)| format!("{label}\t{hash:032x}\n")).collect::<String>();
    let hash = match hashes.len() {
        1 => hashes.values().copied().next().unwrap_or(0),
        _ => xxh3_128(list().as_bytes()),
    };
    format!("{hash:032x}")
}

/// The files that a session is read from, each with a name that does not depend on where they lie.
fn files_of(session: &Path) -> io::Result<BTreeMap<String, PathBuf>> {
    let mut files = BTreeMap::new();
    if session.is_dir() {
        for entry in WalkDir::new(session) {
            let entry = entry.map_err(io::Error::from)?;
            if entry.file_type().is_file() {
                let below = entry.path().strip_prefix(session).unwrap_or(entry.path());
                files.insert(below.to_string_lossy().replace('\\', "/"), entry.into_path());
            }
        }
        return Ok(files);
    }
    let label = |path: &Path| {
        // CASSIE's two files have one name, in two folders.
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
        format!("{}/{}", folder.display(), path.file_name().unwrap_or_default().display())
    };
    files.insert(label(session), session.to_owned());
    for path in files_beside(session) {
        // One that is not there is the reader's affair.
        if path.is_file() {
            files.insert(label(&path), path);
        }
    }
    Ok(files)
}

fn hash_of(path: &Path) -> io::Result<(u128, u64)> {
    let mut file = osp_session::small_file::open_regular(path)?;
    let (mut hasher, mut bytes) = (Xxh3::new(), 0);
    let mut chunk = vec![0; CHUNK];
    loop {
        match file.read(&mut chunk)? {
            0 => return Ok((hasher.digest128(), bytes)),
            read => {
                hasher.update(&chunk[..read]);
                bytes += read as u64;
            }
        }
    }
}
