//! Signals that end the program, such as SIGTERM. They wait until the window has written its session.

use std::{sync::mpsc, time::Duration};

use winit::event_loop::EventLoopProxy;

use super::Wake;
use crate::threads;

/// Longest time for which a signal waits until the session is written.
const ANSWER_TIME: Duration = Duration::from_secs(3);
/// Longest time for which it then waits until a window with an unwritten session has closed.
const CLOSING_TIME: Duration = Duration::from_secs(10);

/// The signals that wait for an answer.
pub(super) struct Signals(mpsc::Receiver<mpsc::Sender<()>>);

impl Signals {
    /// Makes each signal wake the event loop and wait.
    pub(super) fn watch(wake: EventLoopProxy<Wake>) -> Self {
        let (send, signals) = mpsc::channel();
        osp_session::atomic_file::on_signal(Some(Box::new(move || {
            let (answer, written) = mpsc::channel();
            let is_asked = send.send(answer).is_ok() && wake.send_event(Wake).is_ok();
            // A window that closes with an error drops the answer.
            if is_asked && written.recv_timeout(ANSWER_TIME) == Err(mpsc::RecvTimeoutError::Disconnected) {
                threads::pause(CLOSING_TIME);
            }
        })));
        Self(signals)
    }

    /// A signal that waits. After an answer, it ends the program.
    pub(super) fn next(&self) -> Option<mpsc::Sender<()>> {
        self.0.try_recv().ok()
    }
}
