use std::{
    io::{self, BufReader, Read},
    path::Path,
    sync::Arc,
};

use super::{
    MemoryFiles, OpenOptions, Place, RecordingError, RonReader, Session, error::beyond,
    import::BYTE_ORDER_MARK, input::Input,
};
use crate::platform::fs::{File, has_ending};

fn formats() -> String {
    [&[".ron", ".ron.zst"], super::import::FORMATS].concat().join(", ")
}

/// Number of bytes at the beginning of a file that decide its format.
pub(super) const SNIFF_BYTES: u64 = 4096;

/// First bytes of a file that stands for one in Git LFS.
pub(super) const LFS_POINTER: &[u8] = b"version https://git-lfs";

/// First bytes of a zstd frame.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Opens a session of any supported format. The contents of the file determine the format, or else the file's name. A
/// folder is opened if it is an unpacked `.tilt`. A pipe, or standard input (`-`), is read to its end first.
///
/// # Errors
/// The file cannot be read, its format is unknown, or its beginning is damaged.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    match is_pipe(path) {
        true => open_bytes(path, read_pipe(path, options)?, options),
        false => open_input(Input::on_disk(path), options),
    }
}

/// Whether [`open`] reads the path only once: standard input (`-`), a pipe or a device.
pub fn is_pipe(path: &Path) -> bool {
    path == Path::new("-") || Input::on_disk(path).is_special()
}

/// Reads a pipe to its end. Its beginning must be that of a session, so that a device without an end is refused.
fn read_pipe(path: &Path, options: &OpenOptions) -> Result<Vec<u8>, RecordingError> {
    let io = |cause| RecordingError::io(path, cause);
    let mut pipe: Box<dyn Read> = match path == Path::new("-") {
        true => Box::new(io::stdin()),
        false => Box::new(File::open(path).map_err(io)?),
    };
    let mut bytes = Vec::new();
    pipe.by_ref().take(SNIFF_BYTES).read_to_end(&mut bytes).map_err(io)?;
    if !looks_like_session(path, &bytes) {
        return Err(unknown(path, describe(&bytes)));
    }
    let most = options.limits.piped_bytes();
    pipe.take(most.saturating_add(1) - bytes.len() as u64).read_to_end(&mut bytes).map_err(io)?;
    match bytes.len() as u64 > most {
        true => Err(beyond(path, Place::File, most, "bytes from a pipe")),
        false => Ok(bytes),
    }
}

/// Does the same as [`open`] for a file on the disk or in memory.
fn open_input(input: Input<'_>, options: &OpenOptions) -> Result<Session, RecordingError> {
    let path = input.path;
    let start = if input.is_folder() { Vec::new() } else { sniff(input)? };
    if let Some(found) = foreign(&start) {
        return Err(unknown(path, found.to_owned()));
    }
    if let Some(opener) = super::import::by_contents(input, &start) {
        return opener(input, options);
    }
    if is_ron(path, &start) {
        return open_ron_input(input, options);
    }
    if let Some(opener) = super::import::by_name(path, &start) {
        return opener(input, options);
    }
    let found = match input.is_folder() {
        true => "a folder that is no unpacked sketch (open one of its files)".to_owned(),
        // A binary STL begins with any 80 bytes.
        false if has_ending(path, ".stl") => "a model of the format STL".to_owned(),
        false => describe(&start),
    };
    Err(unknown(path, found))
}

fn unknown(path: &Path, found: String) -> RecordingError {
    let expected = format!("one of the formats {}", formats());
    RecordingError::Unknown { path: path.to_owned(), expected, found }
}

impl MemoryFiles {
    /// Opens one of the files, like [`open`].
    ///
    /// # Errors
    /// The file does not exist, its format is unknown, or its beginning is damaged.
    pub fn open(&self, name: impl AsRef<Path>, options: &OpenOptions) -> Result<Session, RecordingError> {
        open_input(Input::in_memory(name.as_ref(), self), options)
    }
}

/// Opens a session whose file is in memory. If the bytes do not determine the format, `name` does. Errors contain
/// `name`.
///
/// # Errors
/// The format is unknown, or the beginning is damaged.
pub fn open_bytes(
    name: impl AsRef<Path>,
    bytes: impl Into<Arc<[u8]>>,
    options: &OpenOptions,
) -> Result<Session, RecordingError> {
    let mut files = MemoryFiles::new();
    files.insert(&name, bytes);
    files.open(name, options)
}

/// Opens a recording in the format of osp, plain or compressed.
///
/// # Errors
/// The file cannot be read, or its header is damaged or of a newer format.
pub fn open_ron(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    open_ron_input(Input::on_disk(path), options)
}

fn open_ron_input(input: Input<'_>, options: &OpenOptions) -> Result<Session, RecordingError> {
    let path = input.path;
    if is_compressed(path, &sniff(input)?) {
        return open_compressed(input, options);
    }
    let file = input.open().map_err(|e| RecordingError::io(path, e))?;
    let reader = RonReader::new(BufReader::with_capacity(1 << 16, file), path, *options)?;
    Ok(Session::new(reader.header().clone(), "ron", Box::new(reader), path, options))
}

fn open_compressed(input: Input<'_>, options: &OpenOptions) -> Result<Session, RecordingError> {
    let path = input.path;
    let reader = RonReader::new(super::ron_file::decoder(input, &options.limits)?, path, *options)?;
    Ok(Session::new(reader.header().clone(), "ron.zst", Box::new(reader), path, options))
}

/// Whether [`open`] would attempt to read a file with this beginning.
pub fn looks_like_session(path: &Path, start: &[u8]) -> bool {
    use super::import::{by_contents, by_name};
    by_contents(Input::on_disk(path), start).is_some()
        || is_ron(path, start)
        || by_name(path, start).is_some()
}

/// Describes a file of an unknown format by its first bytes, for an error message.
fn describe(start: &[u8]) -> String {
    match start {
        [] => "an empty file".to_owned(),
        _ => match foreign(start) {
            Some(found) => found.to_owned(),
            None => format!("a file that begins with \"{}\"", start[..start.len().min(16)].escape_ascii()),
        },
    }
}

/// What a file is, whatever its name says, if its first bytes are those of no session.
fn foreign(start: &[u8]) -> Option<&'static str> {
    const KNOWN: [(&[u8], &str); 13] = [
        (LFS_POINTER, "a pointer of Git LFS in place of the file (`git lfs pull` gets the file)"),
        (b"<!doctype html", "a page of HTML, as from a failed download"),
        (b"<html", "a page of HTML, as from a failed download"),
        (b"\xFF\xFE", "text in UTF-16 (save it as UTF-8)"),
        (b"\xFE\xFF", "text in UTF-16 (save it as UTF-8)"),
        (b"ply\n", "a model of the format PLY"),
        (b"ply\r", "a model of the format PLY"),
        (b"solid ", "a model of the format STL"),
        (b"kaydara fbx binary", "a model of the format FBX"),
        (b"blender", "a model of Blender"),
        (b"<?xml", "a file of XML, such as COLLADA or SVG"),
        (b"\x89png", "a picture"),
        (b"%pdf", "a PDF"),
    ];
    let text = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start).trim_ascii_start();
    let is_it = |magic: &[u8]| text.get(..magic.len()).is_some_and(|of| of.eq_ignore_ascii_case(magic));
    KNOWN.into_iter().find(|(magic, _)| is_it(magic)).map(|(_, found)| found)
}

fn sniff(input: Input<'_>) -> Result<Vec<u8>, RecordingError> {
    let path = input.path;
    let mut start = Vec::new();
    input
        .open()
        .and_then(|file| file.take(SNIFF_BYTES).read_to_end(&mut start))
        .map_err(|e| RecordingError::io(path, e))?;
    Ok(start)
}

fn is_ron(path: &Path, start: &[u8]) -> bool {
    has_ending(path, ".ron") || is_compressed(path, start) || starts_with_header(start)
}

fn is_compressed(path: &Path, start: &[u8]) -> bool {
    start.starts_with(&ZSTD_MAGIC) || (has_ending(path, ".ron.zst") && !starts_with_header(start))
}

/// Whether the first line that is neither blank nor a comment is the header of a recording.
fn starts_with_header(start: &[u8]) -> bool {
    let start = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start);
    let first =
        start.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).find(|l| !l.is_empty() && !l.starts_with(b"//"));
    first.is_some_and(|line| line.starts_with(b"Header(") || line.starts_with(b"Header ("))
}
