//! Work beside the window: a session that is read, a model that is written. Where there are no threads, a session is read between
//! the frames, some of it at a time, and a model is written at once.

mod task;

use std::{
    io::{self, Write},
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
        mpsc::{self, Receiver, RecvTimeoutError, TryRecvError},
    },
    time::Duration,
};

use super::{
    culling::CullingPlan,
    journal::Autosaves,
    session::{OpenError, Opened, Opening, ReplayReader, Session},
    studio::Studio,
    threads,
    turns::Turns,
};
use osp_session::{
    atomic_file::AtomicFile,
    export::{ExportError, ExportOptions, GltfCounts, write_glb_watched},
    output_file::{OutputError, OutputKind, check_output},
    platform::time::Instant,
    recording::{OpenOptions, Pace},
    replay::CameraChoice,
};
use task::{Done, ReadSession, Task, ToDraw, ToPlay, Whole};

/// Work that is over sooner is not shown: the window would only flicker.
const SHOWN_AFTER: Duration = Duration::from_millis(200);
/// How long a page reads at a time: it shows frames and takes input between.
const TURN: Duration = Duration::from_millis(12);

/// How far some work has come, and whether it is to end.
#[derive(Debug, Default)]
struct Progress {
    done: AtomicU64,
    is_cancelled: AtomicBool,
    /// A window waits for it, and goes on meanwhile.
    has_window: AtomicBool,
}

impl Progress {
    /// Notes how much is done; returns whether to go on.
    fn note(&self, done: u64) -> bool {
        self.done.store(done, Relaxed);
        !self.is_cancelled.load(Relaxed)
    }

    /// Whether the model is to be inserted, too: a window that does not go on meanwhile inserts it itself.
    fn wants_index(&self) -> bool {
        self.has_window.load(Relaxed) && !self.is_cancelled.load(Relaxed)
    }
}

/// When a command that reads or writes does so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Way {
    /// At once: when it returns, it is done.
    #[default]
    AtOnce,
    /// On a thread.
    Thread,
    /// In [`Studio::tend`], so long at a time.
    Turns(Duration),
}

impl Way {
    /// How long to go on at a time with what is done between frames.
    #[cfg(feature = "live")]
    pub(super) fn turn(self) -> Duration {
        match self {
            Self::Turns(turn) => turn,
            Self::AtOnce | Self::Thread => TURN,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A session is read; how many events it has is not known before.
    Reading,
    /// A model of so many polygons is written.
    Writing { polygons: u64 },
}

/// Who does it.
enum By {
    Thread(Receiver<Done>),
    Turns(Turns, Box<dyn Task>),
}

impl std::fmt::Debug for By {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Thread(_) => f.write_str("Thread"),
            Self::Turns(turns, _) => f.debug_tuple("Turns").field(turns).finish(),
        }
    }
}

/// Work that is being done beside the window.
#[derive(Debug)]
pub(super) struct Working {
    /// What is done, for people.
    what: String,
    kind: Kind,
    progress: Arc<Progress>,
    by: By,
    since: Instant,
}

impl Working {
    /// Begins it on a thread of its own.
    fn on_thread(what: String, kind: Kind, task: Box<dyn Task>) -> Result<Self, String> {
        let (send, done) = mpsc::channel();
        let progress = Arc::new(Progress::default());
        let of_thread = Arc::clone(&progress);
        // A window that is gone hears nothing any more.
        threads::beside("work", move || drop(send.send(task.run(&of_thread))))
            .map_err(|error| format!("{what}: {error}"))?;
        Ok(Self { what, kind, progress, by: By::Thread(done), since: Instant::now() })
    }

    /// Takes it up for this long at a time.
    fn in_turns(what: String, kind: Kind, turn: Duration, task: Box<dyn Task>) -> Self {
        Self {
            what,
            kind,
            progress: Arc::default(),
            by: By::Turns(Turns::of(turn), task),
            since: Instant::now(),
        }
    }

    /// What has come of it, if that is known. It is worked on for a turn first, if it is done in turns.
    fn poll(&mut self) -> Result<Done, TryRecvError> {
        match &mut self.by {
            By::Thread(done) => done.try_recv(),
            By::Turns(turns, task) => {
                let since = Instant::now();
                let turn = turns.next(since);
                loop {
                    if let Some(done) = task.step(&self.progress) {
                        return Ok(done);
                    }
                    if since.elapsed() >= turn {
                        turns.end();
                        return Err(TryRecvError::Empty);
                    }
                }
            }
        }
    }

    fn is_in_turns(&self) -> bool {
        matches!(self.by, By::Turns(..))
    }
}

/// A session that is being read before there is a window for it.
#[derive(Debug)]
pub struct Reading(Working);

impl Reading {
    /// Starts to read a session to draw on it; once a window has taken it over, its model is inserted by this plan, too.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn to_draw(
        path: &Path,
        autosaves: &Autosaves,
        how: Opening,
        plan: CullingPlan,
    ) -> Result<Self, String> {
        let task = ToDraw::new(path.to_owned(), autosaves.clone(), how, plan);
        Working::on_thread(reading(path), Kind::Reading, Box::new(task)).map(Self)
    }

    /// Starts to read a session to play it, or with `plays` false to stand before its first frame.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn to_play(
        path: &Path,
        pace: Pace,
        camera: CameraChoice,
        options: OpenOptions,
        plays: bool,
    ) -> Result<Self, String> {
        let task = to_play(path, pace, camera, &options, plays, true);
        Working::on_thread(reading(path), Kind::Reading, Box::new(task)).map(Self)
    }

    /// Waits until it is read, at most this long (`None`: as long as it takes).
    pub fn wait(self, at_most: Option<Duration>) -> Waited {
        let By::Thread(done) = &self.0.by else { return Waited::GoesOn(self) };
        let done = match at_most {
            Some(time) => done.recv_timeout(time),
            None => done.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match done {
            Ok(Done::Opened { outcome, .. }) => Waited::Read(outcome.map(|read| (read.session, read.opened))),
            Ok(Done::Played { outcome, .. }) => {
                Waited::Read(outcome.map_err(OpenError::Recording).map(|session| {
                    let remarks =
                        session.remarks().iter().map(|remark| format!("warning: {remark}")).collect();
                    (*session, Opened { remarks, is_recovered: false })
                }))
            }
            // One that fails without a word is seen to have failed later, too.
            Ok(Done::Exported { .. }) | Err(_) => Waited::GoesOn(self),
        }
    }
}

/// What came of waiting.
#[derive(Debug)]
pub enum Waited {
    /// The session, or why it cannot be read.
    Read(Result<(Session, Opened), OpenError>),
    /// It is still being read.
    GoesOn(Reading),
}

fn reading(path: &Path) -> String {
    format!("reading {}", path.display())
}

fn to_play(
    path: &Path,
    pace: Pace,
    camera: CameraChoice,
    options: &OpenOptions,
    plays: bool,
    is_sole: bool,
) -> ToPlay {
    let reader = ReplayReader::new(path, pace, camera, options);
    ToPlay { path: path.to_owned(), reader, plays, is_sole }
}

/// Work beside the window as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkShown {
    /// What is done, and how far it has come.
    pub text: String,
    /// The part that is done, 0 to 1, if that is known.
    pub part: Option<f32>,
}

/// A model may replace a model and no other file. The person is asked before, and may agree to lose one of another program.
pub(crate) fn check_model(path: &Path) -> Result<(), OutputError> {
    match check_output(path, OutputKind::Glb, false) {
        Err(OutputError::ForeignModel { .. }) => Ok(()),
        other => other,
    }
}

impl Studio {
    /// Reads and writes beside the window from now on; until then a command has done what it says when it returns.
    pub fn work_beside(&mut self) {
        self.works = match cfg!(target_arch = "wasm32") {
            true => Way::Turns(TURN),
            false => Way::Thread,
        };
    }

    /// As [`Studio::work_beside`], but without a thread: each call of [`Studio::tend`] goes on with it for so long.
    pub fn work_in_turns(&mut self, turn: Duration) {
        self.works = Way::Turns(turn);
    }

    /// The work that has been going on for a while.
    pub fn work_shown(&self) -> Option<WorkShown> {
        let work = self.working.as_ref().filter(|work| work.since.elapsed() >= SHOWN_AFTER)?;
        let done = work.progress.done.load(Relaxed);
        let (far, part) = match work.kind {
            Kind::Reading => (format!("{done} events"), None),
            Kind::Writing { polygons } => {
                let part = (done as f32 / polygons.max(1) as f32).min(1.0);
                (format!("{done} of {polygons} polygons"), Some(part))
            }
        };
        Some(WorkShown { text: format!("{}: {far}", work.what), part })
    }

    /// Whether something is done beside the window.
    pub fn is_working(&self) -> bool {
        self.working.is_some()
    }

    /// Whether it is done in turns, so that whoever has time for it should come soon.
    pub(super) fn works_in_turns(&self) -> bool {
        self.working.as_ref().is_some_and(Working::is_in_turns)
    }

    /// Whether another session is being read: the one that is left takes nothing any more, and everything else waits.
    pub fn is_reading(&self) -> bool {
        self.working.as_ref().is_some_and(|work| work.kind == Kind::Reading)
    }

    /// Refuses what cannot be done beside other work, and says so.
    pub(super) fn is_busy(&mut self) -> bool {
        let Some(work) = &self.working else { return false };
        let busy = format!("{}: wait until this is done, or cancel it", work.what);
        self.tell_of_file(Err(busy));
        true
    }

    /// Ends the work beside the window; what it has written so far is removed.
    pub(super) fn cancel_work(&mut self) {
        if let Some(work) = &self.working {
            work.progress.is_cancelled.store(true, Relaxed);
        }
    }

    /// Takes the outcome of the work beside the window, if it is there. What is done in turns gets one.
    pub(super) fn take_work(&mut self) -> bool {
        let Some(work) = &mut self.working else { return false };
        match work.poll() {
            Err(TryRecvError::Empty) => return false,
            Ok(done) => {
                let is_cancelled = work.progress.is_cancelled.load(Relaxed);
                self.working = None;
                match done {
                    // It was read to its end before it heard of that.
                    Done::Opened { path, outcome: Ok(read), .. } if is_cancelled => {
                        let closed = read.session.close();
                        debug_assert!(closed.is_ok(), "nothing was drawn in it");
                        self.tell_of_file(Err(OpenError::Cancelled(path).to_string()));
                    }
                    Done::Played { path, is_sole, .. } if is_cancelled => {
                        self.end_unread(OpenError::Cancelled(path), is_sole);
                    }
                    done => self.take_done(done),
                }
            }
            Err(TryRecvError::Disconnected) => {
                let what = self.working.take().map(|work| work.what).unwrap_or_default();
                self.tell_of_file(Err(format!("{what}: it failed")));
            }
        }
        true
    }

    /// Waits for a model that is being written, and for a session that is being read to be given back. Returns why there is
    /// no model.
    pub(super) fn end_work(&mut self) -> Result<(), String> {
        let is_reading = self.is_reading();
        let Some(work) = self.working.take() else { return Ok(()) };
        if is_reading {
            work.progress.is_cancelled.store(true, Relaxed);
        }
        let done = match work.by {
            By::Thread(done) => done.recv(),
            By::Turns(_, mut task) => loop {
                if let Some(done) = task.step(&work.progress) {
                    break Ok(done);
                }
            },
        };
        match done {
            Ok(Done::Opened { outcome: Ok(read), .. }) => {
                // There is no window any more to say it.
                for remark in read.opened.remarks {
                    let _ = writeln!(io::stderr().lock(), "{remark}");
                }
                read.session.close().map_err(|error| error.to_string())
            }
            Ok(Done::Opened { .. } | Done::Played { .. }) => Ok(()),
            Ok(Done::Exported { path, outcome }) => {
                outcome.map(drop).map_err(|error| format!("{}: {error}", path.display()))
            }
            Err(_) => Err(format!("{}: it failed", work.what)),
        }
    }

    fn start(&mut self, what: String, kind: Kind, task: Box<dyn Task>) {
        match self.works {
            Way::AtOnce => {
                let done = task.run(&Progress::default());
                self.take_done(done);
                return;
            }
            Way::Thread => match Working::on_thread(what, kind, task) {
                Ok(working) => self.wait_for(working),
                Err(error) => self.tell_of_file(Err(error)),
            },
            Way::Turns(turn) => self.wait_for(Working::in_turns(what, kind, turn, task)),
        }
        // What is short may be done.
        self.take_work();
    }

    fn take_done(&mut self, done: Done) {
        match done {
            Done::Opened { path, how, is_new, outcome } => self.take_opened(&path, how, is_new, outcome),
            Done::Played { outcome: Ok(session), .. } => {
                session.remarks().iter().for_each(|remark| self.say(remark.clone()));
                self.replace(*session, None);
                self.tell_of_file(Ok(String::new()));
            }
            Done::Played { is_sole, outcome: Err(error), .. } => self.end_unread(error.into(), is_sole),
            Done::Exported { path, outcome } => self.take_exported(&path, outcome),
        }
    }

    /// A window that was opened for this session only has nothing to show.
    fn end_unread(&mut self, error: OpenError, is_sole: bool) {
        self.is_closing |= is_sole;
        if is_sole || !matches!(error, OpenError::Cancelled(_)) {
            self.unread = Some(error);
        } else {
            self.tell_of_file(Err(error.to_string()));
        }
    }

    /// Why the session of a replay is not shown; the window that was opened for it has closed.
    pub fn take_unread(&mut self) -> Option<OpenError> {
        self.unread.take()
    }

    /// Goes on with a session that is being read: it is shown as soon as it is there.
    pub fn take_over(&mut self, reading: Reading) {
        self.work_beside();
        self.wait_for(reading.0);
    }

    fn wait_for(&mut self, working: Working) {
        working.progress.has_window.store(true, Relaxed);
        self.working = Some(working);
    }

    /// Opens a session instead of the current one; on an error the current one stays.
    pub(super) fn open_beside(&mut self, path: &Path, how: Opening) {
        self.end_hands_strokes();
        let how = Opening { limits: self.limits, ..how };
        let task = ToDraw::new(path.to_owned(), self.autosaves.clone(), how, self.culling.plan().clone());
        self.start(reading(path), Kind::Reading, Box::new(task));
    }

    /// Replays a session from its beginning instead of the current one; if it cannot be read the current one stays, and
    /// [`Studio::take_unread`] says why.
    pub fn replay_beside(&mut self, path: &Path, pace: Pace, camera: CameraChoice, options: &OpenOptions) {
        if self.is_busy() {
            return;
        }
        // While it is read, nothing would hear that the button is released.
        self.finish_gestures();
        self.end_hands_strokes();
        let task = to_play(path, pace, camera, options, true, false);
        self.start(reading(path), Kind::Reading, Box::new(task));
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
                self.tell(opened);
                self.replace(session, indexed);
                let text = if is_new {
                    format!("{}: there was no such file: an empty session begins there", path.display())
                } else {
                    String::new()
                };
                self.tell_of_file(Ok(text));
            }
            Err(error) => self.tell_not_opened(path, how, error),
        }
    }

    pub(super) fn export_gltf(&mut self, path: &Path) {
        if self.is_busy() {
            return;
        }
        if let Err(error) = check_model(path) {
            self.tell_of_file(Err(error.to_string()));
            return;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let times = self.session.find_times();
        let eye_in_world = Some(self.navigator.eye());
        let (scene, path) = (self.scene().clone(), path.to_owned());
        let what = format!("writing {}", path.display());
        let kind = Kind::Writing { polygons: scene.counts().visible };
        let write = move |progress: &Progress| {
            let export = || {
                let times = Some(times(&|| progress.note(0)));
                let options = ExportOptions { times, eye_in_world, ..ExportOptions::default() };
                let mut file = AtomicFile::create(&path)?;
                let counts =
                    write_glb_watched(&scene, &name, &options, &mut file, &|done| progress.note(done))?;
                if !progress.note(counts.polygons) {
                    return Err(ExportError::Cancelled);
                }
                file.commit()?;
                Ok(counts)
            };
            let outcome = export();
            Done::Exported { path, outcome }
        };
        self.start(what, kind, Box::new(Whole::new(write)));
        if self.is_working() {
            // Whatever dialog is open when it is done has not asked for it.
            self.tell_of_file(Ok(String::new()));
        }
    }

    fn take_exported(&mut self, path: &Path, outcome: Result<GltfCounts, ExportError>) {
        let not_finite = outcome.as_ref().map_or(0, |counts| counts.not_finite);
        let outcome = outcome
            .map(|counts| format!("{} polygons exported to {}", counts.polygons, path.display()))
            .map_err(|error| format!("{}: {error}", path.display()));
        if self.works != Way::AtOnce {
            let (Ok(said) | Err(said)) = outcome;
            self.say(said);
        } else {
            self.tell_of_file(outcome);
        }
        if not_finite > 0 {
            self.say(format!("{not_finite} polygons at infinity were left out"));
        }
    }
}
