//! Differences between a desktop and a web page: the clock, the files, threads. Everything else in the crate is the
//! same on both.

#[cfg(any(target_arch = "wasm32", test))]
pub mod memory;

/// The file system; on a web page, files in memory.
pub mod fs {
    #[cfg(target_arch = "wasm32")]
    pub use super::memory::*;
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::fs::*;
    use std::path::{Component, Path, PathBuf};

    /// Returns the path without `.` and `..`.
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

    /// Does the same as [`Path::is_file`].
    pub fn is_file(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_file())
    }

    /// Does the same as [`Path::is_dir`].
    pub fn is_folder(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_dir())
    }

    /// Does the same as [`Path::exists`].
    pub fn is_there(path: &Path) -> bool {
        metadata(path).is_ok()
    }
}

/// Compression.
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

/// The clock.
pub mod time {
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::time::Instant;
    #[cfg(target_arch = "wasm32")]
    pub use web_time::Instant;

    /// The time of day.
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

/// The name of this machine.
pub fn host_name() -> String {
    #[cfg(unix)]
    return rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(windows)]
    return std::env::var("COMPUTERNAME").unwrap_or_default();
    #[cfg(target_arch = "wasm32")]
    return "this browser".to_owned();
}
