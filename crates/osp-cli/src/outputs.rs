//! The files that a command writes. They are checked before the work begins, and written whole or not at all.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};

use super::output;
#[cfg(feature = "bench")]
use osp_session::atomic_file::write_atomically;
use osp_session::{
    atomic_file::{AtomicFile, Destination},
    output_file::{OutputError, OutputKind, check_output, is_same_file, is_there, lies_in},
    recording::import::files_beside,
};

/// The files that a command reads and writes.
pub(super) struct Outputs {
    force: bool,
    inputs: Vec<PathBuf>,
    /// Each output with the option that named it.
    outputs: Vec<(String, PathBuf)>,
}

impl Outputs {
    /// Creates the list. With `force`, an output may replace a file of another kind, but never an input.
    pub(super) fn new(force: bool) -> Self {
        Self { force, inputs: Vec::new(), outputs: Vec::new() }
    }

    /// Adds files or folders that the command reads.
    #[must_use]
    pub(super) fn reads<'a>(mut self, paths: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        for path in paths {
            self.inputs.push(path.clone());
            self.inputs.extend(files_beside(path));
        }
        self
    }

    fn is_no_input(&self, option: &str, path: &Path) -> anyhow::Result<()> {
        for input in &self.inputs {
            if is_same_file(path, input) {
                bail!("{}: is the input, too; {option} must name another file", path.display());
            }
            if input.is_dir() && lies_in(path, input) {
                let folder = input.display();
                bail!("{}: lies in the input {folder}; {option} must name a file elsewhere", path.display());
            }
        }
        Ok(())
    }

    /// Checks an output before the work begins. `option` is the option that named it.
    pub(super) fn add(&mut self, option: &str, path: &Path, kind: OutputKind) -> anyhow::Result<Output> {
        // Standard output may lead to a file that is an input.
        let is_standard_output = path == Path::new("-") && cfg!(unix);
        self.is_no_input(option, if is_standard_output { Path::new("/dev/stdout") } else { path })?;
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
        let output = Output { path: path.to_owned(), kind, force: self.force };
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
        &mut self,
        option: &str,
        paths: impl Iterator<Item = PathBuf>,
    ) -> anyhow::Result<()> {
        // The names of the pictures differ. Creating the first one finds out whether the folder is writable.
        for (i, path) in paths.enumerate() {
            self.is_no_input(option, &path)?;
            let output = Output { path, kind: OutputKind::Png, force: self.force };
            output.check()?;
            if i == 0 {
                output.create()?;
            }
        }
        Ok(())
    }

    /// Checks an output, if the option for it was given.
    pub(super) fn add_any(
        &mut self,
        option: &str,
        path: Option<&PathBuf>,
        kind: OutputKind,
    ) -> anyhow::Result<Option<Output>> {
        path.map(|path| self.add(option, path, kind)).transpose()
    }
}

/// An output that has been checked.
#[derive(Clone, Debug)]
pub(super) struct Output {
    path: PathBuf,
    kind: OutputKind,
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

    /// Whether a file of this kind exists already.
    pub(super) fn replaces_its_kind(&self) -> bool {
        is_there(&self.path, self.kind)
    }

    /// Returns an error if the output would replace a file that must not be lost. Such a file may have appeared since
    /// the check before the work.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        check_output(&self.path, self.kind, self.force).map_err(|error: OutputError| {
            match error.yields_to_force() && !self.force {
                true => anyhow!("{error}; --force replaces it"),
                false => error.into(),
            }
        })
    }

    /// Starts a file that is written in parts and appears with [`Output::commit`].
    pub(super) fn create(&self) -> anyhow::Result<AtomicFile> {
        AtomicFile::create(&self.path).map_err(|error| self.failed(&error))
    }

    /// Gives the file its name. Returns its size in bytes if it is a file.
    pub(super) fn commit(&self, file: AtomicFile) -> anyhow::Result<Option<u64>> {
        self.check()?;
        // Does not replace a session that appears after the check, either.
        let is_new_only = !self.force && self.kind.is_session();
        let outcome = if is_new_only { file.commit_new() } else { file.commit() };
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
