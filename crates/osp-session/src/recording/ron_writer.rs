use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::ron_file::{self, RecordingFile};
use super::ron_line::{excerpt, write_event, write_header};
use super::{AUTHORS_FORMAT, Event, Header, MAX_LINE_BYTES, RecordingError, error::Mismatch};

/// Number of bytes that [`Flush::AtEnd`] collects before a write.
const PENDING_BYTES: usize = 1 << 16;

const NO_AUTHORS: &str = "an event without an author, or a header of format 4";

/// Time at which events are written to the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flush {
    /// Each event is written at once, as one complete line in one write. A crash loses at most the line being written.
    /// Used for a session that is being drawn.
    #[default]
    EachEvent,
    /// Large blocks of complete lines are written. Used for generated and converted sessions, because large blocks
    /// compress far better.
    AtEnd,
}

/// A writer of recordings: the header, then one event per line. Every number has the fewest digits that read back to
/// the same bits. Equal sessions give equal bytes.
#[derive(Debug)]
pub struct RonWriter<W: Write> {
    out: W,
    path: PathBuf,
    flush: Flush,
    /// Complete lines that are not written yet.
    pending: String,
    /// Number of lines, written or pending.
    lines: u64,
    /// Whether the header's format supports authors.
    has_authors: bool,
    /// Whether a write has failed, perhaps in the middle of a line. No write may follow, because an incomplete line
    /// must be the last.
    failed: bool,
}

impl<W: Write> RonWriter<W> {
    /// Starts a recording. Error messages name the output by `path`.
    ///
    /// # Errors
    /// The header is invalid or cannot be written.
    pub fn new(
        out: W,
        path: impl Into<PathBuf>,
        header: &Header,
        flush: Flush,
    ) -> Result<Self, RecordingError> {
        let mut writer = Self::resume(out, path.into(), flush, 0, header);
        let check = header.check();
        writer.push_line(check, |line| write_header(line, header))?;
        Ok(writer)
    }

    fn resume(out: W, path: PathBuf, flush: Flush, lines: u64, header: &Header) -> Self {
        let has_authors = header.format >= AUTHORS_FORMAT;
        Self { out, path, flush, pending: String::new(), lines, has_authors, failed: false }
    }

    /// Writes an event. After an error of the output every further call fails, because an incomplete
    /// line must be the last. [`RonWriter::append`] removes that line and continues.
    ///
    /// # Errors
    /// The event does not pass [`Event::check`], has an author in a format without authors, or does not fit into a
    /// line. After these errors the writer can continue. Or the output fails.
    pub fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        let is_known = self.has_authors || !event.names_author();
        let check = event.check().and(if is_known { Ok(()) } else { Err(NO_AUTHORS) });
        self.push_line(check, |line| write_event(line, event))
    }

    /// Writes the line that an event was read from, see [`EventSource::line`](super::EventSource::line).
    pub fn write_line(&mut self, line: &str) -> Result<(), RecordingError> {
        self.push_line(Ok(()), |pending| {
            pending.push_str(line);
            pending.push('\n');
            Ok(())
        })
    }

    /// Writes all pending lines to the output and flushes it.
    ///
    /// # Errors
    /// The output fails, in this call or earlier.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        if self.failed {
            let error = io::Error::other("an earlier write has failed; nothing can follow it");
            return Err(RecordingError::io(&self.path, error));
        }
        let written = self.out.write_all(self.pending.as_bytes()).and_then(|()| self.out.flush());
        self.pending.clear();
        self.failed = written.is_err();
        written.map_err(|e| RecordingError::io(&self.path, e))
    }

    pub fn get_ref(&self) -> &W {
        &self.out
    }

    /// Number of lines of the recording so far, including the header.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    fn push_line(
        &mut self,
        check: Result<(), &'static str>,
        write: impl FnOnce(&mut String) -> Result<(), ron::Error>,
    ) -> Result<(), RecordingError> {
        let start = self.pending.len();
        let refused = match write(&mut self.pending) {
            Err(error) => Some(("a value that RON can hold".to_owned(), error.to_string())),
            Ok(()) => {
                let line = &self.pending[start..];
                let too_long = line.len() > MAX_LINE_BYTES + 1;
                let expected = match check {
                    Err(expected) => Some(expected.to_owned()),
                    Ok(()) => too_long.then(|| format!("a line of at most {MAX_LINE_BYTES} bytes")),
                };
                expected.map(|expected| (expected, excerpt(line)))
            }
        };
        if let Some((expected, found)) = refused {
            self.pending.truncate(start);
            return Err(Mismatch { expected, found }.in_line(&self.path, self.lines + 1));
        }
        self.lines += 1;
        match self.flush {
            Flush::EachEvent => self.flush(),
            Flush::AtEnd if self.pending.len() >= PENDING_BYTES => self.flush(),
            Flush::AtEnd => Ok(()),
        }
    }
}

impl RonWriter<RecordingFile> {
    /// Starts a recording in a file, which is replaced if it exists. If the name ends in `.zst`, the file is
    /// compressed.
    ///
    /// # Errors
    /// The header is invalid, or the file cannot be written.
    pub fn create(path: &Path, header: &Header, flush: Flush) -> Result<Self, RecordingError> {
        Self::new(RecordingFile::create(path)?, path, header, flush)
    }

    /// Continues a recording, for instance after a crash; also returns its header. An incomplete last line is removed
    /// first.
    ///
    /// # Errors
    /// The file is no recording of a supported format, its compressed data are damaged, or it cannot be written.
    pub fn append(path: &Path, flush: Flush) -> Result<(Self, Header), RecordingError> {
        let (file, header, lines) = ron_file::append(path)?;
        Ok((Self::resume(file, path.to_owned(), flush, lines, &header), header))
    }

    /// Writes the pending lines and closes the file. A compressed file gets its end mark. Without this call, the drop
    /// of the writer does the same, but ignores errors.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.flush()?;
        self.out.finish().map_err(|e| RecordingError::io(&self.path, e))
    }
}

impl<W: Write> Drop for RonWriter<W> {
    fn drop(&mut self) {
        if !self.failed && !self.pending.is_empty() {
            // Drop ignores the error. Callers that need it call `finish` or `flush`.
            let _ = self.flush();
        }
    }
}
