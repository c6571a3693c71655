//! The files that a command writes. They are checked before the work begins, and written whole or not at all.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};
use clap::Args;

use super::output;
#[cfg(feature = "bench")]
use osp_session::atomic_file::write_atomically;
use osp_session::{
    atomic_file::{AtomicFile, Destination},
    output_file::{OutputError, check_output, is_same_file, lies_in},
    recording::import::files_beside,
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
    /// Each output with the option that named it.
    outputs: Vec<(String, PathBuf)>,
}

impl Outputs {
    /// Creates the list. With `force`, an output may replace a file, but never an input.
    pub(super) fn new(force: bool) -> Self {
        Self { force, inputs: Vec::new(), outputs: Vec::new() }
    }

    /// Adds files or folders that the command reads.
    #[must_use]
    pub(super) fn reads<'a>(mut self, paths: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.inputs.extend(paths.into_iter().cloned());
        self
    }

    fn is_no_input(&self, option: &str, path: &Path) -> anyhow::Result<()> {
        // Standard output may lead to a file that is an input.
        let is_standard_output = path == Path::new("-") && cfg!(unix);
        let place = if is_standard_output { Path::new("/dev/stdout") } else { path };
        for input in &self.inputs {
            // Another file of the same session can be the output only if it exists.
            let is_beside =
                || place.exists() && files_beside(input).iter().any(|beside| is_same_file(place, beside));
            if is_same_file(place, input) || is_beside() {
                bail!("{}: is an input, too; {option} must name another file", path.display());
            }
            if input.is_dir() && lies_in(place, input) {
                let folder = input.display();
                bail!("{}: lies in the input {folder}; {option} must name a file elsewhere", path.display());
            }
        }
        Ok(())
    }

    /// Checks an output before the work begins. `option` is the option that named it. Its name must have one of the
    /// endings, if there are any.
    pub(super) fn add(
        &mut self,
        option: &str,
        path: &Path,
        endings: &'static [&'static str],
    ) -> anyhow::Result<Output> {
        self.is_no_input(option, path)?;
        let destination = Destination::of(path).with_context(|| path.display().to_string())?;
        let is_written_twice = |other: &Path| match (&destination, Destination::of(other)) {
            (Destination::File(_), Ok(Destination::File(_))) => is_same_file(path, other),
            // Two outputs to the same device do not replace each other, but their bytes would be mixed.
            (Destination::StandardOutput, Ok(other)) => other == Destination::StandardOutput,
            (Destination::Special(here), Ok(Destination::Special(there))) => {
                *here == there && here != Path::new("/dev/null")
            }
            _ => false,
        };
        if let Some((other, _)) = self.outputs.iter().find(|(_, other)| is_written_twice(other)) {
            bail!("{}: {other} and {option} cannot both write it", path.display());
        }
        let output = Output { path: path.to_owned(), endings, force: self.force };
        output.check()?;
        if destination == Destination::StandardOutput {
            output::keep_standard_output_for_a_file();
        }
        if matches!(destination, Destination::File(_)) {
            // Creates a temporary file, to find out whether the folder is writable.
            output.create()?;
        }
        self.outputs.push((option.to_owned(), path.to_owned()));
        Ok(output)
    }

    /// Checks the paths of pictures in an existing folder.
    #[cfg(feature = "render")]
    pub(super) fn add_pictures(
        &self,
        option: &str,
        paths: impl Iterator<Item = PathBuf>,
    ) -> anyhow::Result<()> {
        // The names of the pictures differ. Creating the first one finds out whether the folder is writable.
        for (i, path) in paths.enumerate() {
            self.is_no_input(option, &path)?;
            let output = Output { path, endings: &[], force: self.force };
            output.check()?;
            if i == 0 {
                output.create()?;
            }
        }
        Ok(())
    }

    /// Checks a file that the command reads and to which it adds.
    pub(super) fn adds_to(
        &mut self,
        option: &str,
        path: &Path,
        endings: &'static [&'static str],
    ) -> anyhow::Result<Output> {
        let force = std::mem::replace(&mut self.force, true);
        let output = self.add(option, path, endings);
        self.force = force;
        output
    }

    /// Checks an output, if the option for it was given.
    pub(super) fn add_any(
        &mut self,
        option: &str,
        path: Option<&PathBuf>,
        endings: &'static [&'static str],
    ) -> anyhow::Result<Option<Output>> {
        path.map(|path| self.add(option, path, endings)).transpose()
    }
}

/// An output that has been checked.
#[derive(Clone, Debug)]
pub(super) struct Output {
    path: PathBuf,
    endings: &'static [&'static str],
    force: bool,
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
        check_output(&self.path, self.endings, self.force).map_err(|error| match error {
            OutputError::Exists { .. } => anyhow!("{error}; --force replaces it"),
            error => error.into(),
        })
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
        self.check()?;
        write_atomically(&self.path, |out| out.write_all(bytes)).map_err(|error| self.failed(&error))
    }

    fn failed(&self, error: &io::Error) -> anyhow::Error {
        anyhow!("{}: {error}", self.path.display())
    }
}
