//! A thread for what waits for the network.

use std::io;
use std::thread::{Builder, JoinHandle};

use tokio::{runtime, sync::oneshot};

/// Work on a thread of its own, which ends with it, or when this is dropped.
#[derive(Debug)]
pub(crate) struct Background {
    /// Dropping it ends the work.
    close: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Background {
    /// Begins what `work` makes, on a thread of this name.
    ///
    /// # Errors
    /// The system gives no thread, or nothing to wait with.
    pub(crate) fn start<W: Future<Output = ()>>(
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
            // A look-up of a name may hang.
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
            // A panic there was printed there.
            let _ = thread.join();
        }
    }
}
