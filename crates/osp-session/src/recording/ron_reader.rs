use std::io::{self, BufRead, Read};
use std::path::{Path, PathBuf};

use super::{
    AUTHORS_FORMAT, Event, EventSource, Header, MAX_LINE_BYTES, Notes, OpenOptions, Place, RecordingError,
    error::Mismatch,
    members::{AuthorNumbers, Members},
    ron_line::{BadEvent, HEADER_EXPECTED, excerpt, is_blank, parse_event, parse_header},
};

/// A reader of a recording. It holds one line in memory.
///
/// A file that ends inside its last line, or inside compressed data, yields every event before its end and one warning.
/// Other damage is an error with the line's number; a lenient reader skips and counts the line.
#[derive(Debug)]
pub struct RonReader<R> {
    input: R,
    path: PathBuf,
    options: OpenOptions,
    header: Header,
    members: Members,
    buffer: Vec<u8>,
    /// Number of the line in `buffer`, from 1.
    line: u64,
    notes: Notes,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Reading,
    /// The input ended without its end mark. `notes` contains the warning.
    Cut,
    Done,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LineEnd {
    Newline,
    EndOfFile,
    /// The line is longer than [`MAX_LINE_BYTES`]. The buffer has its beginning.
    TooLong,
    /// The input has no further line.
    None,
}

impl<R: BufRead> RonReader<R> {
    /// Reads the header. Error messages name the input by `path`.
    ///
    /// # Errors
    /// The input cannot be read, or does not start with a header of a supported format.
    pub fn new(input: R, path: impl Into<PathBuf>, options: OpenOptions) -> Result<Self, RecordingError> {
        let mut reader = Self {
            input,
            path: path.into(),
            options,
            header: Header::new("", ""),
            members: Members::default(),
            buffer: Vec::new(),
            line: 0,
            notes: Notes::default(),
            state: State::Reading,
        };
        reader.header = reader.read_header()?;
        Ok(reader)
    }

    pub fn header(&self) -> &Header {
        &self.header
    }

    fn read_header(&mut self) -> Result<Header, RecordingError> {
        loop {
            let end = self.read_line()?;
            if end == LineEnd::None {
                let found = match (self.state, self.line) {
                    (State::Cut, _) => "compressed data that end before their first line does",
                    (_, 1) => "an empty file",
                    _ => "the end of the file",
                };
                return Err(self.damage(HEADER_EXPECTED, found));
            }
            let bytes =
                self.buffer.strip_prefix(b"\xEF\xBB\xBF").filter(|_| self.line == 1).unwrap_or(&self.buffer);
            if end == LineEnd::TooLong {
                let found = excerpt(&String::from_utf8_lossy(&bytes[..bytes.len().min(256)]));
                return Err(self.damage(HEADER_EXPECTED, found));
            }
            let Ok(text) = std::str::from_utf8(bytes) else {
                let found =
                    format!("bytes that are not UTF-8 text: {}", excerpt(&String::from_utf8_lossy(bytes)));
                return Err(self.damage(HEADER_EXPECTED, found));
            };
            if is_blank(text) {
                continue;
            }
            return parse_header(text.trim()).map_err(|bad| match self.state {
                State::Cut => {
                    self.damage(HEADER_EXPECTED, format!("compressed data that end after {}", excerpt(text)))
                }
                _ => bad.in_line(&self.path, self.line),
            });
        }
    }

    /// Reads the next line into the buffer, without its line ending.
    fn read_line(&mut self) -> Result<LineEnd, RecordingError> {
        self.buffer.clear();
        if self.state != State::Reading {
            return Ok(LineEnd::None);
        }
        self.line += 1;
        let limit = MAX_LINE_BYTES as u64 + 1;
        match self.input.by_ref().take(limit).read_until(b'\n', &mut self.buffer) {
            Ok(_) => {}
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
                self.state = State::Cut;
                self.notes.warnings.push(format!(
                    "{}, line {}: the compressed data end here without an end mark; everything before was read",
                    self.path.display(),
                    self.line,
                ));
            }
            Err(e) => return Err(self.failure(e)),
        }
        if self.buffer.last() == Some(&b'\n') {
            self.buffer.pop();
            return Ok(LineEnd::Newline);
        }
        Ok(match self.buffer.len() {
            0 => LineEnd::None,
            length if length > MAX_LINE_BYTES => LineEnd::TooLong,
            _ => LineEnd::EndOfFile,
        })
    }

    /// Skips the rest of a line that is too long, without storing it.
    fn skip_line(&mut self) -> Result<(), RecordingError> {
        loop {
            let buffer = match self.input.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                // The next read finds the same end and reports it.
                Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
                Err(e) => return Err(self.failure(e)),
            };
            if buffer.is_empty() {
                return Ok(());
            }
            if let Some(newline) = buffer.iter().position(|&b| b == b'\n') {
                self.input.consume(newline + 1);
                return Ok(());
            }
            let length = buffer.len();
            self.input.consume(length);
        }
    }

    /// Reads the next event; `Ok(None)` at the end of the file. The error is the fault of the next line.
    fn read_event(&mut self) -> Result<Option<Event>, RecordingError> {
        loop {
            let end = self.read_line()?;
            match end {
                LineEnd::None => return Ok(None),
                LineEnd::TooLong => {
                    let start = String::from_utf8_lossy(&self.buffer[..256]).into_owned();
                    if self.options.lenient {
                        self.skip_line()?;
                    }
                    let expected = format!("a line of at most {MAX_LINE_BYTES} bytes");
                    return Err(self.damage(expected, format!("a longer one: {}", excerpt(&start))));
                }
                LineEnd::Newline | LineEnd::EndOfFile => {}
            }
            let parsed = match std::str::from_utf8(&self.buffer) {
                Ok(text) => {
                    let text = text.trim_ascii();
                    if is_blank(text) {
                        continue;
                    }
                    parse_event(text)
                }
                Err(error) => Err(BadEvent::not_utf8(&self.buffer, error)),
            };
            match parsed {
                Ok(event) => {
                    if let Err(expected) = self.admit(&event) {
                        let found = excerpt(&String::from_utf8_lossy(&self.buffer));
                        return Err(self.damage(expected, found));
                    }
                    return Ok(Some(event));
                }
                Err(bad) if !bad.is_whole && end == LineEnd::EndOfFile => {
                    if self.state != State::Cut {
                        self.notes.warnings.push(format!(
                            "{}, line {}: the file ends inside this line; everything before was read",
                            self.path.display(),
                            self.line,
                        ));
                    }
                    return Ok(None);
                }
                Err(bad) => return Err(bad.why.in_line(&self.path, self.line)),
            }
        }
    }

    /// Checks that the recording can contain the event at this point; the error is the expected form.
    fn admit(&mut self, event: &Event) -> Result<(), String> {
        if self.header.format >= AUTHORS_FORMAT {
            // A recording that was restored from damage lacks the joins of some authors.
            return self.members.admit(event, AuthorNumbers::WithGaps).map(drop);
        }
        if event.names_author() {
            let format = self.header.format;
            return Err(format!(
                "an event without an author in a recording of format {format} (authors need {AUTHORS_FORMAT})"
            ));
        }
        Ok(())
    }

    fn damage(&self, expected: impl Into<String>, found: impl Into<String>) -> RecordingError {
        Mismatch::new(expected, found).in_line(&self.path, self.line)
    }

    /// Ends the reading after an input error, lenient or not. Damaged compressed data are reported with their line.
    fn failure(&mut self, error: io::Error) -> RecordingError {
        self.state = State::Done;
        if let Some(beyond) = super::unpacked::beyond(&error, &self.path, Place::Line(self.line)) {
            return beyond;
        }
        if error.raw_os_error().is_none()
            && matches!(error.kind(), io::ErrorKind::Other | io::ErrorKind::InvalidData)
        {
            self.damage("undamaged compressed data", error.to_string())
        } else {
            RecordingError::io(Path::new(&self.path), error)
        }
    }
}

impl<R: BufRead + Send> EventSource for RonReader<R> {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        loop {
            match self.read_event() {
                Ok(Some(event)) => return Ok(Some(event)),
                Ok(None) => {
                    self.state = State::Done;
                    return Ok(None);
                }
                Err(error @ RecordingError::Line { .. }) if self.options.lenient => {
                    self.notes.skipped += 1;
                    if self.state == State::Done {
                        self.notes.warnings.push(format!("{error}; nothing after it can be read"));
                        return Ok(None);
                    }
                    if self.notes.skipped == 1 {
                        self.notes.warnings.push(format!("skipped, the first of the damaged lines: {error}"));
                    }
                }
                Err(error) => {
                    self.state = State::Done;
                    return Err(error);
                }
            }
        }
    }

    fn line(&self) -> Option<&str> {
        std::str::from_utf8(&self.buffer).ok().map(str::trim_ascii)
    }

    fn notes(&self) -> Notes {
        self.notes.clone()
    }

    fn place(&self) -> Place {
        Place::Line(self.line)
    }
}
