//! The hash of a session's contents.

use std::{
    collections::BTreeMap,
    io::{self, Read},
    path::{Path, PathBuf},
};

use walkdir::WalkDir;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use osp_session::{recording::import::files_beside, small_file::open_regular};

/// Number of bytes read at once.
const CHUNK: usize = 1 << 20;

/// Size and hash of all files of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Contents {
    pub(super) bytes: u64,
    /// The hash of a single file, or of a list with the names and hashes of several files. 32 hexadecimal digits.
    pub(super) hash: String,
}

impl Contents {
    /// Reads all files of a session.
    pub(super) fn of(session: &Path) -> io::Result<Self> {
        let (mut bytes, mut hashes) = (0, BTreeMap::new());
        for (label, path) in files_of(session)? {
            let (hash, length) = hash_of(&path)?;
            bytes += length;
            hashes.insert(label, hash);
        }
        let list =
            || hashes.iter().map(|(label, hash)| format!("{label}\t{hash:032x}\n")).collect::<String>();
        let hash = match hashes.len() {
            1 => hashes.values().copied().next().unwrap_or(0),
            _ => xxh3_128(list().as_bytes()),
        };
        Ok(Self { bytes, hash: format!("{hash:032x}") })
    }
}

/// Returns the files of a session, each with a name that does not depend on the session's folder.
fn files_of(session: &Path) -> io::Result<BTreeMap<String, PathBuf>> {
    let mut files = BTreeMap::new();
    if session.is_dir() {
        for entry in WalkDir::new(session) {
            let entry = entry.map_err(io::Error::from)?;
            // A reader follows links, too.
            if entry.path().is_file() {
                let below = entry.path().strip_prefix(session).unwrap_or(entry.path());
                files.insert(below.to_string_lossy().replace('\\', "/"), entry.into_path());
            }
        }
        return Ok(files);
    }
    let label = |path: &Path| {
        // A CASSIE session has two files of the same name in two folders.
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
        format!("{}/{}", folder.display(), path.file_name().unwrap_or_default().display())
    };
    files.insert(label(session), session.to_owned());
    for path in files_beside(session) {
        // The reader reports a missing file.
        if path.is_file() {
            files.insert(label(&path), path);
        }
    }
    Ok(files)
}

fn hash_of(path: &Path) -> io::Result<(u128, u64)> {
    let mut file = open_regular(path)?;
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
