//! The table of a study as lines of JSON: a row a line, of any length in all, one of them in memory.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Write},
    path::{Path, PathBuf},
};

use super::{StudyError, StudyRow};

/// Longest line that is read: names, errors and remarks are far shorter.
const MOST_LINE_BYTES: u64 = 16 << 20;

#[derive(Debug)]
pub(super) struct LineWriter<W> {
    out: W,
    written: u64,
}

impl<W: Write> LineWriter<W> {
    pub(super) fn new(out: W) -> Self {
        Self { out, written: 0 }
    }

    pub(super) fn write(&mut self, row: &StudyRow) -> io::Result<()> {
        let mut line = serde_json::to_vec(row).map_err(io::Error::other)?;
        line.push(b'\n');
        self.written += 1;
        self.out.write_all(&line)
    }

    pub(super) fn finish(self) -> (W, u64) {
        (self.out, self.written)
    }
}

#[derive(Debug)]
pub(super) struct LineReader {
    path: PathBuf,
    /// `None` after an error: what follows may be anything.
    lines: Option<BufReader<File>>,
    /// Lines that were read.
    line: u64,
    /// The first row, which shows that this is a table.
    first: Option<StudyRow>,
}

impl LineReader {
    pub(super) fn open(path: &Path, file: BufReader<File>) -> Result<Self, StudyError> {
        let mut reader = Self { path: path.to_owned(), lines: Some(file), line: 0, first: None };
        reader.first = reader.read().transpose()?;
        Ok(reader)
    }

    fn read(&mut self) -> Option<Result<StudyRow, StudyError>> {
        let lines = self.lines.as_mut()?;
        let mut line = Vec::new();
        self.line += 1;
        let row = match lines.take(MOST_LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(0) => return None,
            Ok(_) if line.last() == Some(&b'\n') => serde_json::from_slice(&line).map_err(|error| {
                self.damaged(&format!("column {}: {}", error.column(), without_place(&error)))
            }),
            Ok(_) => Err(self.damaged("expected a line end")),
            Err(cause) => Err(StudyError::Io { path: self.path.clone(), cause }),
        };
        if row.is_err() {
            self.lines = None;
        }
        Some(row)
    }

    fn damaged(&self, what: &str) -> StudyError {
        StudyError::Damaged { path: self.path.clone(), cause: format!("line {}: {what}", self.line) }
    }

    pub(super) fn next(&mut self) -> Option<Result<StudyRow, StudyError>> {
        self.first.take().map(Ok).or_else(|| self.read())
    }
}

/// The error without serde_json's place, which counts lines from the row.
fn without_place(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line ").map_or(text.clone(), |(what, _)| what.to_owned())
}
