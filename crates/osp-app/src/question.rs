use std::path::PathBuf;

use super::{
    journal::{Autosave, OpenElsewhere},
    session::Opening,
};

/// A question that the user must answer before a command is executed. Until then no file is written and no data are
/// lost.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Another window draws on the session that is to be opened.
    Held {
        /// The holder of the session's lock.
        held: OpenElsewhere,
        /// Whether the window already shows the session, read-only.
        is_shown: bool,
    },
    /// The session would be opened as a copy, and an earlier copy has edits.
    Edits(Autosave),
    /// The session that is to be opened is damaged.
    Damaged {
        /// The session.
        path: PathBuf,
        /// Position and kind of the damage.
        damage: String,
    },
    /// A session would replace a file.
    SaveOver(PathBuf),
    /// A model would replace a file.
    ExportOver(PathBuf),
    /// A picture would replace a file.
    PictureOver(PathBuf),
    /// A part of the session could not be written.
    Unwritten {
        /// The unwritten part, and the error.
        reason: String,
        /// Whether another file has the whole session.
        is_kept: bool,
        /// The command to execute afterwards.
        then: Then,
    },
    /// Everything drawn since the session was opened or saved under a name would be discarded.
    Discard {
        /// Number of events to discard.
        events: u64,
        /// Whether the session has no other events.
        is_all: bool,
    },
}

/// A command that ends the current session.
#[derive(Clone, Debug, PartialEq)]
pub enum Then {
    /// The window closes.
    Close,
    /// An empty session begins.
    New,
    /// Another session is opened.
    Open(PathBuf, Opening),
    /// The session in a file is replayed.
    Play(PathBuf),
}

/// An answer to a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Open the session read-only.
    Look,
    /// Draw on a copy of the session.
    Copy,
    /// Try again to open the session.
    TryAgain,
    /// Draw on a copy without the damaged parts.
    Lenient,
    /// Replace the file.
    Replace,
    /// Save the session under another path first.
    SaveAs,
    /// Continue: with the edits, or without the unwritten part.
    GoOn,
    /// Discard the new events.
    Discard,
    /// Change nothing.
    Cancel,
}

impl Question {
    /// The title of the question.
    pub fn title(&self) -> &'static str {
        match self {
            Self::Held { .. } => "This session is open in another window",
            Self::Edits(_) => "Continue with the edits?",
            Self::Damaged { .. } => "Damaged session",
            Self::SaveOver(_) | Self::ExportOver(_) | Self::PictureOver(_) => "Replace the file?",
            Self::Unwritten { .. } => "Not everything is written",
            Self::Discard { .. } => "Discard what was drawn?",
        }
    }

    /// The text of the question.
    pub fn text(&self) -> String {
        match self {
            Self::Held { held, .. } => {
                let name = held.session().file_name().unwrap_or_default().to_string_lossy();
                format!("{name} is open for drawing: {}.", held.holder())
            }
            Self::Edits(edits) => format!(
                "You edited {} before, on {}: the edits are in {} and stay there.",
                edits.of(),
                edits.time(),
                edits.path().display()
            ),
            Self::Damaged { damage, .. } => format!("{damage}. You can draw on a copy of the readable part."),
            Self::SaveOver(path) | Self::ExportOver(path) | Self::PictureOver(path) => {
                format!("{} exists already.", path.display())
            }
            Self::Unwritten { reason, .. } => format!("{reason}."),
            Self::Discard { events, is_all } => {
                let since = if *is_all { "began" } else { "was opened, or saved under a name" };
                format!(
                    "{events} changes since this session {since} will be deleted, also in its file. They cannot be brought back."
                )
            }
        }
    }

    /// The possible answers, with the labels of their buttons.
    pub fn answers(&self) -> &'static [(Answer, &'static str)] {
        match self {
            Self::Held { is_shown: true, .. } => &[
                (Answer::Look, "Only look"),
                (Answer::Copy, "Draw on a copy"),
                (Answer::TryAgain, "Try again"),
            ],
            Self::Held { is_shown: false, .. } => &[
                (Answer::Look, "Only look"),
                (Answer::Copy, "Draw on a copy"),
                (Answer::TryAgain, "Try again"),
                (Answer::Cancel, "Cancel"),
            ],
            Self::Edits(_) => {
                &[(Answer::GoOn, "Continue with the edits"), (Answer::Cancel, "Open the original")]
            }
            Self::Damaged { .. } => {
                &[(Answer::Lenient, "Open the readable part"), (Answer::Cancel, "Cancel")]
            }
            Self::SaveOver(_) | Self::ExportOver(_) | Self::PictureOver(_) => {
                &[(Answer::Replace, "Replace"), (Answer::Cancel, "Cancel")]
            }
            Self::Unwritten { is_kept: true, .. } => &[
                (Answer::SaveAs, "Save elsewhere…"),
                (Answer::GoOn, "Continue; the autosave keeps the changes"),
                (Answer::Cancel, "Back"),
            ],
            Self::Unwritten { is_kept: false, .. } => &[
                (Answer::SaveAs, "Save elsewhere…"),
                (Answer::GoOn, "Continue, lose the events"),
                (Answer::Cancel, "Back"),
            ],
            Self::Discard { .. } => &[(Answer::Discard, "Discard"), (Answer::Cancel, "Cancel")],
        }
    }

    /// The answer that has the keyboard: the one that people want, if it changes no file.
    pub fn first_answer(&self) -> Answer {
        match self {
            Self::Edits(_) => Answer::GoOn,
            _ => self.safe_answer(),
        }
    }

    /// The answer that changes nothing, for the key Escape.
    pub fn safe_answer(&self) -> Answer {
        match self {
            Self::Held { is_shown: true, .. } => Answer::Look,
            _ => Answer::Cancel,
        }
    }
}
