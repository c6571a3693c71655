//! A recording that a command writes. The file appears under its name only when it is complete.

use std::io;

use super::outputs::Output;
use osp_session::{
    atomic_file::AtomicFile,
    recording::{Event, Flush, Header, RecordingError, RecordingFile, RonWriter},
};

/// A recording that is being written.
pub(super) struct NewRecording {
    // Rust drops fields in this order, so the writer closes before the file gets its name or is removed.
    writer: RonWriter<RecordingFile>,
    file: AtomicFile,
    output: Output,
    /// Whether the reader of the pipe has closed it, which is no error.
    nobody_reads: bool,
}

impl NewRecording {
    /// Creates a temporary file in the folder of the output.
    pub(super) fn create(output: Output, header: &Header) -> anyhow::Result<Self> {
        let path = output.path();
        let mut file = output.create()?;
        let under = file.handle().and_then(|handle| RecordingFile::over(handle, path));
        let under = under.map_err(|error| RecordingError::io(path, error))?;
        let writer = RonWriter::new(under, path, header, Flush::AtEnd)?;
        Ok(Self { writer, file, output, nobody_reads: false })
    }

    /// Appends an event.
    pub(super) fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        if !self.nobody_reads {
            self.nobody_reads = !is_read(self.writer.write(event))?;
        }
        Ok(())
    }

    /// Gives the recording its name. Returns its size in bytes if it is a file.
    pub(super) fn finish(self) -> anyhow::Result<Option<u64>> {
        if !self.nobody_reads {
            is_read(self.writer.finish())?;
        }
        self.output.commit(self.file)
    }
}

/// Whether the output still has a reader.
fn is_read(written: Result<(), RecordingError>) -> Result<bool, RecordingError> {
    match written {
        Ok(()) => Ok(true),
        Err(RecordingError::Io { cause, .. }) if cause.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(error),
    }
}
