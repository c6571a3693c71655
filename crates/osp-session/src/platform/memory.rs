//! Files in memory, with the names and behaviour of [`std::fs`], for a web page. [`take_changes`] returns the files
//! that the program has written. The page's script stores these files until the next visit. Files that [`put`] added
//! are returned only after a change.
#![allow(clippy::len_without_is_empty, missing_debug_implementations, reason = "as in what it stands for")]

pub use std::fs::TryLockError;
use std::{
    collections::{BTreeMap, BTreeSet},
    ffi::OsStr,
    io::{self, ErrorKind, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, SystemTime},
};

use super::{fs::without_dots, time};

/// The files by their names; the names have no `.` or `..`.
static FILES: Mutex<Files> =
    Mutex::new(Files { by_name: BTreeMap::new(), ticks: 0, changed: BTreeSet::new() });

struct Files {
    by_name: BTreeMap<PathBuf, Arc<Node>>,
    /// A clock that advances by one with each change.
    ticks: u64,
    changed: BTreeSet<PathBuf>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic while the lock is held leaves no incomplete change.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug)]
struct Node {
    content: Mutex<Content>,
    created: u64,
    is_locked: AtomicBool,
}

#[derive(Debug)]
struct Content {
    bytes: Vec<u8>,
    modified: u64,
    /// Length of the unchanged beginning, which the page's script has already stored, bytes.
    kept: usize,
}

impl Files {
    fn tick(&mut self) -> u64 {
        // Two changes within the clock's resolution differ, too.
        let now = time::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        self.ticks = (self.ticks + 1).max(now.as_nanos() as u64);
        self.ticks
    }

    fn make(&mut self, name: PathBuf, bytes: Vec<u8>, kept: usize) -> Arc<Node> {
        let now = self.tick();
        let content = Mutex::new(Content { bytes, modified: now, kept });
        let node = Arc::new(Node { content, created: now, is_locked: AtomicBool::new(false) });
        self.by_name.insert(name, Arc::clone(&node));
        node
    }
}

fn missing() -> io::Error {
    io::Error::new(ErrorKind::NotFound, "there is no such file")
}

/// A change to store: the bytes of a file from an offset on, or `None` if the file was removed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    pub path: PathBuf,
    pub from: usize,
    pub bytes: Option<Vec<u8>>,
}

/// Returns the changes since the last call. A file that [`put`] added is returned only after a change.
pub fn take_changes() -> Vec<Change> {
    let mut files = lock(&FILES);
    let changed = std::mem::take(&mut files.changed);
    let change = |path: PathBuf| match files.by_name.get(&path) {
        None => Change { path, from: 0, bytes: None },
        Some(node) => {
            let mut content = lock(&node.content);
            let from = content.kept.min(content.bytes.len());
            content.kept = content.bytes.len();
            Change { path, from, bytes: Some(content.bytes[from..].to_vec()) }
        }
    };
    changed.into_iter().map(change).collect()
}

/// Adds a file that the page's script had stored, or that a person has chosen.
pub fn put(path: &Path, bytes: Vec<u8>) {
    let kept = bytes.len();
    lock(&FILES).make(without_dots(path), bytes, kept);
}

pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

pub fn write(path: &Path, bytes: Vec<u8>) {
    let mut files = lock(&FILES);
    let name = without_dots(path);
    files.changed.insert(name.clone());
    files.make(name, bytes, 0);
}

pub fn remove_file(path: impl AsRef<Path>) -> io::Result<()> {
    let mut files = lock(&FILES);
    let name = without_dots(path.as_ref());
    files.by_name.remove(&name).ok_or_else(missing)?;
    files.changed.insert(name);
    Ok(())
}

/// Does nothing, because a folder exists once it has a file.
pub fn create_dir_all(_: impl AsRef<Path>) -> io::Result<()> {
    Ok(())
}

pub fn canonicalize(path: impl AsRef<Path>) -> io::Result<PathBuf> {
    metadata(&path)?;
    Ok(without_dots(path.as_ref()))
}

pub fn metadata(path: impl AsRef<Path>) -> io::Result<Metadata> {
    let files = lock(&FILES);
    let name = without_dots(path.as_ref());
    if let Some(node) = files.by_name.get(&name) {
        return Ok(Metadata::of(node));
    }
    let is_folder =
        name.file_name() != Some(OsStr::new("")) && files.by_name.keys().any(|file| file.starts_with(&name));
    if is_folder { Ok(Metadata { bytes: None, modified: 0, created: 0 }) } else { Err(missing()) }
}

pub fn read_dir(path: impl AsRef<Path>) -> io::Result<impl Iterator<Item = io::Result<DirEntry>>> {
    let folder = without_dots(path.as_ref());
    let inside = |path: &&PathBuf| path.parent() == Some(&folder);
    let entries: Vec<_> =
        lock(&FILES).by_name.keys().filter(inside).map(|path| Ok(DirEntry(path.clone()))).collect();
    Ok(entries.into_iter())
}

pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let folder = without_dots(folder);
    lock(&FILES).by_name.keys().filter(|file| file.starts_with(&folder)).cloned().collect()
}

#[derive(Debug)]
pub struct DirEntry(PathBuf);

impl DirEntry {
    pub fn path(&self) -> PathBuf {
        self.0.clone()
    }
}

#[derive(Clone, Debug)]
pub struct Metadata {
    bytes: Option<u64>,
    modified: u64,
    created: u64,
}

#[derive(Clone, Copy, Debug)]
pub struct Permissions;

impl Permissions {
    pub fn readonly(&self) -> bool {
        false
    }
}

impl Metadata {
    fn of(node: &Node) -> Self {
        let content = lock(&node.content);
        Self { bytes: Some(content.bytes.len() as u64), modified: content.modified, created: node.created }
    }

    pub fn len(&self) -> u64 {
        self.bytes.unwrap_or(0)
    }

    pub fn is_file(&self) -> bool {
        self.bytes.is_some()
    }

    pub fn is_dir(&self) -> bool {
        self.bytes.is_none()
    }

    pub fn permissions(&self) -> Permissions {
        Permissions
    }

    /// Time of the last change. A later change has a later time.
    pub fn modified(&self) -> io::Result<SystemTime> {
        Ok(SystemTime::UNIX_EPOCH + Duration::from_nanos(self.modified))
    }

    /// Time of the creation. A file that was created later has a later time.
    pub fn created(&self) -> io::Result<SystemTime> {
        Ok(SystemTime::UNIX_EPOCH + Duration::from_nanos(self.created))
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub struct OpenOptions {
    write: bool,
    append: bool,
    create: bool,
    create_new: bool,
    truncate: bool,
}

macro_rules! options {
    ($($name:ident)*) => {
        $(pub fn $name(&mut self, on: bool) -> &mut Self {
            self.$name = on;
            self
        })*
    };
}

impl OpenOptions {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn read(&mut self, _: bool) -> &mut Self {
        self
    }

    options! { write append create create_new truncate }

    pub fn open(&self, path: impl AsRef<Path>) -> io::Result<File> {
        let mut files = lock(&FILES);
        let name = without_dots(path.as_ref());
        let node = match files.by_name.get(&name) {
            Some(_) if self.create_new => {
                return Err(io::Error::new(ErrorKind::AlreadyExists, "the file exists already"));
            }
            Some(node) => Arc::clone(node),
            None if self.create || self.create_new => {
                files.changed.insert(name.clone());
                files.make(name.clone(), Vec::new(), 0)
            }
            None => return Err(missing()),
        };
        drop(files);
        let file =
            File { node, name, at: Mutex::new(0), has_lock: AtomicBool::new(false), appends: self.append };
        if self.truncate {
            file.set_len(0)?;
        }
        Ok(file)
    }
}

#[derive(Debug)]
pub struct File {
    node: Arc<Node>,
    name: PathBuf,
    at: Mutex<usize>,
    has_lock: AtomicBool,
    appends: bool,
}

impl Drop for File {
    fn drop(&mut self) {
        if self.has_lock.load(Ordering::Relaxed) {
            self.node.is_locked.store(false, Ordering::Relaxed);
        }
    }
}

impl File {
    pub fn open(path: impl AsRef<Path>) -> io::Result<Self> {
        OpenOptions::new().open(path)
    }

    pub fn create(path: impl AsRef<Path>) -> io::Result<Self> {
        OpenOptions::new().create(true).truncate(true).open(path)
    }

    pub fn options() -> OpenOptions {
        OpenOptions::new()
    }

    pub fn metadata(&self) -> io::Result<Metadata> {
        Ok(Metadata::of(&self.node))
    }

    /// Changes the content; the bytes before `from` must stay the same.
    fn change(&self, from: usize, how: impl FnOnce(&mut Vec<u8>)) {
        let mut files = lock(&FILES);
        let now = files.tick();
        let mut content = lock(&self.node.content);
        how(&mut content.bytes);
        content.modified = now;
        content.kept = content.kept.min(from);
        // A file that was removed, or replaced by another file of its name, is no longer in the list.
        if files.by_name.get(&self.name).is_some_and(|node| Arc::ptr_eq(node, &self.node)) {
            files.changed.insert(self.name.clone());
        }
    }

    pub fn set_len(&self, bytes: u64) -> io::Result<()> {
        let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
        self.change(bytes, |content| content.resize(bytes, 0));
        Ok(())
    }

    pub fn sync_all(&self) -> io::Result<()> {
        Ok(())
    }

    pub fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    pub fn try_lock(&self) -> Result<(), TryLockError> {
        if self.has_lock.load(Ordering::Relaxed) {
            return Ok(());
        }
        if self.node.is_locked.swap(true, Ordering::Relaxed) {
            return Err(TryLockError::WouldBlock);
        }
        self.has_lock.store(true, Ordering::Relaxed);
        Ok(())
    }
}

impl Read for &File {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut at = lock(&self.at);
        let content = lock(&self.node.content);
        let rest = content.bytes.get(*at..).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        *at += count;
        Ok(count)
    }
}

impl Write for &File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut at = lock(&self.at);
        if self.appends {
            *at = lock(&self.node.content).bytes.len();
        }
        let start = *at;
        self.change(start, |content| {
            let end = start + bytes.len();
            if content.len() < end {
                content.resize(end, 0);
            }
            content[start..end].copy_from_slice(bytes);
        });
        *at += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for &File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let mut at = lock(&self.at);
        let length = lock(&self.node.content).bytes.len() as u64;
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(by) => length.checked_add_signed(by),
            SeekFrom::Current(by) => (*at as u64).checked_add_signed(by),
        };
        let place = place.and_then(|place| usize::try_from(place).ok());
        *at = place.ok_or_else(|| {
            io::Error::new(ErrorKind::InvalidInput, "a position before the start of the file")
        })?;
        Ok(*at as u64)
    }
}

impl Read for File {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        (&*self).read(buffer)
    }
}

impl Write for File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        (&*self).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        (&*self).seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_those_of_a_system_and_their_changes_can_be_kept() {
        let mine = |changes: Vec<Change>| -> Vec<Change> {
            changes.into_iter().filter(|change| change.path.starts_with("/mine")).collect()
        };
        let path = Path::new("/mine/a/../b.ron");
        assert_eq!(File::open(path).map(drop).unwrap_err().kind(), ErrorKind::NotFound);
        put(path, b"one\n".to_vec());
        assert!(mine(take_changes()).is_empty(), "it is kept already");
        let mut file = File::options().read(true).write(true).open("/mine/b.ron").expect("there");
        let before = file.metadata().and_then(|data| data.modified()).expect("a time");
        file.seek(SeekFrom::End(0)).expect("the end");
        file.write_all(b"two\n").expect("written");
        assert!(file.metadata().and_then(|data| data.modified()).expect("a time") > before);
        assert_eq!(read(path).expect("there"), b"one\ntwo\n");
        let tail = Change { path: without_dots(path), from: 4, bytes: Some(b"two\n".to_vec()) };
        assert_eq!(mine(take_changes()), [tail]);
        // The cut removed stored bytes, so the change begins at the cut.
        file.set_len(2).expect("cut");
        file.rewind().expect("the start");
        file.write_all(b"O").expect("written");
        let whole = Change { path: without_dots(path), from: 0, bytes: Some(b"On".to_vec()) };
        assert_eq!(mine(take_changes()), [whole]);

        file.try_lock().expect("free");
        let other = File::open(path).expect("there");
        assert!(matches!(other.try_lock(), Err(TryLockError::WouldBlock)));
        drop(file);
        other.try_lock().expect("free again");

        assert!(metadata("/mine").is_ok_and(|data| data.is_dir()));
        assert!(File::options().create_new(true).open(path).is_err());
        assert_eq!(
            read_dir("/mine").expect("a folder").flatten().map(|entry| entry.path()).collect::<Vec<_>>(),
            [without_dots(path)]
        );
        remove_file(path).expect("there");
        assert_eq!(mine(take_changes()), [Change { path: without_dots(path), from: 0, bytes: None }]);
        assert!(metadata("/mine").is_err());
    }
}
