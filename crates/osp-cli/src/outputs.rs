//! The files that a command writes. They are checked before the work begins, and written whole or not at all.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use clap::Args;

use super::output;
use osp_session::{
    atomic_file::{AtomicFile, Destination},
    output_file::{OutputError, check_new_output, check_output, files_read_with},
};

/// The option of every command that writes files.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct ForceArgs {
    /// Overwrite any output, never an input.
    #[arg(long)]
    pub(super) force: bool,
}

impl ForceArgs {
    /// Creates the list of a command's files.
    pub(super) fn outputs(self) -> Outputs {
        Outputs::new(self.force)
    }
}

/// The files that a command reads and writes.
pub(super) struct Outputs {
    force: bool,
    inputs: Vec<PathBuf>,
    outputs: Vec<PathBuf>,
}

impl Outputs {
    /// Creates the list. With `force`, an output may replace a file, but never an input.
    pub(super) fn new(force: bool) -> Self {
        Self { force, inputs: Vec::new(), outputs: Vec::new() }
    }

    /// Adds files or folders that the command reads, and the other files of these sessions.
    #[must_use]
    pub(super) fn reads<'a>(mut self, paths: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.inputs.extend(paths.into_iter().flat_map(|path| files_read_with(path)));
        self
    }

    /// Checks an output before the work begins. Its name must have one of the endings, if there are any.
    pub(super) fn add(&mut self, path: &Path, endings: &'static [&'static str]) -> anyhow::Result<Output> {
        self.check(path, endings, self.force)
    }

    /// Checks a file that the command reads and to which it adds.
    pub(super) fn adds_to(
        &mut self,
        path: &Path,
        endings: &'static [&'static str],
    ) -> anyhow::Result<Output> {
        self.check(path, endings, true)
    }

    /// Checks an output, if the option for it was given.
    pub(super) fn add_any(
        &mut self,
        path: Option<&PathBuf>,
        endings: &'static [&'static str],
    ) -> anyhow::Result<Option<Output>> {
        path.map(|path| self.add(path, endings)).transpose()
    }

    fn check(
        &mut self,
        path: &Path,
        endings: &'static [&'static str],
        force: bool,
    ) -> anyhow::Result<Output> {
        let destination = check_new_output(path, endings, force, &self.inputs, &self.outputs);
        if destination.map_err(in_words)? == Destination::StandardOutput {
            output::keep_standard_output_for_a_file();
        }
        self.outputs.push(path.to_owned());
        Ok(Output { path: path.to_owned(), endings, force })
    }

    /// Checks the paths of pictures in an existing folder. Their names differ.
    #[cfg(feature = "render")]
    pub(super) fn add_pictures(&self, mut paths: impl Iterator<Item = PathBuf>) -> anyhow::Result<()> {
        paths.try_for_each(|path| {
            check_new_output(&path, &[], self.force, &self.inputs, &[]).map(drop).map_err(in_words)
        })
    }

    /// Writes a picture whose path was checked before it was drawn.
    #[cfg(feature = "render")]
    pub(super) fn write_picture(&self, path: &Path, image: &osp_render::Image) -> anyhow::Result<()> {
        let output = Output { path: path.to_owned(), endings: &[], force: self.force };
        output.write_by(|file| image.write_png_to(file))
    }
}

#[derive(Clone, Debug)]
pub(super) struct Output {
    path: PathBuf,
    endings: &'static [&'static str],
    force: bool,
}

/// Names the option that replaces a file.
fn in_words(error: OutputError) -> anyhow::Error {
    match error {
        OutputError::Exists { .. } => anyhow!("{error}; --force replaces it"),
        error => error.into(),
    }
}

/// Returns the ending of a file's name in lower case, without the dot.
#[cfg(any(feature = "bench", feature = "render"))]
pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

impl Output {
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns an error if the output would replace a file that must not be lost. Such a file may have appeared since
    /// the check before the work.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        check_output(&self.path, self.endings, self.force).map_err(in_words)
    }

    /// Starts a file that is written in parts and appears with [`Output::commit`].
    pub(super) fn create(&self) -> anyhow::Result<AtomicFile> {
        AtomicFile::create(&self.path).map_err(|error| self.failed(&error))
    }

    /// Gives the file its name. Returns its size in bytes if it is a file.
    pub(super) fn commit(&self, file: AtomicFile) -> anyhow::Result<Option<u64>> {
        self.check()?;
        // Does not replace a file that appears after the check, either.
        let outcome = if self.force { file.commit() } else { file.commit_new() };
        outcome.map_err(|error| self.failed(&error))
    }

    /// Writes the whole file.
    #[cfg(feature = "bench")]
    pub(super) fn write(&self, bytes: &[u8]) -> anyhow::Result<()> {
        self.write_by(|file| file.write_all(bytes))
    }

    /// Writes the whole file by a function.
    pub(super) fn write_by(
        &self,
        write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        let mut file = self.create()?;
        write(&mut file).map_err(|error| self.failed(&error))?;
        self.commit(file).map(drop)
    }

    fn failed(&self, error: &io::Error) -> anyhow::Error {
        anyhow!("{}: {error}", self.path.display())
    }
}
