//! What differs between a desktop and a page in a browser: the clock, the files, threads. Everything else of the crate is the
//! same on both.

#[cfg(all(feature = "session", any(target_arch = "wasm32", test)))]
#[cfg_attr(not(target_arch = "wasm32"), expect(dead_code, reason = "pages use it; here it is only tested"))]
pub(crate) mod memory;

/// The files: those of the system, or on a page those in its memory.
#[cfg(feature = "session")]
pub(crate) mod fs {
    #[cfg(target_arch = "wasm32")]
    pub(crate) use super::memory::*;
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) use std::fs::*;
    use std::path::{Component, Path, PathBuf};

    /// A path without `.` and `..`.
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

    /// As [`Path::is_file`].
    pub(crate) fn is_file(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_file())
    }

    /// As [`Path::is_dir`].
    pub(crate) fn is_folder(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_dir())
    }

    /// As [`Path::exists`].
    #[cfg(feature = "window")]
    pub(crate) fn is_there(path: &Path) -> bool {
        metadata(path).is_ok()
    }
}

/// Compression.
#[cfg(feature = "formats")]
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use ::zstd;
#[cfg(all(feature = "formats", any(target_arch = "wasm32", test)))]
pub(crate) mod web_zstd;
#[cfg(all(feature = "formats", target_arch = "wasm32"))]
pub(crate) use web_zstd as zstd;

#[cfg(any(feature = "cli", feature = "window"))]
mod user_folder;
#[cfg(any(feature = "cli", feature = "window"))]
pub(crate) use user_folder::user_folder;

/// The folder of the program's own files on a page, which are kept from one visit to the next.
#[cfg(all(target_arch = "wasm32", any(feature = "formats", feature = "render")))]
pub const USER_FOLDER: &str = "/osp";

/// The clock.
pub(crate) mod time {
    #[cfg(not(all(target_arch = "wasm32", feature = "window")))]
    pub(crate) use std::time::Instant;
    #[cfg(all(target_arch = "wasm32", feature = "window"))]
    pub(crate) use web_time::Instant;

    /// The time of day.
    #[cfg(feature = "window")]
    pub(crate) fn now() -> std::time::SystemTime {
        #[cfg(not(target_arch = "wasm32"))]
        return std::time::SystemTime::now();
        #[cfg(target_arch = "wasm32")]
        {
            let since = web_time::SystemTime::now().duration_since(web_time::UNIX_EPOCH).unwrap_or_default();
            std::time::UNIX_EPOCH + since
        }
    }
}

/// Does something beside the window: on a thread of its own, or on a page, which has none, at once.
#[cfg(feature = "window")]
pub(crate) fn beside(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    if cfg!(target_arch = "wasm32") {
        work();
        return Ok(());
    }
    std::thread::Builder::new().name(name.to_owned()).spawn(work).map(drop)
}

/// Waits for a future, or on a page, which cannot wait, goes on and hands its outcome over later.
#[cfg(feature = "window")]
pub(crate) fn when_done<T: 'static>(work: impl Future<Output = T> + 'static, then: impl FnOnce(T) + 'static) {
    #[cfg(not(target_arch = "wasm32"))]
    then(pollster::block_on(work));
    #[cfg(target_arch = "wasm32")]
    wasm_bindgen_futures::spawn_local(async move { then(work.await) });
}

/// Waits a moment for another program; on a page there is none.
#[cfg(feature = "window")]
pub(crate) fn pause(time: std::time::Duration) {
    if !cfg!(target_arch = "wasm32") {
        std::thread::sleep(time);
    }
}

/// The number of this program among those that run.
#[cfg(feature = "window")]
pub(crate) fn process_id() -> u32 {
    if cfg!(target_arch = "wasm32") { 0 } else { std::process::id() }
}

/// The name of this machine.
#[cfg(feature = "window")]
pub(crate) fn host_name() -> String {
    #[cfg(not(target_arch = "wasm32"))]
    return gethostname::gethostname().to_string_lossy().into_owned();
    #[cfg(target_arch = "wasm32")]
    "this browser".to_owned()
}
