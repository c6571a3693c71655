use std::{
    collections::BTreeMap,
    ffi::OsStr,
    io::{self, Cursor, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    output_file::note_read,
    platform::fs::{self, File, without_dots},
    small_file::open_regular,
};

/// Files in memory, by name, for sessions that are not on a disk, such as a file that was dropped on a web page.
///
/// Some formats consist of several files: CASSIE's `raw_data/NAME.json` and `sketch_history/NAME.json`, a `.gltf` and
/// its buffers, an unpacked `.tilt`. These files refer to each other by their names, as in folders.
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles {
    files: BTreeMap<PathBuf, Arc<[u8]>>,
}

impl MemoryFiles {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file, or replaces the file of this name.
    pub fn insert(&mut self, name: impl AsRef<Path>, bytes: impl Into<Arc<[u8]>>) {
        self.files.insert(without_dots(name.as_ref()), bytes.into());
    }

    fn get(&self, path: &Path) -> Option<&Arc<[u8]>> {
        self.files.get(&without_dots(path))
    }

    fn is_folder(&self, path: &Path) -> bool {
        let folder = without_dots(path);
        let is_below = |file: &PathBuf| file.starts_with(&folder) && *file != folder;
        folder.file_name() != Some(OsStr::new("")) && self.files.keys().any(is_below)
    }
}

/// The file of a session, and access to the files beside it.
#[derive(Clone, Copy)]
pub(in crate::recording) struct Input<'a> {
    pub(in crate::recording) path: &'a Path,
    files: Files<'a>,
}

#[derive(Clone, Copy)]
enum Files<'a> {
    Disk,
    Memory(&'a MemoryFiles),
}

impl<'a> Input<'a> {
    pub(in crate::recording) fn on_disk(path: &'a Path) -> Self {
        Self { path, files: Files::Disk }
    }

    pub(in crate::recording) fn in_memory(path: &'a Path, files: &'a MemoryFiles) -> Self {
        Self { path, files: Files::Memory(files) }
    }

    /// Another file on the same disk or in the same memory.
    pub(in crate::recording) fn beside<'b>(self, path: &'b Path) -> Input<'b>
    where
        'a: 'b,
    {
        Input { path, files: self.files }
    }

    pub(in crate::recording) fn open(self) -> io::Result<InputFile> {
        match self.files {
            Files::Disk => {
                let file = open_regular(self.path)?;
                note_read(&file);
                Ok(InputFile::Disk(file))
            }
            Files::Memory(files) => match files.get(self.path) {
                Some(bytes) => Ok(InputFile::Memory(Cursor::new(Arc::clone(bytes)))),
                None => Err(io::Error::new(
                    io::ErrorKind::NotFound,
                    "there is no such file in memory; what comes from a pipe is read alone",
                )),
            },
        }
    }

    /// Whether the file lies in a folder or below it, after symbolic links are resolved.
    pub(in crate::recording) fn lies_within(self, folder: &Path) -> io::Result<bool> {
        match self.files {
            Files::Disk => fs::lies_within(self.path, folder),
            // Files in memory have no symbolic links.
            Files::Memory(_) => Ok(true),
        }
    }

    pub(in crate::recording) fn is_file(self) -> bool {
        match self.files {
            Files::Disk => fs::is_file(self.path),
            Files::Memory(files) => files.get(self.path).is_some(),
        }
    }

    pub(in crate::recording) fn is_folder(self) -> bool {
        match self.files {
            Files::Disk => fs::is_folder(self.path),
            Files::Memory(files) => files.is_folder(self.path),
        }
    }

    /// Whether the path exists and is neither a file nor a folder.
    pub(in crate::recording) fn is_special(self) -> bool {
        match self.files {
            Files::Disk => fs::metadata(self.path).is_ok_and(|data| !data.is_file() && !data.is_dir()),
            Files::Memory(_) => false,
        }
    }
}

/// An input that a reader keeps, to open the files beside it later.
#[derive(Clone, Debug)]
pub(in crate::recording) struct KeptInput {
    path: PathBuf,
    files: Option<MemoryFiles>,
}

impl KeptInput {
    pub(in crate::recording) fn of(input: Input<'_>) -> Self {
        let files = match input.files {
            Files::Disk => None,
            Files::Memory(files) => Some(files.clone()),
        };
        Self { path: input.path.to_owned(), files }
    }

    pub(in crate::recording) fn input(&self) -> Input<'_> {
        Input { path: &self.path, files: self.files.as_ref().map_or(Files::Disk, Files::Memory) }
    }
}

#[derive(Debug)]
pub(in crate::recording) enum InputFile {
    Disk(File),
    Memory(Cursor<Arc<[u8]>>),
}

impl InputFile {
    pub(in crate::recording) fn len(&self) -> io::Result<u64> {
        match self {
            Self::Disk(file) => Ok(file.metadata()?.len()),
            Self::Memory(bytes) => Ok(bytes.get_ref().len() as u64),
        }
    }
}

impl Read for InputFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Disk(file) => file.read(buffer),
            Self::Memory(bytes) => bytes.read(buffer),
        }
    }
}

impl Seek for InputFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::Disk(file) => file.seek(to),
            Self::Memory(bytes) => bytes.seek(to),
        }
    }
}
