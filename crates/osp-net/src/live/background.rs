//! A thread for work that waits for the network.

use std::io;
use std::thread::{Builder, JoinHandle};

use tokio::{runtime, sync::oneshot};

/// Work on a thread of its own. The thread ends with the work, or when this value is dropped.
#[derive(Debug)]
pub(super) struct Background {
    /// Dropping this sender ends the work.
    close: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Background {
    /// Starts a thread with this name and runs the future of `work` on it.
    pub(super) fn start<W: Future<Output = ()>>(
        name: &str,
        work: impl FnOnce() -> W + Send + 'static,
    ) -> io::Result<Self> {
        let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
        let (close, closing) = oneshot::channel();
        let run = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = work() => {}
                    _ = closing => {}
                }
            });
            // The shutdown does not wait, because a DNS look-up may hang.
            runtime.shutdown_background();
        };
        let thread = Builder::new().name(name.to_owned()).spawn(run)?;
        Ok(Self { close: Some(close), thread: Some(thread) })
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        drop(self.close.take());
        if let Some(thread) = self.thread.take() {
            // If the thread has panicked, it has printed the panic itself.
            let _ = thread.join();
        }
    }
}
