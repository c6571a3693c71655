//! What differs between a desktop and a page in a browser: the clock, the files, threads. Everything else of the crate is the
//! same on both.

#[cfg(any(target_arch = "wasm32", test))]
pub mod memory;

/// The files: those of the system, or on a page those in its memory.
pub mod fs {
    #[cfg(target_arch = "wasm32")]
    pub use super::memory::*;
    #[cfg(not(target_arch = "wasm32"))]
    pub use std::fs::*;
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

    /// Whether a file lies in a folder or below it, wherever symbolic links lead.
    pub(crate) fn lies_within(path: &Path, folder: &Path) -> std::io::Result<bool> {
        // The folder of a file without one.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        #[cfg(not(target_arch = "wasm32"))]
        return Ok(canonicalize(path)?.starts_with(canonicalize(folder)?));
        // There are no links in memory.
        #[cfg(target_arch = "wasm32")]
        return Ok(without_dots(path).starts_with(without_dots(folder)));
    }

    /// As [`Path::is_file`].
    pub fn is_file(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_file())
    }

    /// As [`Path::is_dir`].
    pub fn is_folder(path: &Path) -> bool {
        metadata(path).is_ok_and(|data| data.is_dir())
    }

    /// As [`Path::exists`].
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
pub use user_folder::user_folder;

/// The folder of the program's own files on a page, which are kept from one visit to the next.
#[cfg(target_arch = "wasm32")]
pub const USER_FOLDER: &str = "/osp";

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

/// Does something beside the window: on a thread of its own, or on a page, which has none, at once.
pub fn beside(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    if cfg!(target_arch = "wasm32") {
        work();
        return Ok(());
    }
    std::thread::Builder::new().name(name.to_owned()).spawn(work).map(drop)
}

/// Lets `make` hand over what it makes, and `take` take it in the same order on a thread of its own; where the system gives
/// none, as on a page, at once. At most `ahead` wait. Handing over gives false once `take` has failed: nothing is taken any more.
pub fn hand_over<T: Send, E: Send, R>(
    ahead: usize,
    take: impl FnMut(T) -> Result<(), E> + Send,
    make: impl FnOnce(&mut dyn FnMut(T) -> bool) -> R,
) -> (R, Result<(), E>) {
    use std::sync::{Mutex, PoisonError, mpsc::sync_channel};

    let take = Mutex::new(take);
    std::thread::scope(|scope| {
        let (send, things) = sync_channel(ahead);
        let of_thread = &take;
        let work = move || {
            let mut take = of_thread.lock().unwrap_or_else(PoisonError::into_inner);
            things.into_iter().try_for_each(&mut *take)
        };
        let thread = match cfg!(target_arch = "wasm32") {
            true => None,
            false => std::thread::Builder::new().spawn_scoped(scope, work).ok(),
        };
        if let Some(taking) = thread {
            let made = make(&mut |thing| send.send(thing).is_ok());
            drop(send);
            return (made, taking.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        let mut take = take.lock().unwrap_or_else(PoisonError::into_inner);
        let mut taken = Ok(());
        let made = make(&mut |thing| {
            if taken.is_ok() {
                taken = take(thing);
            }
            taken.is_ok()
        });
        (made, taken)
    })
}

/// Waits for a future, or on a page, which cannot wait, goes on and hands its outcome over later.
pub fn when_done<T: 'static>(work: impl Future<Output = T> + 'static, then: impl FnOnce(T) + 'static) {
    #[cfg(not(target_arch = "wasm32"))]
    then(pollster::block_on(work));
    #[cfg(target_arch = "wasm32")]
    wasm_bindgen_futures::spawn_local(async move { then(work.await) });
}

/// Waits a moment for another program; on a page there is none.
pub fn pause(time: std::time::Duration) {
    if !cfg!(target_arch = "wasm32") {
        std::thread::sleep(time);
    }
}

/// The number of this program among those that run.
pub fn process_id() -> u32 {
    if cfg!(target_arch = "wasm32") { 0 } else { std::process::id() }
}

/// The name of this machine.
pub fn host_name() -> String {
    #[cfg(not(target_arch = "wasm32"))]
    return gethostname::gethostname().to_string_lossy().into_owned();
    #[cfg(target_arch = "wasm32")]
    "this browser".to_owned()
}

#[cfg(test)]
mod tests {
    use super::hand_over;

    #[test]
    fn things_are_taken_in_their_order_until_one_is_refused() {
        let mut taken = Vec::new();
        let take = |n: u32| {
            taken.push(n);
            if n == 700 { Err(n) } else { Ok(()) }
        };
        let (made, outcome) = hand_over(3, take, |give| (0..1000).take_while(|&n| give(n)).count());
        assert_eq!(outcome, Err(700));
        assert!((701..=705).contains(&made), "{made}: it stops soon after that");
        assert!(taken.iter().copied().eq(0..=700));
    }
}
