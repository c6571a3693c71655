//! Work beside the window: a session that is read, a model that is written. Where there are no threads, it is done at once.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
        mpsc::{self, Receiver, RecvTimeoutError, TryRecvError},
    },
    time::Duration,
};

use super::{
    culling::{CullingPlan, Indexed},
    document::{Document, OpenError, Opened, Opening},
    journal::Autosaves,
    player::Player,
    studio::Studio,
    subject::Subject,
};
use crate::{
    atomic_file::AtomicFile,
    export::{ExportError, ExportOptions, GltfCounts, PolygonTimes, write_glb_watched},
    output_file::{OutputKind, check_output},
    platform::{self, time::Instant},
    recording::{OpenOptions, Pace, RecordingError},
    replay::CameraChoice,
};

/// Work that is over sooner is not shown: the window would only flicker.
const SHOWN_AFTER: Duration = Duration::from_millis(200);

/// Finds when polygons were drawn, as long as it is told to go on.
type FindTimes = Box<dyn FnOnce(&dyn Fn() -> bool) -> PolygonTimes + Send>;

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

/// A session to draw on.
#[derive(Debug)]
struct ReadSession {
    document: Document,
    opened: Opened,
    indexed: Option<Indexed>,
}

/// What came of it.
#[derive(Debug)]
enum Done {
    Played { path: PathBuf, outcome: Result<Box<Player>, RecordingError> },
    Opened { path: PathBuf, how: Opening, is_new: bool, outcome: Result<Box<ReadSession>, OpenError> },
    Exported { path: PathBuf, outcome: Result<GltfCounts, ExportError> },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A session is read; how many events it has is not known before.
    Reading,
    /// A model of so many polygons is written.
    Writing { polygons: u64 },
}

/// Work that is being done beside the window.
#[derive(Debug)]
pub(super) struct Working {
    /// What is done, for people.
    what: String,
    kind: Kind,
    progress: Arc<Progress>,
    done: Receiver<Done>,
    since: Instant,
}

impl Working {
    /// Begins it on a thread of its own, or where there are no threads does it at once.
    fn start(
        what: String,
        kind: Kind,
        work: impl FnOnce(&Progress) -> Done + Send + 'static,
    ) -> Result<Self, String> {
        let (send, done) = mpsc::channel();
        let progress = Arc::new(Progress::default());
        let of_thread = Arc::clone(&progress);
        // A window that is gone hears nothing any more.
        platform::beside("work", move || drop(send.send(work(&of_thread))))
            .map_err(|error| format!("{what}: {error}"))?;
        Ok(Self { what, kind, progress, done, since: Instant::now() })
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
        Working::start(reading(path), Kind::Reading, read(path, autosaves, how, plan)).map(Self)
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
        let (what, path) = (reading(path), path.to_owned());
        let read = move |progress: &Progress| {
            let player = Player::open_watched(&path, pace, camera, &options, &|done| progress.note(done));
            let outcome = player.map(|mut player| {
                player.play(plays);
                Box::new(player)
            });
            Done::Played { path, outcome }
        };
        Working::start(what, Kind::Reading, read).map(Self)
    }

    /// Waits until it is read, at most this long (`None`: as long as it takes).
    pub fn wait(self, at_most: Option<Duration>) -> Waited {
        let done = match at_most {
            Some(time) => self.0.done.recv_timeout(time),
            None => self.0.done.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match done {
            Ok(Done::Opened { outcome, .. }) => {
                Waited::Read(outcome.map(|read| (Subject::Sketch(Box::new(read.document)), read.opened)))
            }
            Ok(Done::Played { outcome, .. }) => {
                Waited::Read(outcome.map_err(OpenError::Recording).map(|player| {
                    let remarks =
                        player.remarks().iter().map(|remark| format!("warning: {remark}")).collect();
                    (Subject::Replay(player), Opened { remarks, is_recovered: false })
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
    Read(Result<(Subject, Opened), OpenError>),
    /// It is still being read.
    GoesOn(Reading),
}

fn reading(path: &Path) -> String {
    format!("reading {}", path.display())
}

fn read(
    path: &Path,
    autosaves: &Autosaves,
    how: Opening,
    plan: CullingPlan,
) -> impl FnOnce(&Progress) -> Done + Send + use<> {
    let (path, autosaves) = (path.to_owned(), autosaves.clone());
    move |progress| {
        let is_new = !platform::fs::is_there(&path);
        let opened = Document::open_watched(&path, &autosaves, how, &|done| progress.note(done));
        let outcome = opened.map(|(document, opened)| {
            let indexed = progress.wants_index().then(|| plan.index(document.scene(), &document.bounds()));
            Box::new(ReadSession { document, opened, indexed })
        });
        Done::Opened { path, how, is_new, outcome }
    }
}

/// Work beside the window as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkShown {
    /// What is done, and how far it has come.
    pub text: String,
    /// The part that is done, 0 to 1, if that is known.
    pub part: Option<f32>,
}

impl Studio {
    /// Reads and writes beside the window from now on; until then a command has done what it says when it returns.
    pub fn work_beside(&mut self) {
        self.works_beside = true;
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

    /// Takes the outcome of the work beside the window, if it is there.
    pub(super) fn take_work(&mut self) -> bool {
        let Some(work) = &self.working else { return false };
        match work.done.try_recv() {
            Err(TryRecvError::Empty) => return false,
            Ok(done) => {
                let is_cancelled = work.progress.is_cancelled.load(Relaxed);
                self.working = None;
                match done {
                    // It was read to its end before it heard of that.
                    Done::Opened { path, outcome: Ok(read), .. } if is_cancelled => {
                        let closed = read.document.close();
                        debug_assert!(closed.is_ok(), "nothing was drawn in it");
                        self.tell_of_file(Err(OpenError::Cancelled(path).to_string()));
                    }
                    Done::Played { path, .. } if is_cancelled => {
                        self.end_unread(OpenError::Cancelled(path));
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
        match work.done.recv() {
            Ok(Done::Opened { outcome: Ok(read), .. }) => {
                // There is no window any more to say it.
                for remark in read.opened.remarks {
                    let _ = writeln!(io::stderr().lock(), "{remark}");
                }
                read.document.close().map_err(|error| error.to_string())
            }
            Ok(Done::Opened { .. } | Done::Played { .. }) => Ok(()),
            Ok(Done::Exported { path, outcome }) => {
                outcome.map(drop).map_err(|error| format!("{}: {error}", path.display()))
            }
            Err(_) => Err(format!("{}: it failed", work.what)),
        }
    }

    fn start(&mut self, what: String, kind: Kind, work: impl FnOnce(&Progress) -> Done + Send + 'static) {
        if !self.works_beside {
            let done = work(&Progress::default());
            self.take_done(done);
            return;
        }
        match Working::start(what, kind, work) {
            Ok(working) => self.wait_for(working),
            Err(error) => self.tell_of_file(Err(error)),
        }
        // Where there are no threads it is done.
        self.take_work();
    }

    fn take_done(&mut self, done: Done) {
        match done {
            Done::Opened { path, how, is_new, outcome } => self.take_opened(&path, how, is_new, outcome),
            Done::Played { outcome: Ok(player), .. } => {
                player.remarks().iter().for_each(|remark| self.say(remark.clone()));
                self.replace(Subject::Replay(player), None);
                self.tell_of_file(Ok(String::new()));
            }
            Done::Played { outcome: Err(error), .. } => self.end_unread(error.into()),
            Done::Exported { path, outcome } => self.take_exported(&path, outcome),
        }
    }

    /// Without its session there is nothing that a replay could show.
    fn end_unread(&mut self, error: OpenError) {
        self.unread = Some(error);
        self.is_closing = true;
    }

    /// Why the window of a replay has closed before it showed anything.
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
        // Strokes of a tracker end in the session that they began in.
        let t = self.now_secs();
        self.hands.stop(t, &mut self.events);
        self.apply_events();
        let how = Opening { limits: self.limits, ..how };
        let read = read(path, &self.autosaves, how, self.culling.plan().clone());
        self.start(reading(path), Kind::Reading, read);
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
                let ReadSession { document, opened, indexed } = *read;
                self.tell(opened);
                self.replace(Subject::Sketch(Box::new(document)), indexed);
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
        // A model may replace a model and no other file.
        if let Err(error) = check_output(path, OutputKind::Glb, false) {
            self.tell_of_file(Err(error.to_string()));
            return;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let times: FindTimes = match &self.subject {
            Subject::Sketch(document) => {
                let times = document.polygon_times().clone();
                Box::new(|_| times)
            }
            Subject::Replay(player) => Box::new(player.polygon_times()),
        };
        let eye_in_world = Some(self.navigator.eye());
        let (scene, path) = (self.scene().clone(), path.to_owned());
        let what = format!("writing {}", path.display());
        self.start(what, Kind::Writing { polygons: scene.counts().visible }, move |progress| {
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
        });
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
        if self.works_beside {
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
