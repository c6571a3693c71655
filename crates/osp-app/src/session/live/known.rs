//! The recording of a shared session that was joined before.

use std::path::PathBuf;

use osp_session::recording::{Event, Session};

/// The events of a shared session that its file already has. The server sends them again, and they are compared with
/// the file.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) file: Session,
    pub(super) path: PathBuf,
    /// Number of the file's events that the server has not sent yet.
    pub(super) left: u64,
}

impl Known {
    /// Removes the events that the file has already.
    pub(super) fn pass_over(&mut self, events: &mut Vec<Event>) -> Result<(), String> {
        let mut there = 0;
        for event in events.iter().take(usize::try_from(self.left).unwrap_or(usize::MAX)) {
            if !matches!(self.file.events.next_event(), Ok(Some(known)) if known == *event) {
                return Err(self.other_session_message());
            }
            there += 1;
        }
        self.left -= there as u64;
        events.drain(..there);
        Ok(())
    }

    /// Whether the server has sent all events of the file.
    pub(super) fn is_over(&self) -> bool {
        self.left == 0
    }

    /// The message for the user if the file belongs to another session.
    pub(super) fn other_session_message(&self) -> String {
        format!(
            "{}: expected the beginning of this session; the file belongs to another one and was not changed",
            self.path.display()
        )
    }
}
