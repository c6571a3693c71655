//! Work beside the window: a session that is read, a model that is written. Where there are no threads, a session is read between
//! the frames, some of it at a time, and a model is written at once.

mod progress;
mod task;

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::Ordering::Relaxed,
        mpsc::{self, Receiver, RecvTimeoutError, TryRecvError},
    },
    time::Duration,
};

use super::{
    culling::CullingPlan,
    journal::Autosaves,
    session::{OpenError, Opened, Opening, ReplayReader, Session},
    threads,
    turns::Turns,
};
use osp_session::{
    output_file::{OutputError, OutputKind, check_output},
    platform::time::Instant,
    recording::{OpenOptions, Pace},
    replay::CameraChoice,
};
use task::ToPlay;

pub(super) use progress::Progress;
pub(super) use task::{Done, ReadSession, Task, ToDraw, Whole};

/// Work that is over sooner is not shown: the window would only flicker.
const SHOWN_AFTER: Duration = Duration::from_millis(200);
/// How long a page reads at a time: it shows frames and takes input between.
pub(super) const TURN: Duration = Duration::from_millis(12);

/// When a command that reads or writes does so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Way {
    /// At once: when it returns, it is done.
    #[default]
    AtOnce,
    /// On a thread.
    Thread,
    /// In [`Studio::tend`](crate::Studio::tend), so long at a time.
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
pub(super) enum Kind {
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
    pub(super) fn on_thread(what: String, kind: Kind, task: Box<dyn Task>) -> Result<Self, String> {
        let (send, done) = mpsc::channel();
        let progress = Arc::new(Progress::default());
        let of_thread = Arc::clone(&progress);
        // A window that is gone hears nothing any more.
        threads::beside("work", move || drop(send.send(task.run(&of_thread))))
            .map_err(|error| format!("{what}: {error}"))?;
        Ok(Self { what, kind, progress, by: By::Thread(done), since: Instant::now() })
    }

    /// Takes it up for this long at a time.
    pub(super) fn in_turns(what: String, kind: Kind, turn: Duration, task: Box<dyn Task>) -> Self {
        Self {
            what,
            kind,
            progress: Arc::default(),
            by: By::Turns(Turns::of(turn), task),
            since: Instant::now(),
        }
    }

    /// What has come of it, if that is known. It is worked on for a turn first, if it is done in turns.
    ///
    /// # Errors
    /// It failed without a word; the text says so to people.
    pub(super) fn poll(&mut self) -> Option<Result<Done, String>> {
        let polled = match &mut self.by {
            By::Thread(done) => done.try_recv(),
            By::Turns(turns, task) => {
                let since = Instant::now();
                let turn = turns.next(since);
                loop {
                    if let Some(done) = task.step(&self.progress) {
                        break Ok(done);
                    }
                    if since.elapsed() >= turn {
                        turns.end();
                        break Err(TryRecvError::Empty);
                    }
                }
            }
        };
        match polled {
            Err(TryRecvError::Empty) => None,
            Ok(done) => Some(Ok(done)),
            Err(TryRecvError::Disconnected) => Some(Err(self.failed())),
        }
    }

    /// Goes on to its end, and waits for it.
    ///
    /// # Errors
    /// It failed without a word; the text says so to people.
    pub(super) fn finish(self) -> Result<Done, String> {
        let failed = self.failed();
        match self.by {
            By::Thread(done) => done.recv().map_err(|_| failed),
            By::Turns(_, mut task) => loop {
                if let Some(done) = task.step(&self.progress) {
                    break Ok(done);
                }
            },
        }
    }

    fn failed(&self) -> String {
        format!("{}: it failed", self.what)
    }

    /// What is done, for people.
    pub(super) fn what(&self) -> &str {
        &self.what
    }

    /// How far it has come, once it has been going on for a while.
    pub(super) fn shown(&self) -> Option<WorkShown> {
        if self.since.elapsed() < SHOWN_AFTER {
            return None;
        }
        let done = self.progress.done.load(Relaxed);
        let (far, part) = match self.kind {
            Kind::Reading => (format!("{done} events"), None),
            Kind::Writing { polygons } => {
                let part = (done as f32 / polygons.max(1) as f32).min(1.0);
                (format!("{done} of {polygons} polygons"), Some(part))
            }
        };
        Some(WorkShown { text: format!("{}: {far}", self.what), part })
    }

    /// Lets it end soon.
    pub(super) fn cancel(&self) {
        self.progress.is_cancelled.store(true, Relaxed);
    }

    /// Whether it was told to end.
    pub(super) fn is_cancelled(&self) -> bool {
        self.progress.is_cancelled.load(Relaxed)
    }

    /// A window waits for it from now on, and goes on meanwhile.
    pub(super) fn for_window(self) -> Self {
        self.progress.has_window.store(true, Relaxed);
        self
    }

    /// Whether a session is read.
    pub(super) fn is_reading(&self) -> bool {
        self.kind == Kind::Reading
    }

    pub(super) fn is_in_turns(&self) -> bool {
        matches!(self.by, By::Turns(..))
    }
}

/// A session that is being read before there is a window for it.
#[derive(Debug)]
pub struct Reading(pub(super) Working);

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
            Ok(Done::Opened { outcome, .. }) => {
                Waited::Read(outcome.map(|read| (Box::new(read.session), read.opened)))
            }
            Ok(Done::Played { outcome, .. }) => {
                Waited::Read(outcome.map_err(OpenError::Recording).map(|session| {
                    let remarks =
                        session.remarks().iter().map(|remark| format!("warning: {remark}")).collect();
                    (session, Opened { remarks, is_recovered: false })
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
    Read(Result<(Box<Session>, Opened), OpenError>),
    /// It is still being read.
    GoesOn(Reading),
}

pub(super) fn reading(path: &Path) -> String {
    format!("reading {}", path.display())
}

pub(super) fn to_play(
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
