//! A file of sets, all little-endian:
//!
//! | byte | contents |
//! |---|---|
//! | 0 | `osp pvs 2` and a line end |
//! | 10 | number of polygons of the model, 64 bits |
//! | 18 | [`fingerprint_of_model`], 64 bits |
//! | 26 | number of polygons that share a bit, 32 bits |
//! | 30 | number of cells along x, y and z, 32 bits each |
//! | 42 | number of samples of a cell, 32 bits |
//! | 46 | smallest corner, and edge of a cell, 32-bit floats |
//! | 62 | the sets, cell after cell, in words of 64 bits, compressed by zstd |
//! | the last 8 | XXH3-64 of all preceding bytes |
//!
//! Zstd detects only some kinds of damage, and a changed bit of a set would hide a visible polygon. So the checksum is
//! verified first, and no memory is reserved for the sets of another model.

use std::{
    io::{self, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use glam::{UVec3, Vec3};
use thiserror::Error;
use xxhash_rust::xxh3::Xxh3;

use super::{GROUP, Pvs, ViewCells, fingerprint_of_model, words_of};
use osp_session::{
    platform::{fs::File, zstd},
    scene::Scene,
    small_file::open_regular,
};

const MAGIC: &[u8; 10] = b"osp pvs 2\n";
/// Beginning of files of format 1, which had no checksum.
const OLD_MAGIC: &[u8; 10] = b"osp pvs 1\n";
const HEAD_BYTES: u64 = 62;
const CHECKSUM_BYTES: u64 = 8;
/// Number of bytes per read.
const CHUNK: usize = 1 << 16;
const LEVEL: i32 = 9;
/// Level 9 uses a window of at most 2^22 bytes; a much larger limit would waste memory.
const WINDOW_LOG: u32 = 23;

#[derive(Debug, Error)]
pub enum PvsError {
    #[error("{}: {cause}", path.display())]
    Io { path: PathBuf, cause: io::Error },
    #[error("{}, byte {offset}: expected {expected}; found {found}", path.display())]
    Damaged { path: PathBuf, offset: u64, expected: String, found: String },
    #[error(
        "{}, byte {MODEL_AT}: made of another model: expected {expected}; found {found}; osp bake makes it again",
        path.display()
    )]
    OtherModel { path: PathBuf, expected: String, found: String },
}

/// Offset of the model's description in the file.
const MODEL_AT: u64 = MAGIC.len() as u64;

/// The header of the file, before the sets.
struct Head {
    polygons: u64,
    model: u64,
    cells: ViewCells,
    samples: u32,
}

struct Fields<'a> {
    bytes: &'a [u8],
    offset: u64,
}

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.bytes.split_first_chunk().expect("the head has all its bytes");
        (self.bytes, self.offset) = (rest, self.offset + N as u64);
        *taken
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn f32(&mut self) -> f32 {
        f32::from_bits(self.u32())
    }
}

/// A writer that forwards the bytes and computes their checksum.
struct Summing<W> {
    out: W,
    sum: Xxh3,
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn damaged(path: &Path, offset: u64, expected: impl Into<String>, found: impl std::fmt::Display) -> PvsError {
    PvsError::Damaged { path: path.to_owned(), offset, expected: expected.into(), found: found.to_string() }
}

fn model_text(polygons: u64, model: u64) -> String {
    format!("{polygons} polygons with the fingerprint {model:016x}")
}

impl Pvs {
    /// Writes the sets in the form of a file.
    pub fn write_to(&self, out: impl Write) -> io::Result<()> {
        let mut out = Summing { out, sum: Xxh3::new() };
        out.write_all(MAGIC)?;
        out.write_all(&(self.polygons as u64).to_le_bytes())?;
        out.write_all(&self.model.to_le_bytes())?;
        let count = self.cells.count.to_array();
        for n in [GROUP as u32].into_iter().chain(count).chain([self.samples]) {
            out.write_all(&n.to_le_bytes())?;
        }
        for c in self.cells.min.to_array().into_iter().chain([self.cells.side_m]) {
            out.write_all(&c.to_le_bytes())?;
        }
        let mut packed = zstd::Encoder::new(out, LEVEL)?;
        for word in &self.sets {
            packed.write_all(&word.to_le_bytes())?;
        }
        let Summing { mut out, sum } = packed.finish()?;
        out.write_all(&sum.digest().to_le_bytes())?;
        out.flush()
    }

    /// Reads the sets of a file, which must belong to the current state of this model. Memory for the sets, at most
    /// [`Pvs::MOST_BYTES`], is reserved only after the checksum and the model have been checked.
    ///
    /// # Errors
    /// The file cannot be read, is damaged, or belongs to another model. The message has the offset.
    pub fn read(path: &Path, model: &Scene) -> Result<Self, PvsError> {
        let io = |cause| PvsError::Io { path: path.to_owned(), cause };
        let mut file = open_regular(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        check_whole(&mut file, path, bytes)?;
        file.rewind().map_err(io)?;
        let mut head = [0; HEAD_BYTES as usize];
        file.read_exact(&mut head).map_err(io)?;
        let head = read_head(&head, path)?;
        let expected = (model.polygon_count() as u64, fingerprint_of_model(model));
        if (head.polygons, head.model) != expected {
            return Err(PvsError::OtherModel {
                path: path.to_owned(),
                expected: model_text(expected.0, expected.1),
                found: model_text(head.polygons, head.model),
            });
        }
        let packed = bytes - HEAD_BYTES - CHECKSUM_BYTES;
        let sets = read_sets(&head, file.take(packed), path)?;
        let Head { cells, model, samples, .. } = head;
        Ok(Self { cells, polygons: expected.0 as usize, model, samples, sets })
    }
}

/// Reads the whole file and checks its first bytes and its checksum.
fn check_whole(file: &mut File, path: &Path, bytes: u64) -> Result<(), PvsError> {
    let io = |cause| PvsError::Io { path: path.to_owned(), cause };
    let mut magic = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(io)?;
    let begin = "a file that begins with `osp pvs 2`";
    if magic == OLD_MAGIC {
        return Err(damaged(path, 0, begin, "`osp pvs 1`, which had no checksum; osp bake makes it again"));
    }
    if magic != MAGIC {
        return Err(damaged(path, 0, begin, format!("\"{}\"", magic.escape_ascii())));
    }
    let least = HEAD_BYTES + CHECKSUM_BYTES;
    if bytes < least {
        return Err(damaged(path, bytes, format!("a file of at least {least} bytes"), "its end"));
    }
    let mut sum = Xxh3::new();
    file.rewind().map_err(io)?;
    let mut summed = BufReader::with_capacity(CHUNK, file.take(bytes - CHECKSUM_BYTES));
    let mut chunk = vec![0; CHUNK];
    loop {
        match summed.read(&mut chunk).map_err(io)? {
            0 => break,
            n => sum.update(&chunk[..n]),
        }
    }
    file.seek(SeekFrom::Start(bytes - CHECKSUM_BYTES)).map_err(io)?;
    let mut stored = [0; CHECKSUM_BYTES as usize];
    file.read_exact(&mut stored).map_err(io)?;
    let (sum, stored) = (sum.digest(), u64::from_le_bytes(stored));
    if sum == stored {
        return Ok(());
    }
    let expected = format!("{sum:016x}, the checksum of all bytes before");
    let found = format!("{stored:016x}: the file is damaged or cut off");
    Err(damaged(path, bytes - CHECKSUM_BYTES, expected, found))
}

fn read_head(bytes: &[u8; HEAD_BYTES as usize], path: &Path) -> Result<Head, PvsError> {
    let mut fields = Fields { bytes: &bytes[MAGIC.len()..], offset: MODEL_AT };
    let (polygons, model) = (fields.u64(), fields.u64());
    let at = fields.offset;
    let group = fields.u32();
    if group as usize != GROUP {
        return Err(damaged(path, at, format!("{GROUP} polygons that share a bit"), group));
    }
    let at = fields.offset;
    let count = UVec3::new(fields.u32(), fields.u32(), fields.u32());
    let cells = count.to_array().into_iter().fold(1u64, |n, c| n.saturating_mul(u64::from(c)));
    if cells == 0 || cells > u64::from(ViewCells::MOST) {
        let expected = format!("1 to {} cells", ViewCells::MOST);
        return Err(damaged(path, at, expected, format!("{} x {} x {}", count.x, count.y, count.z)));
    }
    let samples = fields.u32();
    let at = fields.offset;
    let min = Vec3::new(fields.f32(), fields.f32(), fields.f32());
    let side_m = fields.f32();
    if !(min.is_finite() && side_m.is_finite() && side_m > 0.0) {
        let expected = "a finite corner and a side above 0";
        return Err(damaged(path, at, expected, format!("{min} and {side_m}")));
    }
    Ok(Head { polygons, model, cells: ViewCells { min, side_m, count }, samples })
}

/// Decompresses the sets into memory that is reserved at once.
fn read_sets(head: &Head, packed: impl Read, path: &Path) -> Result<Vec<u64>, PvsError> {
    let io = |cause| PvsError::Io { path: path.to_owned(), cause };
    let words = words_of(head.polygons as usize) * head.cells.len();
    let bytes = words as u64 * 8;
    let mut sets: Vec<u64> = Vec::new();
    if bytes > Pvs::MOST_BYTES as u64 || sets.try_reserve_exact(words).is_err() {
        let expected = format!("sets of at most {} bytes, and memory for them", Pvs::MOST_BYTES);
        return Err(damaged(path, HEAD_BYTES, expected, format!("{bytes} bytes")));
    }
    let mut unpacked = zstd::Decoder::new(packed).map_err(io)?;
    unpacked.window_log_max(WINDOW_LOG).map_err(io)?;
    let expected = || format!("{bytes} bytes of sets, packed");
    let mut chunk = [0; CHUNK];
    while sets.len() < words {
        let more = (words - sets.len()).min(CHUNK / 8);
        let chunk = &mut chunk[..more * 8];
        unpacked.read_exact(chunk).map_err(|error| damaged(path, HEAD_BYTES, expected(), error))?;
        sets.extend(chunk.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)));
    }
    let groups = (head.polygons as usize).div_ceil(GROUP);
    let beyond = u64::MAX.checked_shl(groups as u32 % 64).filter(|_| !groups.is_multiple_of(64)).unwrap_or(0);
    let last_words = sets.chunks(words_of(head.polygons as usize).max(1)).filter_map(<[u64]>::last);
    if last_words.into_iter().any(|last| last & beyond != 0) {
        return Err(damaged(path, HEAD_BYTES, format!("sets of {groups} groups"), "a bit for another group"));
    }
    match unpacked.read(&mut chunk[..1]) {
        Ok(0) => Ok(sets),
        Ok(_) => Err(damaged(path, HEAD_BYTES, expected(), "more")),
        Err(error) => Err(damaged(path, HEAD_BYTES, expected(), error)),
    }
}
