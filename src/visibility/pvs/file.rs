//! A file of sets: `osp pvs 1` and a line end, then, compressed by zstd: polygons, fingerprint of the model (64 bits
//! each), cells along x, y and z, samples (32 bits each), the least corner and the side of a cell (32-bit floats), and
//! the sets, cell after cell, in words of 64 bits. All little-endian.

use std::{
    io::{BufReader, Read, Write},
    path::{Path, PathBuf},
};

use glam::{UVec3, Vec3};
use thiserror::Error;

use super::{Pvs, ViewCells, words_of};
use crate::{atomic_file::write_atomically, small_file::open_regular};

const MAGIC: &[u8; 10] = b"osp pvs 1\n";
/// Most polygons of a model: their numbers have 32 bits.
const MOST_POLYGONS: u64 = 1 << 32;
/// Words read at once, so that a forged count takes no memory that the file does not fill.
const CHUNK: usize = 1 << 16;
const LEVEL: i32 = 9;

/// What can be wrong with a file of sets.
#[derive(Debug, Error)]
pub enum PvsError {
    /// It could not be opened, read or written.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// It is damaged, or not such a file.
    #[error("{}, byte {offset} of what it unpacks to: expected {expected}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where, unpacked, from 0.
        offset: u64,
        /// What the format asks for there.
        expected: &'static str,
    },
}

struct Reader<'a, R> {
    input: R,
    offset: u64,
    path: &'a Path,
}

impl<R: Read> Reader<'_, R> {
    fn damaged(&self, expected: &'static str) -> PvsError {
        PvsError::Damaged { path: self.path.to_owned(), offset: self.offset, expected }
    }

    fn fill(&mut self, bytes: &mut [u8], expected: &'static str) -> Result<(), PvsError> {
        self.input.read_exact(bytes).map_err(|_| self.damaged(expected))?;
        self.offset += bytes.len() as u64;
        Ok(())
    }

    fn u64(&mut self, expected: &'static str) -> Result<u64, PvsError> {
        let mut bytes = [0; 8];
        self.fill(&mut bytes, expected)?;
        Ok(u64::from_le_bytes(bytes))
    }

    fn u32(&mut self, expected: &'static str) -> Result<u32, PvsError> {
        let mut bytes = [0; 4];
        self.fill(&mut bytes, expected)?;
        Ok(u32::from_le_bytes(bytes))
    }

    fn f32(&mut self, expected: &'static str) -> Result<f32, PvsError> {
        Ok(f32::from_bits(self.u32(expected)?))
    }
}

impl Pvs {
    /// Writes the sets to a file, in the place of one that is there.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), PvsError> {
        let write = |file: &mut dyn Write| {
            file.write_all(MAGIC)?;
            let mut out = zstd::Encoder::new(file, LEVEL)?;
            out.write_all(&(self.polygons as u64).to_le_bytes())?;
            out.write_all(&self.model.to_le_bytes())?;
            for n in self.cells.count.to_array().into_iter().chain([self.samples]) {
                out.write_all(&n.to_le_bytes())?;
            }
            for c in self.cells.min.to_array().into_iter().chain([self.cells.side_m]) {
                out.write_all(&c.to_le_bytes())?;
            }
            for word in &self.sets {
                out.write_all(&word.to_le_bytes())?;
            }
            out.finish()?.flush()
        };
        write_atomically(path, write).map_err(|cause| PvsError::Io { path: path.to_owned(), cause })
    }

    /// Reads the sets of a file.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged: the message names the place.
    pub fn read(path: &Path) -> Result<Self, PvsError> {
        let io = |cause| PvsError::Io { path: path.to_owned(), cause };
        let mut file = BufReader::new(open_regular(path).map_err(io)?);
        let mut magic = [0; MAGIC.len()];
        let is_ours = file.read_exact(&mut magic).is_ok() && &magic == MAGIC;
        let mut reader = Reader { input: zstd::Decoder::new(file).map_err(io)?, offset: 0, path };
        if !is_ours {
            return Err(reader.damaged("a file that begins with `osp pvs 1`"));
        }
        let polygons = reader.u64("the number of polygons")?;
        if polygons > MOST_POLYGONS {
            return Err(reader.damaged("at most 2^32 polygons"));
        }
        let model = reader.u64("the model's fingerprint")?;
        let count = UVec3::new(reader.u32("cells")?, reader.u32("cells")?, reader.u32("cells")?);
        let cells = count.to_array().into_iter().fold(1u64, |n, c| n.saturating_mul(u64::from(c)));
        if cells == 0 || cells > u64::from(ViewCells::MOST) {
            return Err(reader.damaged("1 to 1,048,576 cells"));
        }
        let samples = reader.u32("the number of samples")?;
        let min = Vec3::new(reader.f32("a corner")?, reader.f32("a corner")?, reader.f32("a corner")?);
        let side_m = reader.f32("the side of a cell")?;
        if !(min.is_finite() && side_m.is_finite() && side_m > 0.0) {
            return Err(reader.damaged("a finite corner and a side above 0"));
        }
        let polygons = polygons as usize;
        let words = words_of(polygons) as u64 * cells;
        let mut sets = Vec::new();
        let mut bytes = vec![0; CHUNK.min(words as usize) * 8];
        while (sets.len() as u64) < words {
            let more = (words - sets.len() as u64).min(CHUNK as u64) as usize;
            reader.fill(&mut bytes[..more * 8], "the set of every cell")?;
            sets.extend(
                bytes[..more * 8]
                    .chunks_exact(8)
                    .map(|b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])),
            );
        }
        Ok(Self { cells: ViewCells { min, side_m, count }, polygons, model, samples, sets })
    }
}
