use std::path::{Path, PathBuf};

use super::{
    journal::{Autosave, OpenElsewhere, Unwritten},
    session::{Access, OpenError, Opening},
    studio::Studio,
    working::check_model,
};
use osp_session::{
    output_file::{OutputKind, check_output},
    platform::fs,
};

/// A question that a person answers before the command is carried out. Until then nothing is written and nothing is lost.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Another window draws on the session that is to be opened.
    Held {
        /// Who has it.
        held: OpenElsewhere,
        /// Whether the window shows the session already, read-only.
        is_shown: bool,
    },
    /// A copy of a session is open of which there are edits already.
    Edits(Autosave),
    /// The session that is to be opened is damaged.
    Damaged {
        /// The session.
        path: PathBuf,
        /// Where and how.
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
        /// Which part, and why.
        reason: String,
        /// Whether the whole session is in another file.
        is_kept: bool,
        /// The command that asked.
        then: Then,
    },
    /// Everything drawn since the session was opened or saved under a name would be discarded.
    Discard {
        /// Events since.
        events: u64,
        /// Whether the session began with them.
        is_all: bool,
    },
}

/// What ends the current session.
#[derive(Clone, Debug, PartialEq)]
pub enum Then {
    /// The window closes.
    Close,
    /// An empty session begins.
    New,
    /// Another session is opened.
    Open(PathBuf, Opening),
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Open the session read-only.
    Look,
    /// Draw on a copy of it.
    Copy,
    /// Try once more to open it.
    TryAgain,
    /// Draw on a copy without the damaged pieces.
    Lenient,
    /// Replace the file.
    Replace,
    /// Choose another place first.
    SaveAs,
    /// Go on: with the edits, or without what could not be written.
    GoOn,
    /// Discard what was drawn.
    Discard,
    /// Leave everything as it is.
    Cancel,
}

impl Question {
    /// The title of the question.
    pub fn title(&self) -> &'static str {
        match self {
            Self::Held { .. } => "Open in another window",
            Self::Edits(_) => "Go on with the edits?",
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
                format!("{name} is being drawn on: {}.", held.holder())
            }
            Self::Edits(edits) => format!(
                "{} has been drawn on before: the edits, of {}, are in {}. Whatever you choose, they stay there.",
                edits.of(),
                edits.time(),
                edits.path().display()
            ),
            Self::Damaged { damage, .. } => format!("{damage}. What can be read can be drawn on, as a copy."),
            Self::SaveOver(path) | Self::ExportOver(path) | Self::PictureOver(path) => {
                format!("{} exists already.", path.display())
            }
            Self::Unwritten { reason, .. } => format!("{reason}."),
            Self::Discard { events, is_all } => {
                let since = if *is_all { "began" } else { "was opened, or saved under a name" };
                format!(
                    "{events} events since this session {since} leave it and its file. They cannot be brought back."
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
                &[(Answer::GoOn, "Go on with the edits"), (Answer::Cancel, "Open the original")]
            }
            Self::Damaged { .. } => &[(Answer::Lenient, "Open what can be read"), (Answer::Cancel, "Cancel")],
            Self::SaveOver(_) | Self::ExportOver(_) | Self::PictureOver(_) => {
                &[(Answer::Replace, "Replace"), (Answer::Cancel, "Cancel")]
            }
            Self::Unwritten { is_kept: true, .. } => &[
                (Answer::SaveAs, "Save elsewhere…"),
                (Answer::GoOn, "Go on, keep it there"),
                (Answer::Cancel, "Back"),
            ],
            Self::Unwritten { is_kept: false, .. } => &[
                (Answer::SaveAs, "Save elsewhere…"),
                (Answer::GoOn, "Go on, lose them"),
                (Answer::Cancel, "Back"),
            ],
            Self::Discard { .. } => &[(Answer::Discard, "Discard"), (Answer::Cancel, "Cancel")],
        }
    }

    /// The answer that changes nothing: that of the key Escape.
    pub fn safe_answer(&self) -> Answer {
        match self {
            Self::Held { is_shown: true, .. } => Answer::Look,
            _ => Answer::Cancel,
        }
    }
}

impl Studio {
    /// The question that the window shows.
    pub fn question(&self) -> Option<&Question> {
        self.question.as_ref()
    }

    /// Makes the window show a question.
    pub fn ask(&mut self, question: Question) {
        self.question = Some(question);
    }

    /// Asks whether to go on with earlier edits of the session that the window shows a copy of.
    pub(super) fn offer_edits(&mut self) {
        if self.question.is_none()
            && let Some(edits) = self.session.take_earlier()
        {
            self.ask(Question::Edits(edits));
        }
    }

    /// Whether a person has asked for the end, and nothing keeps it.
    pub fn is_closing(&self) -> bool {
        self.is_closing
    }

    /// Ends the session if all of it is written, else asks.
    pub fn ask_to_close(&mut self) {
        self.leave(Then::Close);
    }

    /// Closes the current session for another one, or asks if a part of it could not be written.
    pub(super) fn leave(&mut self, then: Then) {
        self.finish_gestures();
        if matches!(then, Then::Open(..)) && self.is_busy() {
            return;
        }
        self.question = None;
        if let Err(unwritten) = self.session.settle() {
            self.tend();
            let Unwritten { kept_in, .. } = &unwritten;
            let is_kept = kept_in.is_some();
            self.ask(Question::Unwritten { reason: unwritten.to_string(), is_kept, then });
            return;
        }
        self.go(then);
    }

    fn go(&mut self, then: Then) {
        match then {
            Then::Close => self.is_closing = true,
            Then::New => self.begin(),
            Then::Open(path, how) => self.open_or_ask(&path, how),
        }
    }

    fn begin(&mut self) {
        self.replace(self.new_session(), None);
    }

    fn open_or_ask(&mut self, path: &Path, how: Opening) {
        let journal = self.session.journal();
        if !self.session.is_replay() && journal.is_at(path) && how.access == Access::Write {
            if journal.trouble().is_none() {
                self.tell_of_file(Ok(format!("{}: is open already", path.display())));
                return;
            }
            // Another file lies there now, and our own session keeps it from being opened.
            self.begin();
        }
        self.open_beside(path, how);
    }

    /// Asks what to do with a session that could not be opened, or says why.
    pub(super) fn tell_not_opened(&mut self, path: &Path, how: Opening, error: OpenError) {
        match error {
            OpenError::Held(held) => {
                // Another window still has it: this one keeps showing it, read-only.
                let is_shown = !self.session.is_replay()
                    && self.session.is_read_only()
                    && self.session.path() == held.session();
                self.ask(Question::Held { held, is_shown });
            }
            error if error.is_damage() && !how.lenient => {
                self.ask(Question::Damaged { path: path.to_owned(), damage: error.to_string() });
            }
            error => self.tell_of_file(Err(error.to_string())),
        }
    }

    pub(super) fn ask_to_save_as(&mut self, path: PathBuf) {
        let journal = self.session.journal();
        let is_own = !self.session.is_replay() && journal.is_at(&path) && journal.trouble().is_none();
        if !is_own && fs::is_file(&path) {
            self.ask(Question::SaveOver(path));
        } else {
            self.save_as(&path);
        }
    }

    /// A model may replace a model if the person agrees; the export refuses to replace any other file.
    pub(super) fn ask_to_export(&mut self, path: PathBuf) {
        if fs::is_file(&path) && check_model(&path).is_ok() {
            self.ask(Question::ExportOver(path));
        } else {
            self.export_gltf(&path);
        }
    }

    /// A picture may replace a picture if the person agrees.
    pub(super) fn ask_for_picture(&mut self, path: PathBuf) {
        match check_output(&path, OutputKind::Png, false) {
            Err(error) => self.tell_of_file(Err(error.to_string())),
            Ok(()) if fs::is_file(&path) => self.ask(Question::PictureOver(path)),
            Ok(()) => self.picture = Some(path),
        }
    }

    /// A picture may replace a picture and no other file.
    pub(super) fn picture_over(&mut self, path: PathBuf) {
        match check_output(&path, OutputKind::Png, false) {
            Ok(()) => self.picture = Some(path),
            Err(error) => self.tell_of_file(Err(error.to_string())),
        }
    }

    pub(super) fn ask_to_discard(&mut self) {
        self.finish_gestures();
        let events = self.session.journal().new_events();
        if events > 0 && !self.session.is_shared() {
            let is_all = self.session.event_count() == events;
            self.ask(Question::Discard { events, is_all });
        }
    }

    /// Takes a person's answer to the question that is asked.
    pub(super) fn answer(&mut self, answer: Answer) {
        let may_open = |question: &Question| {
            matches!(question, Question::Held { .. } | Question::Edits(_) | Question::Damaged { .. })
        };
        if self.question.as_ref().is_some_and(may_open) && self.is_busy() {
            return;
        }
        let Some(question) = self.question.take() else { return };
        match (question, answer) {
            (Question::Held { held, is_shown }, _) => self.answer_held(&held, is_shown, answer),
            (Question::Edits(edits), Answer::GoOn) => {
                self.leave(Then::Open(edits.path().to_owned(), Opening::default()));
            }
            (Question::Damaged { path, .. }, Answer::Lenient) => {
                self.leave(Then::Open(path, Opening { lenient: true, ..Opening::with(Access::Copy) }));
            }
            (Question::SaveOver(path), Answer::Replace) => self.save_as(&path),
            (Question::ExportOver(path), Answer::Replace) => self.export_gltf(&path),
            (Question::PictureOver(path), Answer::Replace) => self.picture_over(path),
            (Question::Unwritten { then, .. }, Answer::GoOn) => self.go(then),
            (Question::Discard { .. }, Answer::Discard) => self.discard(),
            _ => {}
        }
    }

    fn answer_held(&mut self, held: &OpenElsewhere, is_shown: bool, answer: Answer) {
        let access = match answer {
            Answer::Look if is_shown => return,
            Answer::Look => Access::ReadOnly,
            Answer::Copy => Access::Copy,
            Answer::TryAgain => Access::Write,
            _ => return,
        };
        self.leave(Then::Open(held.session().to_owned(), Opening::with(access)));
    }

    fn discard(&mut self) {
        // What the hands draw next begins anew, and their senders join anew.
        self.end_hands_strokes();
        let events = self.session.journal().new_events();
        match self.session.discard() {
            Ok(()) => self.say(format!("{events} events discarded")),
            Err(error) => self.say(error.to_string()),
        }
        self.take_up_time();
        self.meet_session(None);
    }
}
