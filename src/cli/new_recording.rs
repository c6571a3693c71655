//! A recording that a command makes: it appears under its name only once it is whole.

use std::{
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};

use crate::recording::{Event, Flush, Header, RecordingError, RecordingFile, RonWriter};

/// Says no to an output that is not named as a recording, or that exists without `--force`.
pub(super) fn check_output(output: &Path, force: bool) -> anyhow::Result<()> {
    let name = output.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
    let is_recording = name.is_some_and(|name| name.ends_with(".ron") || name.ends_with(".ron.zst"));
    ensure!(is_recording, "{}: expected a name that ends in .ron or .ron.zst", output.display());
    ensure!(force || !output.exists(), "{}: exists already; --force replaces it", output.display());
    Ok(())
}

/// A recording on its way into a file.
pub(super) struct NewRecording {
    // Closed before the file is removed or renamed: fields are dropped in their order.
    writer: RonWriter<RecordingFile>,
    unfinished: Unfinished,
    output: PathBuf,
}

impl NewRecording {
    /// Starts the recording beside `output`.
    pub(super) fn create(output: &Path, header: &Header) -> anyhow::Result<Self> {
        let unfinished = Unfinished::beside(output);
        let writer =
            RonWriter::create(&unfinished.0, header, Flush::AtEnd).map_err(|error| named(error, output))?;
        Ok(Self { writer, unfinished, output: output.to_owned() })
    }

    /// Appends an event.
    pub(super) fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.writer.write(event).map_err(|error| named(error, &self.output))
    }

    /// Gives the recording its name; its size in bytes.
    pub(super) fn finish(self) -> anyhow::Result<u64> {
        self.writer.finish().map_err(|error| named(error, &self.output))?;
        let context = || self.output.display().to_string();
        fs::rename(&self.unfinished.0, &self.output).with_context(context)?;
        Ok(fs::metadata(&self.output).with_context(context)?.len())
    }
}

/// The error with the name that was asked for, not the one that the file has for the moment.
fn named(mut error: RecordingError, output: &Path) -> RecordingError {
    let (RecordingError::Io { path, .. }
    | RecordingError::Line { path, .. }
    | RecordingError::Byte { path, .. }
    | RecordingError::Limit { path, .. }
    | RecordingError::Unknown { path, .. }) = &mut error;
    output.clone_into(path);
    error
}

/// A file that is removed unless it gets another name.
struct Unfinished(PathBuf);

impl Unfinished {
    /// A name beside `output`, with the same ending, because the ending decides about compression.
    fn beside(output: &Path) -> Self {
        let mut name = OsString::from(format!(".unfinished-{}-", std::process::id()));
        name.push(output.file_name().unwrap_or_default());
        Self(output.with_file_name(name))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // After the rename there is nothing to remove.
        let _ = fs::remove_file(&self.0);
    }
}
