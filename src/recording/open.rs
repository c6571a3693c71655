use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::{Limits, RecordingError, RonReader, Session};

/// How a session is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenOptions {
    /// Damaged pieces are passed over and counted in [`Notes::skipped`](super::Notes::skipped), instead of ending the
    /// session with an error.
    pub lenient: bool,
    /// How much the session may hold.
    pub limits: Limits,
}

impl OpenOptions {
    /// Damage is an error; the usual limits.
    pub const STRICT: Self = Self { lenient: false, limits: Limits::DEFAULT };
    /// Damage is passed over; the usual limits.
    pub const LENIENT: Self = Self { lenient: true, limits: Limits::DEFAULT };
}

/// Formats that [`open`] reads, for its error message.
fn formats() -> String {
    #[cfg(feature = "formats")]
    let formats = [&[".ron", ".ron.zst"], super::import::FORMATS].concat().join(", ");
    #[cfg(not(feature = "formats"))]
    let formats = ".ron".to_owned();
    formats
}

/// Bytes from the beginning of a file that decide its format.
const SNIFF_BYTES: u64 = 4096;

/// First bytes of a zstd frame.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Opens a session of any format that can be read. What the file contains decides, then its name. Of folders, a
/// `.tilt` in its unpacked form is read.
///
/// # Errors
/// The file cannot be read, its format is unknown, or its beginning is damaged.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    let start = if path.is_dir() { Vec::new() } else { sniff(path)? };
    #[cfg(feature = "formats")]
    if let Some(opener) = super::import::by_mark(path, &start) {
        return opener(path, options);
    }
    if is_ron(path, &start) {
        return open_ron(path, options);
    }
    #[cfg(feature = "formats")]
    if let Some(opener) = super::import::by_name(path, &start) {
        return opener(path, options);
    }
    Err(RecordingError::Unknown {
        path: path.to_owned(),
        expected: format!("one of the formats {}", formats()),
        found: if path.is_dir() { "a folder without a sketch".to_owned() } else { describe(&start) },
    })
}

/// Opens a recording in the project's own format, plain or compressed.
///
/// # Errors
/// The file cannot be read, or its header is damaged or of a newer format.
pub fn open_ron(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    if is_compressed(path, &sniff(path)?) {
        return open_compressed(path, options);
    }
    let file = File::open(path).map_err(|e| RecordingError::io(path, e))?;
    let reader = RonReader::new(BufReader::with_capacity(1 << 16, file), path, *options)?;
    Ok(Session::new(reader.header().clone(), "ron", Box::new(reader), path, options))
}

#[cfg(feature = "formats")]
fn open_compressed(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    let reader = RonReader::new(super::ron_file::decoder(path, &options.limits)?, path, *options)?;
    Ok(Session::new(reader.header().clone(), "ron.zst", Box::new(reader), path, options))
}

#[cfg(not(feature = "formats"))]
fn open_compressed(path: &Path, _options: &OpenOptions) -> Result<Session, RecordingError> {
    Err(RecordingError::Unknown {
        path: path.to_owned(),
        expected: "an uncompressed recording (this build lacks the feature `formats`)".to_owned(),
        found: "zstd data".to_owned(),
    })
}

/// Whether [`open`] would try to read a file that begins so.
#[cfg(any(feature = "cli", feature = "window"))]
pub(crate) fn looks_like_session(path: &Path, start: &[u8]) -> bool {
    use super::import::{by_mark, by_name};
    by_mark(path, start).is_some() || is_ron(path, start) || by_name(path, start).is_some()
}

/// Describes a file of an unknown format by its first bytes, for the error.
fn describe(start: &[u8]) -> String {
    match start {
        [] => "an empty file".to_owned(),
        _ => format!("a file that begins with \"{}\"", start[..start.len().min(16)].escape_ascii()),
    }
}

fn sniff(path: &Path) -> Result<Vec<u8>, RecordingError> {
    let mut start = Vec::new();
    let metadata = std::fs::metadata(path).map_err(|e| RecordingError::io(path, e))?;
    if !metadata.is_file() {
        // Bytes that are read from a pipe to find the format are lost to the reader, and a replay reads a session twice.
        return Err(RecordingError::Unknown {
            path: path.to_owned(),
            expected: "a regular file, or the folder of a .tilt".to_owned(),
            found: if metadata.is_dir() { "another folder" } else { "a pipe or a device" }.to_owned(),
        });
    }
    File::open(path)
        .and_then(|file| file.take(SNIFF_BYTES).read_to_end(&mut start))
        .map_err(|e| RecordingError::io(path, e))?;
    Ok(start)
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().to_ascii_lowercase().ends_with(ending))
}

fn is_ron(path: &Path, start: &[u8]) -> bool {
    has_ending(path, ".ron") || is_compressed(path, start) || starts_with_header(start)
}

fn is_compressed(path: &Path, start: &[u8]) -> bool {
    start.starts_with(&ZSTD_MAGIC) || (has_ending(path, ".ron.zst") && !starts_with_header(start))
}

/// Whether the first line that is neither blank nor a comment is a recording's header.
fn starts_with_header(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(start);
    let first =
        start.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).find(|l| !l.is_empty() && !l.starts_with(b"//"));
    first.is_some_and(|line| line.starts_with(b"Header(") || line.starts_with(b"Header ("))
}
