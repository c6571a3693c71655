//! Questions to the user before data is lost, and the actions for the answers.

use std::path::{Path, PathBuf};

use crate::{
    journal::{OpenElsewhere, Unwritten},
    question::{Answer, Question, Then},
    session::{Access, OpenError, Opening},
    studio::Studio,
    working::ReplayStart,
};
use osp_session::{output_file::check_output, platform::fs};

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
        self.replace(self.new_session(), None);
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
            OpenError::Held(held) => {
                // Another window still has the session open, and this window already shows it read-only.
                let is_shown = !self.session.is_replay()
                    && self.session.is_read_only()
                    && self.session.path() == held.session();
                self.ask(Question::Held { held, is_shown });
            }
            error if error.is_damage() && !how.lenient => {
                self.ask(Question::Damaged { path: path.to_owned(), damage: error.to_string() });
            }
            error => self.report_file(Err(error.to_string())),
        }
    }

    pub(crate) fn ask_to_save_as(&mut self, path: PathBuf) {
        let journal = self.session.journal();
        let is_own = !self.session.is_replay() && journal.is_at(&path) && journal.trouble().is_none();
        if !is_own && fs::is_file(&path) {
            self.ask(Question::SaveOver(path));
        } else {
            self.save_as(&path);
        }
    }

    /// Exports the model. If the path has a file that an export may replace, shows a question first.
    pub(crate) fn ask_to_export(&mut self, path: PathBuf) {
        if fs::is_file(&path) && self.may_export(&path).is_ok() {
            self.ask(Question::ExportOver(path));
        } else {
            self.export(&path);
        }
    }

    /// Saves the next frame as a picture. If the path already has a file, shows a question first.
    pub(crate) fn ask_for_picture(&mut self, path: PathBuf) {
        if fs::is_file(&path) && self.may_save_picture(&path).is_ok() {
            self.ask(Question::PictureOver(path));
        } else {
            self.picture_over(path);
        }
    }

    /// Saves the next frame as a picture. Replaces a file at the path, but not the shown session.
    pub(crate) fn picture_over(&mut self, path: PathBuf) {
        match self.may_save_picture(&path) {
            Ok(()) => self.work.picture = Some(path),
            Err(why_not) => self.report_file(Err(why_not)),
        }
    }

    fn may_save_picture(&self, path: &Path) -> Result<(), String> {
        self.is_not_shown(path)?;
        check_output(path, &[".png"], true).map_err(|error| error.to_string())
    }

    pub(crate) fn ask_to_discard(&mut self) {
        self.finish_gestures();
        let events = self.session.journal().new_events();
        if events > 0 && !self.session.is_shared() {
            let is_all = self.session.event_count() == events;
            self.ask(Question::Discard { events, is_all });
        }
    }

    /// Handles the user's answer to the open question.
    pub(crate) fn answer(&mut self, answer: Answer) {
        let may_open = |question: &Question| {
            matches!(question, Question::Held { .. } | Question::Edits(_) | Question::Damaged { .. })
        };
        if self.work.question.as_ref().is_some_and(may_open) && self.is_busy() {
            return;
        }
        let Some(question) = self.work.question.take() else { return };
        match (question, answer) {
            (Question::Held { held, is_shown }, _) => self.answer_held(&held, is_shown, answer),
            (Question::Edits(edits), Answer::GoOn) => {
                self.leave(Then::Open(edits.path().to_owned(), Opening::default()));
            }
            (Question::Damaged { path, .. }, Answer::Lenient) => {
                self.leave(Then::Open(path, Opening { lenient: true, ..Opening::with(Access::Copy) }));
            }
            (Question::SaveOver(path), Answer::Replace) => self.save_as(&path),
            (Question::ExportOver(path), Answer::Replace) => self.export(&path),
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
        // Ends the strokes of the tracked hands. Their senders join the new session again.
        self.end_hands_strokes();
        let events = self.session.journal().new_events();
        match self.session.discard() {
            Ok(()) => self.show_message(format!("{events} events discarded")),
            Err(error) => self.show_message(error.to_string()),
        }
        self.take_up_time();
        self.take_session(None);
    }
}
