//! The rule for outputs: a file that exists is replaced only if somebody asks for it, and an input is never an output.

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use thiserror::Error;

use crate::{
    atomic_file::{AtomicFile, Destination},
    platform::fs::{self, File, Identity, Metadata, has_ending},
    recording::import::files_beside,
};

#[derive(Debug, Error)]
pub enum OutputError {
    #[error("{}: expected a name that ends in {}", path.display(), endings.join(" or "))]
    Ending { path: PathBuf, endings: &'static [&'static str] },
    #[error("{}: is an input, too; an output must be another file", path.display())]
    Input { path: PathBuf },
    #[error("{}: lies in the input {}; an output must lie elsewhere", path.display(), folder.display())]
    InInput { path: PathBuf, folder: PathBuf },
    #[error("{}: two outputs cannot both write it", path.display())]
    Twice { path: PathBuf },
    #[error("{}: exists already", path.display())]
    Exists { path: PathBuf },
    #[error("{}: {cause}", path.display())]
    Io { path: PathBuf, cause: io::Error },
}

/// The files of the sessions that this program has opened. A session may have several: a glTF and its buffers.
static READ: Mutex<BTreeSet<Identity>> = Mutex::new(BTreeSet::new());

/// Notes that a file was opened to be read, so that no output replaces it.
pub(crate) fn note_read(file: &File) {
    if let Ok(data) = file.metadata() {
        READ.lock().unwrap_or_else(PoisonError::into_inner).insert(Identity::of(&data));
    }
}

fn was_read(data: &Metadata) -> bool {
    READ.lock().unwrap_or_else(PoisonError::into_inner).contains(&Identity::of(data))
}

/// A session's file, and the other files that are read with it. A glTF is read to find them.
pub fn files_read_with(path: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    [path.to_owned()].into_iter().chain(files_beside(path))
}

/// Checks a further output before the work begins: it is no input and no other output, it may be written, and its folder is
/// writable. Returns its destination.
///
/// # Errors
/// See [`OutputError`].
pub fn check_new_output(
    path: &Path,
    endings: &'static [&'static str],
    force: bool,
    inputs: &[PathBuf],
    outputs: &[PathBuf],
) -> Result<Destination, OutputError> {
    let owned = || path.to_owned();
    // Standard output may lead to a file that is an input.
    let place = if path == Path::new("-") && cfg!(unix) { Path::new("/dev/stdout") } else { path };
    for input in inputs {
        let is_read = match input == Path::new("-") {
            // Standard input may come from a file.
            true => Path::new("/dev/stdin").is_file() && is_same_file(place, Path::new("/dev/stdin")),
            false => is_same_file(place, input),
        };
        if is_read {
            return Err(OutputError::Input { path: owned() });
        }
        if input.is_dir() && lies_in(place, input) {
            return Err(OutputError::InInput { path: owned(), folder: input.clone() });
        }
    }
    let io = |cause| OutputError::Io { path: owned(), cause };
    let destination = Destination::of(path).map_err(io)?;
    let is_written_twice = |other: &PathBuf| match (&destination, Destination::of(other)) {
        (Destination::File(_), Ok(Destination::File(_))) => is_same_file(path, other),
        // Two outputs to the same device do not replace each other, but their bytes would be mixed.
        (Destination::StandardOutput, Ok(other)) => other == Destination::StandardOutput,
        (Destination::Special(here), Ok(Destination::Special(there))) => {
            *here == there && here != Path::new("/dev/null")
        }
        _ => false,
    };
    if outputs.iter().any(is_written_twice) {
        return Err(OutputError::Twice { path: owned() });
    }
    check_output(path, endings, force)?;
    if matches!(destination, Destination::File(_)) {
        // A temporary file shows whether the folder is writable.
        AtomicFile::create(path).map_err(io)?;
    }
    Ok(destination)
}

/// Checks that an output may be written at `path`. With `force` it may replace a file. The name must have one of the
/// endings, if there are any. Pipes and devices may have any name.
///
/// # Errors
/// See [`OutputError`].
pub fn check_output(path: &Path, endings: &'static [&'static str], force: bool) -> Result<(), OutputError> {
    let io = |cause| OutputError::Io { path: path.to_owned(), cause };
    let target = match Destination::of(path).map_err(io)? {
        Destination::StandardOutput | Destination::StandardError => return Ok(()),
        Destination::Special(special) => return check_special(&special, force).map_err(io),
        Destination::File(target) => target,
    };
    let fits = |ending: &&str| has_ending(path, ending) || has_ending(&target, ending);
    if !endings.is_empty() && !endings.iter().any(fits) {
        return Err(OutputError::Ending { path: path.to_owned(), endings });
    }
    match fs::metadata(&target) {
        Ok(data) if was_read(&data) => Err(OutputError::Input { path: path.to_owned() }),
        Ok(data) if data.is_dir() => {
            Err(io(io::Error::new(io::ErrorKind::IsADirectory, "expected a file; found a folder")))
        }
        Ok(_) if force => Ok(()),
        Ok(_) => Err(OutputError::Exists { path: path.to_owned() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            match fs::is_folder(fs::folder_of(&target)) {
                true => Ok(()),
                false => Err(io(io::Error::new(error.kind(), "there is no such folder"))),
            }
        }
        Err(error) => Err(io(error)),
    }
}

fn check_special(path: &Path, force: bool) -> io::Result<()> {
    // A block device has the data of a whole disk, so it is never replaced without `force`.
    #[cfg(unix)]
    if !force
        && fs::metadata(path)
            .is_ok_and(|data| std::os::unix::fs::FileTypeExt::is_block_device(&data.file_type()))
    {
        return Err(io::Error::other("expected a file; found a disk"));
    }
    let _ = (path, force);
    Ok(())
}

/// Whether two paths lead to the same file. Symbolic and hard links are followed, and neither file is opened.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) {
        return Identity::of(&a) == Identity::of(&b);
    }
    match (whole_path(a), whole_path(b)) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}

/// The canonical path. For a file that does not exist yet, the canonical path of its folder is extended by its name.
fn whole_path(path: &Path) -> Option<PathBuf> {
    let Ok(Destination::File(target)) = Destination::of(path) else { return None };
    fs::whole_path(&target)
}

/// Whether a file lies, or would lie, in a folder or below it.
pub fn lies_in(file: &Path, folder: &Path) -> bool {
    match (whole_path(file), folder.canonicalize()) {
        (Some(file), Ok(folder)) => file.starts_with(folder),
        _ => false,
    }
}
