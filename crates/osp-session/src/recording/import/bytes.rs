use std::fmt::Display;
use std::io::{self, BufReader, Read};
use std::path::PathBuf;

use flate2::Crc;
use glam::{Quat, Vec3};

use crate::recording::{
    Place, RecordingError,
    error::{Mismatch, Result},
    input::Input,
    unpacked,
};

/// A reader of little-endian values from a stream. Errors state the position of the missing value.
pub(super) struct ByteReader {
    pub(super) path: PathBuf,
    pub(super) offset: u64,
    reader: Box<dyn Read + Send>,
    checksum: Option<(Crc, u32)>,
}

impl ByteReader {
    /// Creates a reader. `reader` must be at the start of `path`, a file, or an archive's entry as `FILE/ENTRY`.
    pub(super) fn new(path: PathBuf, reader: Box<dyn Read + Send>) -> Self {
        Self { path, offset: 0, reader, checksum: None }
    }

    pub(super) fn open(input: Input<'_>) -> Result<Self> {
        let file = input.open().map_err(|error| RecordingError::io(input.path, error))?;
        Ok(Self::new(input.path.to_owned(), Box::new(BufReader::new(file))))
    }

    /// Sets the CRC-32 of the whole contents, which [`Self::expect_end`] checks.
    pub(super) fn with_checksum(mut self, expected: Option<u32>) -> Self {
        self.checksum = expected.map(|expected| (Crc::new(), expected));
        self
    }

    /// Fills `buffer`. In the error, `what` names the value.
    pub(super) fn fill(&mut self, buffer: &mut [u8], what: &str) -> Result<()> {
        if let Err(error) = self.reader.read_exact(buffer) {
            let wanted = format!("{what} ({} bytes)", buffer.len());
            return Err(self.read_error(error, &wanted));
        }
        if let Some((crc, _)) = &mut self.checksum {
            crc.update(buffer);
        }
        self.offset += buffer.len() as u64;
        Ok(())
    }

    pub(super) fn u8(&mut self, what: &str) -> Result<u8> {
        let mut bytes = [0];
        self.fill(&mut bytes, what)?;
        Ok(bytes[0])
    }

    pub(super) fn u16(&mut self, what: &str) -> Result<u16> {
        let mut bytes = [0; 2];
        self.fill(&mut bytes, what)?;
        Ok(u16::from_le_bytes(bytes))
    }

    pub(super) fn u32(&mut self, what: &str) -> Result<u32> {
        let mut bytes = [0; 4];
        self.fill(&mut bytes, what)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// A count, which the format stores as a signed number.
    pub(super) fn count(&mut self, what: &str) -> Result<u32> {
        let at = self.offset;
        let count = self.u32(what)?;
        if count > i32::MAX as u32 {
            return Err(self.expected_at(at, format_args!("{what}, 0 or more"), count as i32));
        }
        Ok(count)
    }

    pub(super) fn f32(&mut self, what: &str) -> Result<f32> {
        Ok(f32::from_bits(self.u32(what)?))
    }

    /// A position (three floats) and a quaternion (x, y, z, w), in the axes of the file.
    pub(super) fn pose(&mut self, what: &str) -> Result<(Vec3, Quat)> {
        let mut bytes = [0; 28];
        self.fill(&mut bytes, what)?;
        let mut f = [0.0; 7];
        for (value, chunk) in f.iter_mut().zip(bytes.as_chunks().0) {
            *value = f32::from_le_bytes(*chunk);
        }
        Ok((Vec3::new(f[0], f[1], f[2]), Quat::from_xyzw(f[3], f[4], f[5], f[6])))
    }

    /// Skips `count` bytes with little memory.
    pub(super) fn skip(&mut self, count: u64, what: &str) -> Result<()> {
        let mut chunk = [0; 512];
        let mut left = count;
        while left > 0 {
            let now = left.min(chunk.len() as u64);
            self.fill(&mut chunk[..now as usize], what)?;
            left -= now;
        }
        Ok(())
    }

    /// Reads all bytes up to the end. More than `most` bytes are an error, in which `what` names the contents.
    pub(super) fn rest(&mut self, most: u64, what: &str) -> Result<Vec<u8>> {
        let mut all = Vec::new();
        if let Err(error) = (&mut self.reader).take(most + 1).read_to_end(&mut all) {
            return Err(self.read_error(error, what));
        }
        if all.len() as u64 > most {
            return Err(self.expected(what, "more"));
        }
        if let Some((crc, _)) = &mut self.checksum {
            crc.update(&all);
        }
        self.offset += all.len() as u64;
        Ok(all)
    }

    /// Checks that no byte follows, and that the checksum matches if there is one.
    pub(super) fn expect_end(&mut self, after: impl Display) -> Result<()> {
        let mut byte = [0];
        let found = loop {
            match self.reader.read(&mut byte) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other,
            }
        };
        match found {
            Ok(0) => {}
            Ok(_) => {
                return Err(self.expected(format_args!("the end of the data after {after}"), "more bytes"));
            }
            Err(error) => return Err(self.read_error(error, "the end of the data")),
        }
        match &self.checksum {
            Some((crc, expected)) if crc.sum() != *expected => {
                let found = format!("{:#010x}: the data are damaged somewhere before", crc.sum());
                Err(self.expected(format_args!("data with the CRC-32 {expected:#010x}"), found))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn expected(&self, expected: impl Display, found: impl Display) -> RecordingError {
        self.expected_at(self.offset, expected, found)
    }

    pub(super) fn expected_at(&self, at: u64, expected: impl Display, found: impl Display) -> RecordingError {
        Mismatch::new(expected.to_string(), found.to_string()).at_byte(&self.path, at)
    }

    /// Converts the error of a read. It is damage if the data end too early or cannot be decompressed, else a system
    /// error.
    fn read_error(&self, error: io::Error, wanted: &str) -> RecordingError {
        if let Some(beyond) = unpacked::beyond(&error, &self.path, Place::Byte(self.offset)) {
            return beyond;
        }
        match error.kind() {
            io::ErrorKind::UnexpectedEof => self.expected(wanted, "the end of the data"),
            io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => self.expected(wanted, error),
            _ => RecordingError::io(&self.path, error),
        }
    }
}
