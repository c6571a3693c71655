//! Atomic outputs: an output appears under its name complete, or not at all.
//!
//! A writer fills an unnamed file beside the target, flushes it to the disk, and then replaces the target in one step.
//! Until then the target does not change. The unfinished file is removed if the writer fails or is dropped, or if a
//! signal ends the program.

use std::{
    collections::BTreeSet,
    fs::{self, File, Metadata},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use tempfile::TempPath;

use crate::platform::fs::{Identity, folder_of};

/// Largest number of symbolic links that are followed one after the other, as on Linux.
const MOST_LINKS: usize = 40;
const PREFIX: &str = ".unfinished-";

/// Whether the file has the name of an unfinished file. Such a file is being written, or a killed program left it
/// behind.
pub fn is_unfinished(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PREFIX))
}

/// Unfinished files. A signal that ends the program removes them.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // The set is complete even if a thread panicked while it held the lock.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// Standard output: `-` or `/dev/stdout`.
    StandardOutput,
    /// Standard error: `/dev/stderr`.
    StandardError,
    /// A pipe or a device, which is written to directly.
    Special(PathBuf),
    /// A file, which is replaced as a whole. The path is the target of all links.
    File(PathBuf),
}

impl Destination {
    /// Destination of a path. The file need not exist, and a link may lead to a path without a file.
    ///
    /// # Errors
    /// The path names no file, or its links lead in a circle.
    pub fn of(path: &Path) -> io::Result<Self> {
        match path.to_str() {
            Some("-" | "/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1") => return Ok(Self::StandardOutput),
            Some("/dev/stderr" | "/dev/fd/2" | "/proc/self/fd/2") => return Ok(Self::StandardError),
            _ => {}
        }
        // These paths lead to open files, which need not have a name. A file with a name is replaced under its name,
        // because a program that reads the old file must not see it change.
        if (path.starts_with("/dev/fd") || path.starts_with("/proc/self/fd")) && !is_link_to_file(path) {
            return Ok(Self::Special(path.to_owned()));
        }
        // A path without a file name, or with the name of a folder, would fail only when the finished file is renamed.
        if path.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(io::Error::new(io::ErrorKind::InvalidFilename, "expected the name of a file"));
        }
        let mut target = path.to_owned();
        for _ in 0..MOST_LINKS {
            match fs::read_link(&target) {
                Ok(next) => target = folder_of(&target).join(next),
                Err(_) => {
                    let is_special =
                        fs::metadata(&target).is_ok_and(|data| !data.is_file() && !data.is_dir());
                    return Ok(if is_special { Self::Special(target) } else { Self::File(target) });
                }
            }
        }
        Err(io::Error::other("too many symbolic links, one after the other"))
    }
}

/// Whether `path` is a link to an open file whose name still leads to the same file.
fn is_link_to_file(path: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(target), Ok(open)) = (fs::read_link(path), fs::metadata(path)) {
        return open.is_file()
            && fs::metadata(target).is_ok_and(|named| Identity::of(&named) == Identity::of(&open));
    }
    let _ = path;
    false
}

/// An unfinished output. [`AtomicFile::commit`] replaces the target by the output; without a commit the target does not
/// change. Pipes, devices and standard output are written to directly.
#[derive(Debug)]
pub struct AtomicFile {
    // This field comes first, so that the file is closed before it is renamed or removed.
    out: BufWriter<Sink>,
    unfinished: Option<Unfinished>,
}

impl AtomicFile {
    /// Starts an output. The target does not change until the commit. The new file gets the target's permissions and
    /// owner.
    ///
    /// # Errors
    /// The folder cannot be written to, or the target is write-protected or a folder.
    pub fn create(path: &Path) -> io::Result<Self> {
        let (file, unfinished) = match Destination::of(path)? {
            Destination::File(target) => {
                let (file, unfinished) = Unfinished::beside(target)?;
                (file, Some(unfinished))
            }
            _ => (open_stream(path)?, None),
        };
        let sink = Sink { file, is_direct: unfinished.is_none(), nobody_reads: false };
        Ok(Self { out: BufWriter::with_capacity(1 << 16, sink), unfinished })
    }

    /// Another handle of the open output, for a writer that must own a file. The handle's position is behind the last
    /// written byte.
    ///
    /// # Errors
    /// The system refuses a further handle, or earlier bytes cannot be written.
    pub fn handle(&mut self) -> io::Result<File> {
        self.out.flush()?;
        self.out.get_ref().file.try_clone()
    }

    /// Replaces the target by the output. Returns the size in bytes if the target is a file.
    ///
    /// # Errors
    /// The output cannot be written or renamed. The target is then unchanged.
    pub fn commit(self) -> io::Result<Option<u64>> {
        self.finish(|unfinished, target| unfinished.persist(target))
    }

    /// Does the same as [`AtomicFile::commit`], but never replaces a file: a target that exists by now is an error.
    ///
    /// # Errors
    /// The errors of [`AtomicFile::commit`], or the target exists.
    pub fn commit_new(self) -> io::Result<Option<u64>> {
        self.finish(|unfinished, target| unfinished.persist_noclobber(target))
    }

    fn finish(
        self,
        rename: impl FnOnce(TempPath, &Path) -> Result<(), tempfile::PathPersistError>,
    ) -> io::Result<Option<u64>> {
        let Sink { file, .. } = self.out.into_inner().map_err(io::IntoInnerError::into_error)?;
        let Some(mut unfinished) = self.unfinished else { return Ok(None) };
        file.sync_all()?;
        let bytes = file.metadata()?.len();
        drop(file);
        // A signal waits for this lock until the file has its name.
        let mut all = self::unfinished();
        if let Some(path) = unfinished.path.take() {
            all.remove::<Path>(&path);
            rename(path, &unfinished.target).map_err(|failed| failed.error)?;
        }
        drop(all);
        sync_folder(folder_of(&unfinished.target))?;
        Ok(Some(bytes))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Replaces a file, completely or not at all, by the bytes that `write` writes.
///
/// # Errors
/// `write` fails, or the file cannot be written. The file is then unchanged.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file)?;
    file.commit().map(drop)
}

/// Opens an output that other programs read while it grows. A file loses its old contents at once.
pub fn open_stream(path: &Path) -> io::Result<File> {
    match Destination::of(path)? {
        Destination::StandardOutput => own_copy(&io::stdout()),
        Destination::StandardError => own_copy(&io::stderr()),
        Destination::Special(path) => File::options().write(true).open(path),
        Destination::File(target) => File::create(target),
    }
}

/// An open file. A broken pipe is no error, because the reader of a pipe may close it early.
#[derive(Debug)]
struct Sink {
    file: File,
    is_direct: bool,
    nobody_reads: bool,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.nobody_reads {
            return Ok(bytes.len());
        }
        match self.file.write(bytes) {
            Err(error) if self.is_direct && error.kind() == io::ErrorKind::BrokenPipe => {
                self.nobody_reads = true;
                Ok(bytes.len())
            }
            outcome => outcome,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A file that is removed when dropped, unless it was renamed to its target.
#[derive(Debug)]
struct Unfinished {
    /// `None` once the file has its name.
    path: Option<TempPath>,
    target: PathBuf,
}

impl Unfinished {
    fn beside(target: PathBuf) -> io::Result<(File, Self)> {
        let old = match fs::metadata(&target) {
            Ok(data) => Some(data),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        if old.as_ref().is_some_and(Metadata::is_dir) {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        // This check is needed because renaming ignores write protection.
        if old.as_ref().is_some_and(|data| data.permissions().readonly()) {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is write-protected"));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        // The system's error is returned, because the error of `tempfile` names the temporary file, which a user has
        // never seen.
        let mut code = None;
        let make = |path: &Path| {
            let made = File::options().read(true).write(true).create_new(true).open(path);
            made.inspect_err(|error| code = error.raw_os_error())
        };
        // The lock keeps a signal from coming between the creation of the file and its entry in the list.
        let mut all = unfinished();
        let made = builder.make_in(folder_of(&target), make);
        let (file, path) =
            made.map_err(|error| code.map_or(error, io::Error::from_raw_os_error))?.into_parts();
        all.insert(path.to_path_buf());
        drop(all);
        let this = Self { path: Some(path), target };
        if let Some(old) = old {
            keep_permissions(&file, &old)?;
        }
        Ok((file, this))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if let Some(path) = self.path.take() {
            let mut all = unfinished();
            all.remove::<Path>(&path);
            // A failure is fine if the file no longer exists.
            let _ = path.close();
        }
    }
}

fn keep_permissions(file: &File, old: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        // Only an administrator may give a file to another owner; for other users the error is ignored.
        let _ = std::os::unix::fs::fchown(file, Some(old.uid()), Some(old.gid()));
    }
    file.set_permissions(old.permissions())
}

/// Flushes the folder. A new name is certain to be on the disk only then.
fn sync_folder(folder: &Path) -> io::Result<()> {
    // A folder without read permission cannot be opened, and some file systems cannot flush a folder.
    #[cfg(unix)]
    if let Ok(opened) = File::open(folder) {
        match opened.sync_all() {
            Err(error)
                if !matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) =>
            {
                return Err(error);
            }
            _ => {}
        }
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

#[cfg(unix)]
fn own_copy(stream: &impl std::os::fd::AsFd) -> io::Result<File> {
    stream.as_fd().try_clone_to_owned().map(File::from)
}

#[cfg(windows)]
fn own_copy(stream: &impl std::os::windows::io::AsHandle) -> io::Result<File> {
    stream.as_handle().try_clone_to_owned().map(File::from)
}

/// Prints a message before a signal ends the program.
type SignalMessage = Box<dyn Fn() + Send>;
static SIGNAL_MESSAGE: Mutex<Option<SignalMessage>> = Mutex::new(None);

/// Sets the function that prints a message before a signal ends the program; `None` removes the function.
pub fn on_signal(words: Option<SignalMessage>) {
    *SIGNAL_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) = words;
}

/// Removes the unfinished files when a signal ends the program. The signal's default action then follows.
///
/// # Errors
/// The system refuses a thread or a signal handler.
#[cfg(unix)]
pub fn remove_unfinished_on_signals() -> io::Result<()> {
    use signal_hook::{
        consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ},
        iterator::Signals,
        low_level::emulate_default_handler,
    };
    // A program that was started with a signal ignored (`nohup`, a background job of a shell) continues to ignore it.
    // SIGXFSZ is sent when a file exceeds the system's size limit.
    let wanted =
        [SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ].into_iter().filter(|&signal| !is_ignored(signal));
    let mut signals = Signals::new(wanted)?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            if let Some(words) = &*SIGNAL_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) {
                words();
            }
            // The lock is held until the program ends, so no file is created or renamed any more.
            let all = unfinished();
            for path in all.iter() {
                let _ = fs::remove_file(path);
            }
            // For these signals this call does not return.
            let _ = emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// Whether this process was started with a signal ignored, if the system reports that.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let Ok(status) = fs::read_to_string("/proc/self/status") else { return false };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_the_old_one_until_the_new_one_is_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_atomically(&path, |out| out.write_all(b"old")).expect("written");
        let mut file = AtomicFile::create(&path).expect("begun");
        file.write_all(b"new, ").expect("written");
        file.handle().expect("a handle").write_all(b"and longer").expect("written");
        assert_eq!(fs::read(&path).expect("there"), b"old");
        assert_eq!(names(folder.path()).len(), 2);
        assert_eq!(file.commit().expect("renamed"), Some(15));
        assert_eq!(fs::read(&path).expect("there"), b"new, and longer");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_writer_that_fails_or_is_dropped_leaves_everything_as_it_was() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").expect("written");
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert_eq!(failed.expect_err("no more").to_string(), "no more");
        drop(AtomicFile::create(&path).expect("begun"));
        let new = AtomicFile::create(&path).expect("begun").commit_new();
        assert_eq!(new.expect_err("it exists").kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(
            (fs::read(&path).expect("there"), names(folder.path())),
            (b"old".to_vec(), vec!["a.txt".to_owned()])
        );
        assert!(unfinished().iter().all(|path| !path.starts_with(folder.path())));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        fs::write(&target, "old").expect("written");
        fs::set_permissions(&target, PermissionsExt::from_mode(0o640)).expect("set");
        symlink("target", &link).expect("linked");
        write_atomically(&link, |out| out.write_all(b"new")).expect("written");
        assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
        assert_eq!(fs::read(&target).expect("there"), b"new");
        let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
        assert_eq!(mode(&target), 0o640);
        let (usual, ours) = (folder.path().join("usual"), folder.path().join("ours"));
        fs::write(&usual, "").expect("written");
        write_atomically(&ours, |_| Ok(())).expect("written");
        assert_eq!(mode(&ours), mode(&usual));
        // A link to a missing file creates that file.
        let (dangling, made) = (folder.path().join("dangling"), folder.path().join("made"));
        symlink(&made, &dangling).expect("linked");
        write_atomically(&dangling, |out| out.write_all(b"x")).expect("written");
        assert_eq!(fs::read(made).expect("there"), b"x");
        let circle = folder.path().join("circle");
        symlink("circle", &circle).expect("linked");
        assert!(write_atomically(&circle, |_| Ok(())).expect_err("a circle").to_string().contains("links"));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_write_protected_or_a_folder_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").expect("written");
        fs::set_permissions(&path, PermissionsExt::from_mode(0o444)).expect("set");
        let refused = AtomicFile::create(&path).expect_err("write-protected");
        assert_eq!(refused.kind(), io::ErrorKind::PermissionDenied);
        assert_eq!(
            AtomicFile::create(folder.path()).expect_err("a folder").kind(),
            io::ErrorKind::IsADirectory
        );
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_are_written_to_directly() {
        write_atomically(Path::new("/dev/null"), |out| out.write_all(b"x")).expect("written");
        let full = write_atomically(Path::new("/dev/full"), |out| out.write_all(b"x"));
        assert_eq!(full.expect_err("full").kind(), io::ErrorKind::StorageFull);
        assert_eq!(Destination::of(Path::new("-")).expect("known"), Destination::StandardOutput);
        for path in ["", "/", "..", "a.csv/"] {
            assert!(Destination::of(Path::new(path)).is_err(), "{path}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let (path, gone) = (folder.path().join("a.txt"), folder.path().join("gone"));
        fs::write(&path, "old").expect("written");
        // A program has opened this file for reading.
        let (open, nameless) = (File::open(&path).expect("open"), File::create(&gone).expect("made"));
        fs::remove_file(&gone).expect("removed");
        let number = |file: &File| std::os::fd::AsRawFd::as_raw_fd(file);
        for folder in ["/dev/fd", "/proc/self/fd"] {
            let of = |file| Destination::of(&Path::new(folder).join(number(file).to_string()));
            assert_eq!(of(&open).expect("known"), Destination::File(path.clone()));
            assert!(matches!(of(&nameless).expect("known"), Destination::Special(_)));
        }
        let null = Destination::of(Path::new("/dev/null")).expect("known");
        assert_eq!(null, Destination::Special("/dev/null".into()));
    }
}
