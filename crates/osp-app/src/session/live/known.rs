//! The file in which a shared session was left.

use std::path::PathBuf;

use osp_session::recording::{Event, Session};

/// What a file holds of a session already. It is read beside the session, which brings the same events again.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) file: Session,
    pub(super) path: PathBuf,
    pub(super) left: u64,
}

impl Known {
    /// Takes those events away that the file has.
    ///
    /// # Errors
    /// The session has other ones: why nothing may be appended to the file.
    pub(super) fn pass_over(&mut self, events: &mut Vec<Event>) -> Result<(), String> {
        let mut there = 0;
        for event in events.iter().take(usize::try_from(self.left).unwrap_or(usize::MAX)) {
            if !matches!(self.file.events.next_event(), Ok(Some(known)) if known == *event) {
                return Err(self.is_other());
            }
            there += 1;
        }
        self.left -= there as u64;
        events.drain(..there);
        Ok(())
    }

    /// Whether the session has brought all that the file holds.
    pub(super) fn is_over(&self) -> bool {
        self.left == 0
    }

    /// What to say where the file is of another session.
    pub(super) fn is_other(&self) -> String {
        format!(
            "{}: expected the beginning of this session; the file is another's, and is left as it is",
            self.path.display()
        )
    }
}
