//! The table of a study in either of its forms: one row a session and index.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Write},
    path::{Path, PathBuf},
};

use thiserror::Error;

#[cfg(feature = "parquet")]
use super::parquet_table::{ParquetReader, ParquetWriter};
use super::{
    StudyRow,
    line_table::{LineReader, LineWriter},
};
use osp_session::output_file::{PARQUET_START, STUDY_START};

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// A line of JSON for each row, UTF-8: the fields of [`StudyRow`]. Names end in `.ndjson`.
    Lines,
    /// Parquet with the columns of [`StudyRow`]. Names end in `.parquet`. Only builds with the feature `parquet` have it.
    Parquet,
}

impl TableFormat {
    /// The format by the ending of a name.
    pub fn named_by(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        if ending.eq_ignore_ascii_case("ndjson") {
            Some(Self::Lines)
        } else if ending.eq_ignore_ascii_case("parquet") {
            Some(Self::Parquet)
        } else {
            None
        }
    }

    /// The format by the first bytes of a file. Only [`StudyReader`] checks the rest.
    pub fn of_start(start: &[u8]) -> Option<Self> {
        if start.starts_with(STUDY_START) {
            Some(Self::Lines)
        } else if start.starts_with(PARQUET_START) {
            Some(Self::Parquet)
        } else {
            None
        }
    }

    /// Whether this build reads and writes it.
    pub fn is_built(self) -> bool {
        match self {
            Self::Lines => true,
            Self::Parquet => cfg!(feature = "parquet"),
        }
    }
}

/// A table that cannot be used.
#[derive(Debug, Error)]
pub enum StudyError {
    /// It cannot be read or written.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// It is something else.
    #[error("{}: expected the results of `osp study` (.ndjson or .parquet); found {found}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// It is damaged.
    #[error("{}: expected a whole table of `osp study`; {cause}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        cause: String,
    },
    /// It is Parquet, which this build lacks.
    #[error(
        "{}: Parquet needs a build with the feature `parquet`, which this one lacks: \
         cargo install --path crates/osp-cli --features parquet; \
         tables whose name ends in .ndjson are in every build", path.display()
    )]
    NotBuilt {
        /// The file.
        path: PathBuf,
    },
}

/// Writes rows as they come.
#[derive(Debug)]
pub struct StudyWriter<W: Write + Send>(Writer<W>);

#[derive(Debug)]
enum Writer<W: Write + Send> {
    Lines(LineWriter<W>),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter<W>>),
}

impl<W: Write + Send> StudyWriter<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// `out` cannot be written, or this build lacks the format.
    pub fn new(out: W, format: TableFormat) -> io::Result<Self> {
        Ok(Self(match format {
            TableFormat::Lines => Writer::Lines(LineWriter::new(out)),
            #[cfg(feature = "parquet")]
            TableFormat::Parquet => Writer::Parquet(Box::new(ParquetWriter::new(out)?)),
            #[cfg(not(feature = "parquet"))]
            TableFormat::Parquet => {
                return Err(io::Error::new(
                    io::ErrorKind::Unsupported,
                    "this build lacks the feature `parquet`",
                ));
            }
        }))
    }

    /// Adds a row.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, row: StudyRow) -> io::Result<()> {
        match &mut self.0 {
            Writer::Lines(writer) => writer.write(&row),
            #[cfg(feature = "parquet")]
            Writer::Parquet(writer) => writer.write(row),
        }
    }

    /// Ends the table. Returns the output and the number of rows.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(self) -> io::Result<(W, u64)> {
        match self.0 {
            Writer::Lines(writer) => Ok(writer.finish()),
            #[cfg(feature = "parquet")]
            Writer::Parquet(writer) => writer.finish(),
        }
    }
}

/// Whether a file is the table of a study.
pub fn is_study(path: &Path) -> bool {
    StudyReader::open(path).is_ok()
}

/// Reads the rows of a table, one after the other. The content of the file determines the format.
#[derive(Debug)]
pub struct StudyReader(Reader);

#[derive(Debug)]
enum Reader {
    Lines(Box<LineReader>),
    #[cfg(feature = "parquet")]
    Parquet(ParquetReader),
}

impl StudyReader {
    /// Opens a table.
    ///
    /// # Errors
    /// It cannot be read, is not the table of a study, or has a format that this build lacks.
    pub fn open(path: &Path) -> Result<Self, StudyError> {
        let io = |cause| StudyError::Io { path: path.to_owned(), cause };
        if !std::fs::metadata(path).map_err(io)?.is_file() {
            return Err(StudyError::Other { path: path.to_owned(), found: "no regular file".to_owned() });
        }
        let mut file = BufReader::new(File::open(path).map_err(io)?);
        let start = file.fill_buf().map_err(io)?;
        let found = if start.is_empty() { "an empty file" } else { "a file of another kind" };
        match TableFormat::of_start(start) {
            Some(TableFormat::Lines) => {
                LineReader::open(path, file).map(|reader| Self(Reader::Lines(Box::new(reader))))
            }
            #[cfg(feature = "parquet")]
            Some(TableFormat::Parquet) => {
                // The buffered bytes are read again: the Parquet reader seeks in the file.
                ParquetReader::open(path, file.into_inner()).map(|reader| Self(Reader::Parquet(reader)))
            }
            #[cfg(not(feature = "parquet"))]
            Some(TableFormat::Parquet) => Err(StudyError::NotBuilt { path: path.to_owned() }),
            // A shard may have no session, and its table no row.
            None if start.is_empty() && TableFormat::named_by(path) == Some(TableFormat::Lines) => {
                LineReader::open(path, file).map(|reader| Self(Reader::Lines(Box::new(reader))))
            }
            None => Err(StudyError::Other { path: path.to_owned(), found: found.to_owned() }),
        }
    }
}

impl Iterator for StudyReader {
    type Item = Result<StudyRow, StudyError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.0 {
            Reader::Lines(reader) => reader.next(),
            #[cfg(feature = "parquet")]
            Reader::Parquet(reader) => reader.next(),
        }
    }
}
