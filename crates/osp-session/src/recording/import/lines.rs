use std::fmt::Display;
use std::io::{self, BufRead, BufReader, Read, Seek};
use std::path::PathBuf;

use flate2::read::MultiGzDecoder;

use crate::recording::{
    Notes, OpenOptions, Place, RecordingError,
    error::{Mismatch, Result},
    input::Input,
    unpacked::{self, Unpacked},
};

/// Length of the excerpt of a damaged line in an error, characters.
const SHOWN_CHARS: usize = 60;
/// The mark with which some programs begin a text in UTF-8.
pub(in crate::recording) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// The first bytes of a gzip stream.
pub(super) const GZIP_MAGIC: &[u8] = b"\x1f\x8b";

/// The bytes that a gzip stream unpacks to.
pub(super) fn gzip<R: Read>(packed: R) -> MultiGzDecoder<BufReader<R>> {
    MultiGzDecoder::new(BufReader::new(packed))
}

/// A reader of the lines of a text file, perhaps compressed with gzip. The length of a line is bounded.
pub(super) struct LineReader {
    pub(super) path: PathBuf,
    reader: Box<dyn BufRead + Send>,
    line: u64,
    text: Vec<u8>,
    is_lenient: bool,
    pub(super) notes: Notes,
    done: bool,
}

impl LineReader {
    /// Longest line that is read, bytes. A face of 1024 corners, the longest valid line, takes about 24 KiB.
    pub(super) const MOST_LINE_BYTES: usize = 64 << 10;

    pub(super) fn open(input: Input<'_>, options: &OpenOptions) -> Result<Self> {
        let path = input.path;
        let open = || -> io::Result<Box<dyn BufRead + Send>> {
            let mut file = input.open()?;
            let mut magic = Vec::new();
            (&mut file).take(GZIP_MAGIC.len() as u64).read_to_end(&mut magic)?;
            file.rewind()?;
            if magic == GZIP_MAGIC {
                let packed = file.len()?;
                return Ok(Box::new(BufReader::new(Unpacked::new(gzip(file), packed, &options.limits))));
            }
            Ok(Box::new(BufReader::new(file)))
        };
        let reader = open().map_err(|error| RecordingError::io(path, error))?;
        Ok(Self {
            path: path.to_owned(),
            reader,
            line: 0,
            text: Vec::new(),
            is_lenient: options.lenient,
            notes: Notes::default(),
            done: false,
        })
    }

    pub(super) fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// Number of the current line.
    pub(super) fn number(&self) -> u64 {
        self.line
    }

    /// The next line without its ending. Invalid UTF-8 is replaced. `None` at the end of the file and after an error.
    pub(super) fn next_line(&mut self) -> Result<Option<String>> {
        while !self.done {
            self.text.clear();
            let (mut read, mut ended) = (0, false);
            while !ended {
                let chunk = match self.reader.fill_buf() {
                    Ok(chunk) => chunk,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                    Err(error) => return self.stop(error),
                };
                let newline = chunk.iter().position(|&byte| byte == b'\n');
                let used = newline.map_or(chunk.len(), |at| at + 1);
                ended = newline.is_some() || used == 0;
                let kept = used.min((Self::MOST_LINE_BYTES + 1).saturating_sub(self.text.len()));
                self.text.extend_from_slice(&chunk[..kept]);
                read += used;
                self.reader.consume(used);
            }
            if read == 0 {
                self.done = true;
                break;
            }
            self.line += 1;
            if self.line == 1 && self.text.starts_with(BYTE_ORDER_MARK) {
                self.text.drain(..BYTE_ORDER_MARK.len());
            }
            if self.text.len() > Self::MOST_LINE_BYTES {
                self.damaged(
                    format_args!("a line of at most {} bytes", Self::MOST_LINE_BYTES),
                    format_args!("{read} bytes"),
                )?;
                continue;
            }
            return Ok(Some(String::from_utf8_lossy(&self.text).trim_ascii_end().to_owned()));
        }
        Ok(None)
    }

    /// Reports damage in the current line: an error that ends the reading, or a note if the reader is lenient.
    pub(super) fn damaged(&mut self, expected: impl Display, found: impl Display) -> Result<()> {
        self.damaged_in(self.line, expected, found)
    }

    /// Does the same for another line.
    pub(super) fn damaged_in(
        &mut self,
        line: u64,
        expected: impl Display,
        found: impl Display,
    ) -> Result<()> {
        let error = Mismatch::new(expected.to_string(), found.to_string()).in_line(&self.path, line);
        self.done = !self.is_lenient;
        self.notes.skip(self.is_lenient, error, "the line")
    }

    fn error(&self, expected: impl Display, found: impl Display) -> RecordingError {
        Mismatch::new(expected.to_string(), found.to_string()).in_line(&self.path, self.line)
    }

    /// Ends the reading after an error. The error is damage if the compressed data end early or cannot be decompressed,
    /// else a system error.
    fn stop(&mut self, error: io::Error) -> Result<Option<String>> {
        self.done = true;
        self.line += 1;
        if let Some(beyond) = unpacked::beyond(&error, &self.path, self.place()) {
            return Err(beyond);
        }
        let damage = [io::ErrorKind::UnexpectedEof, io::ErrorKind::InvalidInput, io::ErrorKind::InvalidData];
        if !damage.contains(&error.kind()) {
            return Err(RecordingError::io(&self.path, error));
        }
        let error = self.error("a gzip stream that is whole", error);
        if !self.is_lenient {
            return Err(error);
        }
        self.notes.skipped += 1;
        self.notes.warnings.push(format!("{error}; reading ended there"));
        Ok(None)
    }
}

/// A damaged line in quotes, shortened for an error.
pub(super) fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARS) {
        Some((end, _)) => format!("`{}…`", &text[..end]),
        None => format!("`{text}`"),
    }
}
