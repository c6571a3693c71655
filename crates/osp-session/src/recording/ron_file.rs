use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::{
    Header, Limits, MAX_LINE_BYTES, OpenOptions, RecordingError, RonReader,
    error::Mismatch,
    input::{Input, InputFile},
    ron_line::{is_blank, parse_event},
    unpacked::Unpacked,
};
use crate::{
    atomic_file::AtomicFile,
    platform::{
        fs::{File, OpenOptions as FileOptions},
        zstd,
    },
};

/// The output file of a [`RonWriter`](super::RonWriter), compressed if its name ends in `.zst`.
#[derive(Debug)]
pub struct RecordingFile(Kind);

enum Kind {
    Plain(File),
    Compressed(Option<zstd::stream::write::Encoder<'static, File>>),
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Plain(file) => f.debug_tuple("Plain").field(file).finish(),
            Self::Compressed(_) => f.write_str("Compressed"),
        }
    }
}

impl RecordingFile {
    pub(super) fn create(path: &Path) -> Result<Self, RecordingError> {
        File::create(path).and_then(|file| Self::over(file, path)).map_err(|e| RecordingError::io(path, e))
    }

    /// Writes a recording to an open file, compressed if `name` ends in `.zst`.
    pub fn over(file: File, name: &Path) -> io::Result<Self> {
        if is_compressed_name(name) { encode(file) } else { Ok(Self(Kind::Plain(file))) }
    }

    /// Writes the end mark of compressed data.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Kind::Plain(file) => file.flush(),
            Kind::Compressed(encoder) => encoder.take().map_or(Ok(()), |encoder| encoder.finish().map(drop)),
        }
    }
}

impl Write for RecordingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.0 {
            Kind::Plain(file) => file.write(bytes),
            Kind::Compressed(Some(encoder)) => encoder.write(bytes),
            Kind::Compressed(None) => Err(io::Error::other("the recording is finished")),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Kind::Plain(file) => file.flush(),
            Kind::Compressed(encoder) => encoder.as_mut().map_or(Ok(()), Write::flush),
        }
    }
}

impl Drop for RecordingFile {
    fn drop(&mut self) {
        // Drop ignores the error. Callers that need it call `finish`.
        let _ = self.finish();
    }
}

fn is_compressed_name(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zst"))
}

/// Removes an incomplete last line of a recording, and opens the recording for appending. Returns its header and its
/// number of lines.
pub(super) fn append(path: &Path) -> Result<(RecordingFile, Header, u64), RecordingError> {
    let io = |e| RecordingError::io(path, e);
    if is_compressed_name(path) {
        return append_compressed(path);
    }
    let mut file = FileOptions::new().read(true).write(true).open(path).map_err(io)?;
    let header = RonReader::new(BufReader::new(&file), path, OpenOptions::default())?.header().clone();
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    let end = LastLine::find(&mut BufReader::with_capacity(1 << 16, &file), path)?;
    file.set_len(end.whole_bytes).map_err(io)?;
    file.seek(SeekFrom::Start(end.whole_bytes)).map_err(io)?;
    if end.lacks_newline {
        file.write_all(b"\n").map_err(io)?;
    }
    Ok((RecordingFile(Kind::Plain(file)), header, end.lines))
}

#[derive(Debug)]
pub struct LastLine {
    /// Number of complete lines.
    lines: u64,
    /// Number of bytes up to the end of the last complete line.
    pub whole_bytes: u64,
    /// Number of bytes of the incomplete line after it.
    torn_bytes: u64,
    /// Whether the last complete line lacks its newline.
    pub lacks_newline: bool,
    /// Whether the compressed data have no end mark.
    cut: bool,
}

impl LastLine {
    /// Reads to the end of the file and finds the end of its last complete line.
    pub fn find(input: &mut impl BufRead, path: &Path) -> Result<Self, RecordingError> {
        let mut end = Self { lines: 0, whole_bytes: 0, torn_bytes: 0, lacks_newline: false, cut: false };
        let mut line = Vec::new();
        loop {
            line.clear();
            match input.by_ref().take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', &mut line) {
                Ok(_) => {}
                Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => end.cut = true,
                Err(e) => return Err(RecordingError::io(path, e)),
            }
            if line.last() == Some(&b'\n') {
                end.lines += 1;
                end.whole_bytes += line.len() as u64;
            } else if line.len() > MAX_LINE_BYTES {
                let expected = format!("a line of at most {MAX_LINE_BYTES} bytes");
                return Err(Mismatch::new(expected, "a longer one").in_line(path, end.lines + 1));
            } else {
                break;
            }
        }
        // The header has been read before. If no line is complete yet, this line is the header.
        let whole = end.lines == 0
            || std::str::from_utf8(&line)
                .is_ok_and(|text| is_blank(text) || parse_event(text.trim()).is_ok());
        if line.is_empty() {
            return Ok(end);
        }
        if whole {
            end.lines += 1;
            end.whole_bytes += line.len() as u64;
            end.lacks_newline = true;
        } else {
            end.torn_bytes = line.len() as u64;
        }
        Ok(end)
    }
}

/// Largest window of a frame, as a power of two: 128 MiB, the limit of the `zstd` program. It bounds the memory
/// that a malicious file can allocate.
const WINDOW_LOG_MAX: u32 = 27;

/// No limits, because only the end of the recording is kept in memory.
const ANY: Limits = Limits { polygons: u64::MAX, unpacking: u64::MAX };

type Decoder = BufReader<Unpacked<zstd::stream::read::Decoder<'static, BufReader<InputFile>>>>;

pub(super) fn decoder(input: Input<'_>, limits: &Limits) -> Result<Decoder, RecordingError> {
    let open = || {
        let file = input.open()?;
        let packed = file.len()?;
        let mut decoder = zstd::stream::read::Decoder::new(file)?;
        decoder.window_log_max(WINDOW_LOG_MAX)?;
        Ok(BufReader::with_capacity(1 << 16, Unpacked::new(decoder, packed, limits)))
    };
    open().map_err(|e| RecordingError::io(input.path, e))
}

/// Starts a compressed frame at the file's current position.
fn encode(file: File) -> io::Result<RecordingFile> {
    let mut encoder = zstd::stream::write::Encoder::new(file, zstd::DEFAULT_COMPRESSION_LEVEL)?;
    encoder.include_checksum(true)?;
    Ok(RecordingFile(Kind::Compressed(Some(encoder))))
}

/// Appends a compressed frame. A file without its end mark, or with an incomplete last line, is first replaced by a
/// file with the complete lines.
fn append_compressed(path: &Path) -> Result<(RecordingFile, Header, u64), RecordingError> {
    let io = |e| RecordingError::io(path, e);
    let header =
        RonReader::new(decoder(Input::on_disk(path), &ANY)?, path, OpenOptions::default())?.header().clone();
    let end = LastLine::find(&mut decoder(Input::on_disk(path), &ANY)?, path)?;
    if end.cut || end.torn_bytes > 0 {
        let rewrite = || {
            let mut beside = AtomicFile::create(path)?;
            let mut copy = encode(beside.handle()?)?;
            io::copy(
                &mut decoder(Input::on_disk(path), &ANY).map_err(io::Error::other)?.take(end.whole_bytes),
                &mut copy,
            )?;
            copy.finish()?;
            beside.commit()
        };
        rewrite().map_err(io)?;
    }
    let file = FileOptions::new().append(true).open(path).map_err(io)?;
    let mut file = encode(file).map_err(io)?;
    if end.lacks_newline {
        file.write_all(b"\n").map_err(io)?;
    }
    Ok((file, header, end.lines))
}
