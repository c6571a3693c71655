//! The table of a study as a Parquet file: one row a session and index, without arrow.

use std::{
    cell::Cell,
    fs::File,
    io::{self, Write},
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    sync::{Arc, Once},
};

use super::{StudyError, StudyRow};
use parquet::{
    basic::{Compression, ZstdLevel},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::WriterProperties,
        reader::{FileReader, SerializedFileReader},
        writer::SerializedFileWriter,
    },
    record::{RecordWriter, reader::RowIter},
};

/// What says in a Parquet file that it is a study, and of which form.
const MARK: (&str, &str) = ("osp.study", "1");
/// Rows that are gathered before they are written: what a writer holds in memory.
const ROWS_OF_A_GROUP: usize = 8192;

/// Writes rows as they come, a group at a time.
pub(super) struct ParquetWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    rows: Vec<StudyRow>,
    written: u64,
}

impl<W: Write + Send> std::fmt::Debug for ParquetWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ParquetWriter").field("written", &self.written).finish_non_exhaustive()
    }
}

impl<W: Write + Send> ParquetWriter<W> {
    pub(super) fn new(out: W) -> io::Result<Self> {
        let mark = KeyValue::new(MARK.0.to_owned(), MARK.1.to_owned());
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(format!("osp version {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(vec![mark]))
            .build();
        let none: &[StudyRow] = &[];
        let schema = none.schema().map_err(io::Error::other)?;
        let file = SerializedFileWriter::new(out, schema, Arc::new(properties)).map_err(io_error)?;
        Ok(Self { file, rows: Vec::new(), written: 0 })
    }

    pub(super) fn write(&mut self, row: StudyRow) -> io::Result<()> {
        self.rows.push(row);
        self.written += 1;
        if self.rows.len() == ROWS_OF_A_GROUP { self.write_group() } else { Ok(()) }
    }

    fn write_group(&mut self) -> io::Result<()> {
        let mut group = self.file.next_row_group().map_err(io_error)?;
        self.rows.as_slice().write_to_row_group(&mut group).map_err(io_error)?;
        group.close().map_err(io_error)?;
        self.rows.clear();
        Ok(())
    }

    pub(super) fn finish(mut self) -> io::Result<(W, u64)> {
        if !self.rows.is_empty() {
            self.write_group()?;
        }
        Ok((self.file.into_inner().map_err(io_error)?, self.written))
    }
}

fn io_error(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(cause) => match cause.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(cause) => io::Error::other(cause),
        },
        error => io::Error::other(error),
    }
}

/// Calls the reader of Parquet, which stops with a panic at some damage: that is an error like any other, without the words that
/// a panic prints.
fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    thread_local! {
        static IS_QUIET: Cell<bool> = const { Cell::new(false) };
    }
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                others(info);
            }
        }));
    });
    IS_QUIET.set(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(read));
    IS_QUIET.set(false);
    outcome.unwrap_or_else(|_| Err("a count or a length in it cannot be".to_owned()))
}

/// Reads the rows of a table, one after the other.
pub(super) struct ParquetReader {
    path: PathBuf,
    /// `None` after an error: then nothing is known of what follows.
    rows: Option<RowIter<'static>>,
}

impl std::fmt::Debug for ParquetReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ParquetReader").field("path", &self.path).finish_non_exhaustive()
    }
}

impl ParquetReader {
    /// Opens a file that begins as Parquet does.
    pub(super) fn open(path: &Path, file: File) -> Result<Self, StudyError> {
        let other = |found: &str| StudyError::Other { path: path.to_owned(), found: found.to_owned() };
        let damaged = |cause| StudyError::Damaged { path: path.to_owned(), cause };
        let reader = guarded(|| SerializedFileReader::new(file).map_err(|error| error.to_string()))
            .map_err(damaged)?;
        let metadata = reader.metadata().file_metadata();
        let marked = metadata.key_value_metadata().into_iter().flatten().find(|entry| entry.key == MARK.0);
        match marked.map(|entry| entry.value.as_deref().unwrap_or_default()) {
            Some(form) if form == MARK.1 => {}
            Some(form) => return Err(other(&format!("those of another version (form {form})"))),
            None => return Err(other("a table of another program")),
        }
        let rows = guarded(|| Ok(RowIter::from_file_into(Box::new(reader)))).map_err(damaged)?;
        Ok(Self { path: path.to_owned(), rows: Some(rows) })
    }

    pub(super) fn next(&mut self) -> Option<Result<StudyRow, StudyError>> {
        let rows = self.rows.as_mut()?;
        let row = guarded(|| {
            let row = rows.next().transpose().map_err(|error| error.to_string())?;
            row.map(|row| serde_json::from_value(row.to_json_value())).transpose().map_err(|e| e.to_string())
        });
        if row.is_err() {
            self.rows = None;
        }
        let damaged = |cause| StudyError::Damaged { path: self.path.clone(), cause };
        row.map_err(damaged).transpose()
    }
}
