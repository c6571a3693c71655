use std::{
    fmt,
    io::{self, Read, Seek, SeekFrom},
};

use xxhash_rust::xxh3::Xxh3Default;

use osp_session::platform::fs::{File, Metadata};

/// A 128-bit hash of a file's contents, to detect changes by other programs.
#[derive(Clone, Default)]
pub(super) struct Contents {
    bytes: u64,
    hash: Xxh3Default,
}

impl Contents {
    /// Hashes the first `bytes` bytes of a file, or the whole file if it is shorter. Afterwards the file's position is
    /// unspecified.
    pub(super) fn read(mut file: &File, bytes: u64) -> io::Result<Self> {
        let mut contents = Self::default();
        file.seek(SeekFrom::Start(0))?;
        let mut rest = file.take(bytes);
        let mut buffer = vec![0; 1 << 16];
        loop {
            match rest.read(&mut buffer) {
                Ok(0) => return Ok(contents),
                Ok(count) => contents.push(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes += bytes.len() as u64;
        self.hash.update(bytes);
    }
}

impl PartialEq for Contents {
    fn eq(&self, other: &Self) -> bool {
        self.bytes == other.bytes && self.hash.digest128() == other.hash.digest128()
    }
}

impl fmt::Debug for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Contents({} bytes, {:032x})", self.bytes, self.hash.digest128())
    }
}

/// Time of a file's last change, by the system's clock. Two writes within one tick have the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stamp {
    /// The time of the last status change, which no program can set back.
    #[cfg(unix)]
    seconds_and_nanoseconds: (i64, i64),
    #[cfg(not(unix))]
    modified: Option<std::time::SystemTime>,
}

impl Stamp {
    #[cfg(unix)]
    pub(super) fn of(data: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self { seconds_and_nanoseconds: (data.ctime(), data.ctime_nsec()) }
    }

    #[cfg(not(unix))]
    pub(super) fn of(data: &Metadata) -> Self {
        Self { modified: data.modified().ok() }
    }
}
