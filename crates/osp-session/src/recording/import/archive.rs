//! The zip archive inside a `.tilt` file.
//!
//! The `zip` crate reads the central directory. Its entries borrow the archive, so a stream of events could not own
//! both. This module therefore reads the bytes of an entry from the file itself. A file whose end is missing has no
//! central directory. For such a file, a lenient reader finds the entries by their local headers, from the start of the
//! file.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use flate2::read::DeflateDecoder;
use zip::read::{ArchiveOffset, Config};
use zip::{CompressionMethod, ZipArchive};

use super::bytes::ByteReader;
use crate::recording::{
    Limits, RecordingError,
    error::{Mismatch, Result},
    input::{Input, InputFile},
    unpacked::Unpacked,
};

/// Largest number of local headers that are read. Real sketches have three or four entries.
const MOST_ENTRIES: usize = 64;
const LOCAL_MAGIC: &[u8] = b"PK\x03\x04";
const LOCAL_HEADER_BYTES: usize = 30;
const ENCRYPTED: u16 = 1;
/// Flag: size and checksum follow the data, and are not in the local header.
const SIZE_FOLLOWS: u16 = 1 << 3;
const STORED: u16 = 0;
const DEFLATED: u16 = 8;

#[derive(Clone, Debug)]
pub(super) struct Entry {
    name: String,
    start: u64,
    packed_bytes: u64,
    packing: Packing,
    encrypted: bool,
    crc: Option<u32>,
}

#[derive(Clone, Debug)]
enum Packing {
    Stored,
    Deflated,
    /// An unsupported method; the text is its name.
    Other(String),
}

pub(super) struct Archive {
    entries: Vec<Entry>,
    /// The reason why the central directory was not used.
    pub(super) warning: Option<String>,
}

impl Archive {
    /// Finds the entries of the archive that begins at byte `zip_start` of `input`.
    pub(super) fn open(input: Input<'_>, zip_start: u64, is_lenient: bool) -> Result<Self> {
        let path = input.path;
        let file = input.open().map_err(|error| RecordingError::io(path, error))?;
        let mut file = BufReader::new(file);
        let why = match central_directory(&mut file, zip_start) {
            Ok(entries) => return Ok(Self { entries, warning: None }),
            Err(why) => why,
        };
        if is_lenient {
            let entries =
                local_headers(&mut file, zip_start).map_err(|error| RecordingError::io(path, error))?;
            let warning = format!(
                "{}: no usable zip directory ({why}); entries are read from the start of the file",
                path.display()
            );
            return Ok(Self { entries, warning: Some(warning) });
        }
        Err(Mismatch::new("a zip archive that is whole", why).at_byte(path, zip_start))
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|entry| &*entry.name)
    }

    pub(super) fn find(&self, names: &[&str]) -> Option<&Entry> {
        names.iter().find_map(|name| self.entries.iter().find(|entry| entry.name == *name))
    }
}

impl Entry {
    pub(super) fn read(&self, input: Input<'_>, limits: &Limits) -> Result<ByteReader> {
        let path = input.path;
        let entry_path = path.join(&self.name);
        let refuse = |expected: &str, found: &str| Mismatch::new(expected, found).in_file(&entry_path);
        if self.encrypted {
            return Err(refuse("an entry that is not encrypted", "an encrypted one"));
        }
        let packed = || -> io::Result<_> {
            let mut file = input.open()?;
            file.seek(SeekFrom::Start(self.start))?;
            Ok(BufReader::new(file.take(self.packed_bytes)))
        };
        let packed = packed().map_err(|error| RecordingError::io(path, error))?;
        let reader: Box<dyn Read + Send> = match &self.packing {
            Packing::Stored => Box::new(packed),
            // This buffer is needed because points are decoded 36 bytes at a time.
            Packing::Deflated => {
                let unpacked = Unpacked::new(DeflateDecoder::new(packed), self.packed_bytes, limits);
                Box::new(BufReader::new(unpacked))
            }
            Packing::Other(name) => return Err(refuse("an entry that is stored or deflated", name)),
        };
        Ok(ByteReader::new(entry_path, reader).with_checksum(self.crc))
    }
}

/// Reads the entries from the directory at the archive's end; the error describes the damage.
fn central_directory(file: &mut BufReader<InputFile>, zip_start: u64) -> Result<Vec<Entry>, String> {
    let config = Config { archive_offset: ArchiveOffset::Known(zip_start) };
    let mut archive = ZipArchive::with_config(config, file).map_err(|error| error.to_string())?;
    let mut entries = Vec::new();
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(|error| error.to_string())?;
        let Some(start) = entry.data_start() else { continue };
        entries.push(Entry {
            name: String::from_utf8_lossy(entry.name_raw()).into_owned(),
            start,
            packed_bytes: entry.compressed_size(),
            packing: match entry.compression() {
                CompressionMethod::Stored => Packing::Stored,
                CompressionMethod::Deflated => Packing::Deflated,
                other => Packing::Other(format!("method {other}")),
            },
            encrypted: entry.encrypted(),
            crc: Some(entry.crc32()),
        });
    }
    Ok(entries)
}

/// Reads the entries from their local headers, up to the first damage.
fn local_headers(file: &mut BufReader<InputFile>, zip_start: u64) -> io::Result<Vec<Entry>> {
    let end = file.seek(SeekFrom::End(0))?;
    let mut entries = Vec::new();
    let mut at = zip_start;
    while entries.len() < MOST_ENTRIES && at < end {
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0; LOCAL_HEADER_BYTES];
        if file.read_exact(&mut head).is_err() || !head.starts_with(LOCAL_MAGIC) {
            break;
        }
        let u16_at = |i: usize| u16::from_le_bytes([head[i], head[i + 1]]);
        let u32_at = |i: usize| u32::from_le_bytes([head[i], head[i + 1], head[i + 2], head[i + 3]]);
        let mut name = vec![0; u16_at(26).into()];
        if file.read_exact(&mut name).is_err() {
            break;
        }
        let flags = u16_at(6);
        let start = at + LOCAL_HEADER_BYTES as u64 + u64::from(u16_at(26)) + u64::from(u16_at(28));
        let size_follows = flags & SIZE_FOLLOWS != 0;
        let packed_bytes = if size_follows { end.saturating_sub(start) } else { u32_at(18).into() };
        entries.push(Entry {
            name: String::from_utf8_lossy(&name).into_owned(),
            start,
            packed_bytes,
            packing: match u16_at(8) {
                STORED => Packing::Stored,
                DEFLATED => Packing::Deflated,
                other => Packing::Other(format!("method {other}")),
            },
            encrypted: flags & ENCRYPTED != 0,
            crc: (!size_follows).then(|| u32_at(14)),
        });
        at = start + packed_bytes;
    }
    Ok(entries)
}
