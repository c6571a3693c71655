use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::ron_file::{self, RecordingFile};
use super::ron_line::{excerpt, write_event, write_header};
use super::{AUTHORS_FORMAT, Event, Header, MAX_LINE_BYTES, RecordingError};

/// Bytes that [`Flush::AtEnd`] collects before they are written.
const PENDING_BYTES: usize = 1 << 16;

/// Contents allowed in formats before [`AUTHORS_FORMAT`].
const NO_AUTHORS: &str = "an event without an author, or a header of format 4";

/// When events reach the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flush {
    /// At once, each as one whole line in one write: a crash loses at most the line being written. For a session
    /// that is being drawn.
    #[default]
    EachEvent,
    /// In large pieces of whole lines. For generated and converted sessions; compresses far better.
    AtEnd,
}

/// Writes a recording: the header, then one event a line. Every number is written with the fewest digits that read
/// back to the same bits. A session written twice gives the same bytes.
#[derive(Debug)]
pub struct RonWriter<W: Write> {
    out: W,
    path: PathBuf,
    flush: Flush,
    /// Whole lines that are not written yet.
    pending: String,
    /// Lines written or pending.
    lines: u64,
    /// The header's format has authors.
    knows_authors: bool,
    /// A write has failed, perhaps in the middle of a line: nothing may follow it.
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

    /// A writer that continues after `lines` lines.
    fn resume(out: W, path: PathBuf, flush: Flush, lines: u64, header: &Header) -> Self {
        let knows_authors = header.format >= AUTHORS_FORMAT;
        Self { out, path, flush, pending: String::new(), lines, knows_authors, failed: false }
    }

    /// Writes an event. After an error of the output every further call fails: a torn line must stay the last one.
    /// [`RonWriter::append`] cuts it off and continues.
    ///
    /// # Errors
    /// The event does not pass [`Event::check`], names an author in a format without authors, or is longer than a line
    /// may be. Then nothing is written, and the writer continues. Or the output fails.
    pub fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        let is_known = self.knows_authors || !event.names_author();
        let check = event.check().and(if is_known { Ok(()) } else { Err(NO_AUTHORS) });
        self.push_line(check, |line| write_event(line, event))
    }

    /// Writes an event as the line that it was read from, see [`EventSource::line`](super::EventSource::line).
    ///
    /// # Errors
    /// The output fails.
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
    /// The output fails, now or earlier.
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

    /// The output.
    pub fn get_ref(&self) -> &W {
        &self.out
    }

    /// Lines of the recording so far, the header among them.
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
            return Err(RecordingError::Line {
                path: self.path.clone(),
                line: self.lines + 1,
                expected,
                found,
            });
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
    /// Starts a recording in a file, which is replaced if it exists. A name that ends in `.zst` is compressed.
    ///
    /// # Errors
    /// The header is invalid, or the file cannot be written.
    pub fn create(path: &Path, header: &Header, flush: Flush) -> Result<Self, RecordingError> {
        Self::new(RecordingFile::create(path)?, path, header, flush)
    }

    /// Continues a recording, for instance after a crash; returns its header, too. A torn last line is cut off first.
    ///
    /// # Errors
    /// The file is no recording of a known format, its compressed data are damaged, or it cannot be written.
    pub fn append(path: &Path, flush: Flush) -> Result<(Self, Header), RecordingError> {
        let (file, header, lines) = ron_file::append(path)?;
        Ok((Self::resume(file, path.to_owned(), flush, lines, &header), header))
    }

    /// Writes what is pending and closes the file. A compressed file gets its end mark; without this call it does so
    /// when the writer is dropped, but then an error is lost.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.flush()?;
        self.out.finish().map_err(|e| RecordingError::io(&self.path, e))
    }
}

impl<W: Write> Drop for RonWriter<W> {
    fn drop(&mut self) {
        if !self.failed && !self.pending.is_empty() {
            // `finish` and `flush` return the error; here it is lost.
            let _ = self.flush();
        }
    }
}
