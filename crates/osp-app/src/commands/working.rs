//! Reads sessions in the background, and takes the results of all background work.

use std::{
    io::{self, Write},
    path::Path,
    time::Duration,
};

use crate::{
    session::{OpenError, Opening, ReplayReader},
    studio::Studio,
    threads,
    tool::ToolChoice,
    working::{
        Done, Kind, Progress, ReadSession, ReplayStart, TURN, Task, ToDraw, ToPlay, WorkMode, WorkShown,
        Working, reading,
    },
};
use osp_session::{
    platform::fs,
    recording::{OpenOptions, Pace, RecordingError},
    replay::CameraChoice,
};

/// The window opens while a larger session is read, and shows its progress and its errors.
const MOST_SMALL_BYTES: u64 = 4 << 20;

impl Studio {
    /// Lets commands read and write files in the background. Without this call, a command returns only after it has
    /// finished its work.
    pub fn work_in_background(&mut self) {
        self.work.mode = match cfg!(target_arch = "wasm32") {
            true => WorkMode::Turns(TURN),
            false => WorkMode::Thread,
        };
    }

    /// Does the same as [`Studio::work_in_background`], but without a thread. Each call of [`Studio::tend`] then works
    /// for the time `turn`.
    pub fn work_in_turns(&mut self, turn: Duration) {
        self.work.mode = WorkMode::Turns(turn);
    }

    /// Waits until a small session at `path` is read, so that its errors come before the window. Nothing waits for a larger
    /// one, or for a pipe.
    pub fn wait_for_small(&mut self, path: &Path) {
        let is_large = |data: fs::Metadata| !data.is_file() || data.len() > MOST_SMALL_BYTES;
        let waits = !fs::metadata(path).is_ok_and(is_large);
        while waits && self.is_working() {
            threads::pause(Duration::from_millis(1));
            self.take_work();
        }
    }

    /// The progress of background work, once it has taken a while.
    pub fn work_shown(&self) -> Option<WorkShown> {
        self.work.working.as_ref()?.shown()
    }

    /// Whether there is background work.
    pub fn is_working(&self) -> bool {
        self.work.working.is_some()
    }

    /// Whether background work runs without a thread, and the next call of [`Studio::tend`] should follow soon.
    pub(crate) fn works_in_turns(&self) -> bool {
        self.work.working.as_ref().is_some_and(Working::is_in_turns)
    }

    /// Whether another session is being read. Meanwhile the current session accepts no events or commands.
    pub fn is_reading(&self) -> bool {
        self.work.working.as_ref().is_some_and(Working::is_reading)
    }

    /// Whether there is background work; if so, shows that the user has to wait.
    pub(crate) fn is_busy(&mut self) -> bool {
        let Some(work) = &self.work.working else { return false };
        let busy = format!("{}: wait until this is done, or cancel it", work.what());
        self.report_file(Err(busy));
        true
    }

    /// Cancels the background work and removes its unfinished output.
    pub(crate) fn cancel_work(&mut self) {
        if let Some(work) = &self.work.working {
            work.cancel();
        }
    }

    /// Handles the outcome of the background work, and returns whether the work has ended. Work without a thread first
    /// continues for one turn.
    pub(crate) fn take_work(&mut self) -> bool {
        let Some(work) = &mut self.work.working else { return false };
        let Some(outcome) = work.poll() else { return false };
        let is_cancelled = work.is_cancelled();
        self.work.working = None;
        match outcome {
            // The session was read completely before the cancellation took effect.
            Ok(Done::Opened { path, outcome: Ok(read), .. }) if is_cancelled => {
                let closed = read.session.close();
                debug_assert!(closed.is_ok(), "nothing was drawn in it");
                self.report_file(Err(OpenError::Cancelled(path).to_string()));
            }
            Ok(Done::Played { path, .. }) if is_cancelled => {
                self.report_file(Err(OpenError::Cancelled(path).to_string()));
            }
            Ok(done) => self.take_done(done),
            Err(failed) => self.report_file(Err(failed)),
        }
        true
    }

    /// Ends the background work: waits until a model is written, or cancels the reading of a session and closes it.
    pub(crate) fn end_work(&mut self) -> Result<(), String> {
        let Some(work) = self.work.working.take() else { return Ok(()) };
        // A film takes minutes, and can be made again.
        if work.is_reading() || work.is_filming() {
            work.cancel();
        }
        match work.finish()? {
            Done::Opened { outcome: Ok(read), .. } => {
                // The window is closed, so the messages go to standard error.
                for remark in read.opened.remarks {
                    let _ = writeln!(io::stderr().lock(), "{remark}");
                }
                read.session.close().map_err(|error| error.to_string())
            }
            Done::Opened { .. } | Done::Played { .. } => Ok(()),
            Done::Exported { path, outcome } => {
                outcome.map(drop).map_err(|error| format!("{}: {error}", path.display()))
            }
        }
    }

    pub(crate) fn start(&mut self, what: String, kind: Kind, task: Box<dyn Task>) {
        match self.work.mode {
            WorkMode::AtOnce => {
                let done = task.run(&Progress::default());
                self.take_done(done);
                return;
            }
            WorkMode::Thread => match Working::on_thread(what, kind, task) {
                Ok(working) => self.work.working = Some(working),
                Err(error) => self.report_file(Err(error)),
            },
            WorkMode::Turns(turn) => self.work.working = Some(Working::in_turns(what, kind, turn, task)),
        }
        // Short work may have ended already.
        self.take_work();
    }

    fn take_done(&mut self, done: Done) {
        match done {
            Done::Opened { path, how, is_new, outcome } => self.take_opened(&path, how, is_new, outcome),
            Done::Played { outcome: Ok(session), start, .. } => {
                session.remarks().iter().for_each(|remark| self.show_message(remark.clone()));
                self.replace(*session, None);
                if start == ReplayStart::Finished {
                    self.show_finished();
                }
                self.report_file(Ok(String::new()));
            }
            Done::Played { outcome: Err(error), .. } => self.work.unread = Some(error),
            Done::Exported { path, outcome } => self.take_exported(&path, outcome),
        }
    }

    /// Returns and clears the error of a session that could not be read for a replay.
    pub fn take_unread(&mut self) -> Option<RecordingError> {
        self.work.unread.take()
    }

    /// Opens a session and replaces the current session. On an error the current session stays.
    pub(crate) fn open_in_background(&mut self, path: &Path, how: Opening) {
        self.end_hands_strokes();
        let how = Opening { limits: self.limits, ..how };
        let task = ToDraw::new(path.to_owned(), self.autosaves.clone(), how, self.culling.plan.clone());
        self.start(reading(path), Kind::Reading, Box::new(task));
    }

    /// Replays a session and replaces the current session. If reading fails, the current session stays, and
    /// [`Studio::take_unread`] returns the error.
    pub fn replay_in_background(
        &mut self,
        path: &Path,
        pace: Pace,
        camera: CameraChoice,
        options: &OpenOptions,
        start: ReplayStart,
    ) {
        if self.is_busy() {
            return;
        }
        // While the session is read, no release of a button arrives.
        self.finish_gestures();
        self.end_hands_strokes();
        let reader = ReplayReader::new(path, pace, camera, options);
        let task = ToPlay { path: path.to_owned(), reader, start };
        self.start(reading(path), Kind::Reading, Box::new(task));
    }

    /// Does the same as [`Studio::replay_in_background`] with the session's own pace and camera.
    pub(crate) fn replay_file(&mut self, path: &Path, start: ReplayStart) {
        let options = OpenOptions { limits: self.limits, ..OpenOptions::default() };
        self.replay_in_background(path, Pace::Recorded, CameraChoice::Auto, &options, start);
    }

    fn take_opened(
        &mut self,
        path: &Path,
        how: Opening,
        is_new: bool,
        outcome: Result<Box<ReadSession>, OpenError>,
    ) {
        match outcome {
            Ok(read) => {
                let ReadSession { session, opened, indexed } = *read;
                self.show_remarks(opened);
                self.replace(session, indexed);
                if how.draws && self.can_draw() {
                    self.set_tool(ToolChoice::Draw(self.input.brush.tool));
                }
                let text = if is_new {
                    format!("{}: there was no such file, so an empty session begins there", path.display())
                } else {
                    String::new()
                };
                self.report_file(Ok(text));
            }
            Err(error) => self.report_not_opened(path, how, error),
        }
    }
}
