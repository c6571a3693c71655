//! Differences between a desktop and a web page: the clock, the files, threads. Everything else in the crate is the
//! same on both.

mod load;
#[cfg(any(target_arch = "wasm32", test))]
pub mod memory;

/// The file system; on a web page, files in memory.
pub mod fs {
    #[cfg(target_arch = "wasm32")]
    pub use super::memory::*;
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::fs::*;
    use std::path::{Component, Path, PathBuf};

    pub(crate) fn without_dots(path: &Path) -> PathBuf {
        let mut found = PathBuf::new();
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir if found.file_name().is_some() => drop(found.pop()),
                part => found.push(part),
            }
        }
        found
    }

    pub fn folder_of(path: &Path) -> &Path {
        path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// The path with every symbolic link resolved. The file need not exist, but its folder must.
    pub fn whole_path(path: &Path) -> Option<PathBuf> {
        let by_folder = || Some(canonicalize(folder_of(path)).ok()?.join(path.file_name()?));
        canonicalize(path).ok().or_else(by_folder)
    }

    /// Identity of a file, to detect whether another file has taken its name.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub struct Identity {
        #[cfg(unix)]
        device_and_inode: (u64, u64),
        #[cfg(not(unix))]
        created: Option<std::time::SystemTime>,
    }

    impl Identity {
        #[cfg(unix)]
        pub fn of(data: &Metadata) -> Self {
            use std::os::unix::fs::MetadataExt;
            Self { device_and_inode: (data.dev(), data.ino()) }
        }

        #[cfg(not(unix))]
        pub fn of(data: &Metadata) -> Self {
            Self { created: data.created().ok() }
        }
    }

    /// Whether an open file still has this name.
    pub fn is_at(file: &File, path: &Path) -> bool {
        let identity = |data: std::io::Result<Metadata>| data.map(|data| Identity::of(&data)).ok();
        let held = identity(file.metadata());
        held.is_some() && held == identity(metadata(path))
    }

    /// Whether a file lies in a folder or below it, after symbolic links are resolved.
    pub(crate) fn lies_within(path: &Path, folder: &Path) -> std::io::Result<bool> {
        // The parent of a file name without a folder is the current folder.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        #[cfg(not(target_arch = "wasm32"))]
        return Ok(canonicalize(path)?.starts_with(canonicalize(folder)?));
        // Files in memory have no symbolic links.
        #[cfg(target_arch = "wasm32")]
        return Ok(without_dots(path).starts_with(without_dots(folder)));
    }

    /// Whether the file's name ends in `ending`, in upper or lower case.
    pub fn has_ending(path: &Path, ending: &str) -> bool {
        path.file_name().is_some_and(|name| name.to_string_lossy().to_ascii_lowercase().ends_with(ending))
    }

    pub fn is_file(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_file())
    }

    pub fn is_folder(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_dir())
    }

    pub fn is_there(path: &Path) -> bool {
        metadata(path).is_ok()
    }
}

#[cfg(not(target_arch = "wasm32"))]
pub use ::zstd;
#[cfg(any(target_arch = "wasm32", test))]
pub mod web_zstd;
#[cfg(target_arch = "wasm32")]
pub use web_zstd as zstd;

mod user_folder;
#[cfg(target_arch = "wasm32")]
pub use user_folder::USER_FOLDER;
pub use user_folder::user_folder;

pub mod time {
    pub use super::load::Load;
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::time::Instant;
    #[cfg(target_arch = "wasm32")]
    pub use web_time::Instant;

    pub fn now() -> std::time::SystemTime {
        #[cfg(not(target_arch = "wasm32"))]
        return std::time::SystemTime::now();
        #[cfg(target_arch = "wasm32")]
        {
            let since = web_time::SystemTime::now().duration_since(web_time::UNIX_EPOCH).unwrap_or_default();
            std::time::UNIX_EPOCH + since
        }
    }
}

pub fn host_name() -> String {
    #[cfg(unix)]
    return rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(windows)]
    return std::env::var("COMPUTERNAME").unwrap_or_default();
    #[cfg(target_arch = "wasm32")]
    return "this browser".to_owned();
}
