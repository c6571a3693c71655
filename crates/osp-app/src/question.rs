//! Questions to the user before data is lost, and the actions for the answers.

use std::path::{Path, PathBuf};

use crate::{
    command::Command,
    journal::{Autosave, OpenElsewhere, Unwritten},
    session::{Access, OpenError, Opening, Session},
    studio::Studio,
    working::ReplayStart,
};
use osp_session::{
    output_file::{check_output, is_same_file},
    platform::fs,
};

/// A question that the user must answer before a command is executed. Until then no file is written and no data are
/// lost.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Another window draws on the session that is to be opened.
    Held(OpenElsewhere),
    /// The session would be opened as a copy, and an earlier copy has edits.
    Edits(Autosave),
    /// The session that is to be opened is damaged.
    Damaged {
        path: PathBuf,
        /// Position and kind of the damage.
        damage: String,
    },
    /// The command would replace the file.
    Replace(PathBuf, Box<Command>),
    /// A part of the session could not be written.
    Unwritten {
        /// The unwritten part, and the error.
        reason: String,
        /// Whether another file has the whole session.
        is_kept: bool,
        /// The command to execute afterwards.
        then: Then,
    },
}

/// A command that ends the current session.
#[derive(Clone, Debug, PartialEq)]
pub enum Then {
    Close,
    /// An empty session begins.
    New,
    /// Another session is opened.
    Open(PathBuf, Opening),
    /// The session in a file is replayed.
    Play(PathBuf),
}

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
    Replace,
    /// Save the session under another path first.
    SaveAs,
    /// Continue: with the edits, or without the unwritten part.
    GoOn,
    /// Change nothing.
    Cancel,
}

impl Question {
    pub fn title(&self) -> &'static str {
        match self {
            Self::Held(_) => "This session is open in another window",
            Self::Edits(_) => "Continue with the edits?",
            Self::Damaged { .. } => "Damaged session",
            Self::Replace(..) => "Replace the file?",
            Self::Unwritten { .. } => "Not everything is written",
        }
    }

    pub fn text(&self) -> String {
        match self {
            Self::Held(held) => {
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
            Self::Replace(path, _) => format!("{} exists already.", path.display()),
            Self::Unwritten { reason, .. } => format!("{reason}."),
        }
    }

    /// The possible answers, with the labels of their buttons.
    pub fn answers(&self) -> &'static [(Answer, &'static str)] {
        match self {
            Self::Held(_) => &[
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
            Self::Replace(..) => &[(Answer::Replace, "Replace"), (Answer::Cancel, "Cancel")],
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
        }
    }

    /// The answer that has the keyboard: the one that people want, if it changes no file.
    pub fn first_answer(&self) -> Answer {
        match self {
            Self::Edits(_) => Answer::GoOn,
            _ => Answer::Cancel,
        }
    }
}

impl Studio {
    /// The question that the window shows.
    pub fn question(&self) -> Option<&Question> {
        self.work.question.as_ref()
    }

    /// Opens a question in the window.
    pub fn ask(&mut self, question: Question) {
        self.work.question = Some(question);
    }

    /// If the shown session is a copy, and an earlier copy of the same original has edits, opens a question. The user
    /// chooses whether to continue with these edits.
    pub(crate) fn offer_edits(&mut self) {
        if self.work.question.is_none()
            && let Some(edits) = self.session.take_earlier()
        {
            self.ask(Question::Edits(edits));
        }
    }

    /// Whether the user has closed the window and no question is open.
    pub fn is_closing(&self) -> bool {
        self.work.is_closing
    }

    /// Closes the window if the session is fully written, else shows a question.
    pub fn ask_to_close(&mut self) {
        self.leave(Then::Close);
    }

    /// Closes the current session and continues with `then`. Shows a question first if a part of the session could not
    /// be written.
    pub(crate) fn leave(&mut self, then: Then) {
        self.finish_gestures();
        if matches!(then, Then::Open(..) | Then::Play(_)) && self.is_busy() {
            return;
        }
        self.work.question = None;
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
            Then::Close => self.work.is_closing = true,
            Then::New => self.begin(),
            Then::Open(path, how) => self.open_or_ask(&path, how),
            Then::Play(path) => self.replay_file(&path, ReplayStart::Playing),
        }
    }

    fn begin(&mut self) {
        self.replace(Session::new(&self.autosaves), None);
    }

    fn open_or_ask(&mut self, path: &Path, how: Opening) {
        let journal = self.session.journal();
        if !self.session.is_replay() && journal.is_at(path) && how.access == Access::Write {
            if journal.trouble().is_none() {
                self.report_file(Ok(format!("{} is open already", path.display())));
                return;
            }
            // Another program has replaced the file. Our session must release its lock before the new file can be
            // opened.
            self.begin();
        }
        self.open_in_background(path, how);
    }

    /// Shows the choices for a session that could not be opened, or reports the error.
    pub(crate) fn report_not_opened(&mut self, path: &Path, how: Opening, error: OpenError) {
        match error {
            OpenError::Held(held) => self.ask(Question::Held(held)),
            error if error.is_damage() && !how.lenient => {
                self.ask(Question::Damaged { path: path.to_owned(), damage: error.to_string() });
            }
            error => self.report_file(Err(error.to_string())),
        }
    }

    /// Executes a command that writes a file. If the file exists, shows a question first, unless the user has confirmed
    /// to replace it.
    pub(crate) fn write_file(&mut self, command: Command, is_confirmed: bool) {
        let (Command::SaveAs(path) | Command::Export(path) | Command::Picture(path)) = &command else {
            return;
        };
        if let Err(why_not) = self.may_write(&command, path) {
            self.report_file(Err(why_not));
            return;
        }
        let journal = self.session.journal();
        let is_saved = matches!(command, Command::SaveAs(_)) && !self.session.is_replay();
        let is_own = is_saved && journal.is_at(path) && journal.trouble().is_none();
        if !is_confirmed && !is_own && fs::is_file(path) {
            self.ask(Question::Replace(path.clone(), Box::new(command)));
            return;
        }
        match command {
            Command::SaveAs(path) => self.save_as(&path),
            Command::Export(path) => self.export(&path),
            Command::Picture(path) => self.work.picture = Some(path),
            _ => {}
        }
    }

    /// Whether a command may write this file. A picture or an export must not replace the shown session, because it
    /// contains less.
    fn may_write(&self, command: &Command, path: &Path) -> Result<(), String> {
        let endings: &'static [&'static str] = match command {
            Command::Picture(_) => &[".png"],
            Command::Export(_) => &[".glb", ".tilt", ".mp4", ".gif"],
            _ => return Ok(()),
        };
        if is_same_file(path, self.session.path()) {
            return Err(format!("{}: expected another file; the window shows this session", path.display()));
        }
        check_output(path, endings, true).map_err(|error| error.to_string())
    }

    pub(crate) fn answer(&mut self, answer: Answer) {
        let may_open = |question: &Question| {
            matches!(question, Question::Held(_) | Question::Edits(_) | Question::Damaged { .. })
        };
        if self.work.question.as_ref().is_some_and(may_open) && self.is_busy() {
            return;
        }
        let Some(question) = self.work.question.take() else { return };
        match (question, answer) {
            (Question::Held(held), _) => self.answer_held(&held, answer),
            (Question::Edits(edits), Answer::GoOn) => {
                self.leave(Then::Open(edits.path().to_owned(), Opening::default()));
            }
            (Question::Damaged { path, .. }, Answer::Lenient) => {
                self.leave(Then::Open(path, Opening { lenient: true, ..Opening::with(Access::Copy) }));
            }
            (Question::Replace(_, command), Answer::Replace) => self.write_file(*command, true),
            (Question::Unwritten { then, .. }, Answer::GoOn) => self.go(then),
            _ => {}
        }
    }

    fn answer_held(&mut self, held: &OpenElsewhere, answer: Answer) {
        let access = match answer {
            Answer::Look => Access::ReadOnly,
            Answer::Copy => Access::Copy,
            Answer::TryAgain => Access::Write,
            _ => return,
        };
        self.leave(Then::Open(held.session().to_owned(), Opening::with(access)));
    }
}
