//! Background work of the window: reading a session or writing a model. Without threads a session is read in parts
//! between frames, and a model is written in one call.

mod task;

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::Ordering::Relaxed,
        mpsc::{self, Receiver, TryRecvError},
    },
    time::Duration,
};

use super::{threads, turns::Turns};
use osp_session::platform::time::Instant;
pub use task::ReplayStart;
pub(super) use task::{Done, Exported, Progress, ReadSession, Task, ToDraw, ToPlay, Whole};

/// Duration of work after which its progress is shown. For shorter work the display would only flicker.
const SHOWN_AFTER: Duration = Duration::from_millis(200);
/// Duration of a turn of work in the browser; between turns the page shows frames and handles input.
pub(super) const TURN: Duration = Duration::from_millis(12);

/// Mode in which a command reads or writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum WorkMode {
    /// Immediately, before the command returns.
    #[default]
    AtOnce,
    Thread,
    /// In [`Studio::tend`](crate::Studio::tend), for this time in each call.
    Turns(Duration),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Reads a session, whose number of events is unknown.
    Reading,
    /// Writes `count` items to a file; `of` is their name, such as polygons.
    Writing { count: u64, of: &'static str },
    /// Makes a film of `count` pictures.
    Filming { count: u64 },
}

/// The thread that does the work, or the task that runs in turns.
enum Runner {
    Thread(Receiver<Done>),
    Turns(Turns, Box<dyn Task>),
}

impl std::fmt::Debug for Runner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Thread(_) => f.write_str("Thread"),
            Self::Turns(turns, _) => f.debug_tuple("Turns").field(turns).finish(),
        }
    }
}

#[derive(Debug)]
pub(super) struct Working {
    what: String,
    kind: Kind,
    progress: Arc<Progress>,
    runner: Runner,
    since: Instant,
}

impl Working {
    pub(super) fn on_thread(what: String, kind: Kind, task: Box<dyn Task>) -> Result<Self, String> {
        let (send, done) = mpsc::channel();
        let progress = Arc::new(Progress::default());
        let of_thread = Arc::clone(&progress);
        // If the window is closed, the result is dropped.
        threads::in_background("work", move || drop(send.send(task.run(&of_thread))))
            .map_err(|error| format!("{what}: {error}"))?;
        Ok(Self { what, kind, progress, runner: Runner::Thread(done), since: Instant::now() })
    }

    pub(super) fn in_turns(what: String, kind: Kind, turn: Duration, task: Box<dyn Task>) -> Self {
        Self {
            what,
            kind,
            progress: Arc::default(),
            runner: Runner::Turns(Turns::of(turn), task),
            since: Instant::now(),
        }
    }

    /// Returns the result, if the work has ended. Work without a thread first continues for one turn.
    pub(super) fn poll(&mut self) -> Option<Result<Done, String>> {
        let polled = match &mut self.runner {
            Runner::Thread(done) => done.try_recv(),
            Runner::Turns(turns, task) => {
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

    /// Completes the work and waits for its result.
    pub(super) fn finish(self) -> Result<Done, String> {
        let failed = self.failed();
        match self.runner {
            Runner::Thread(done) => done.recv().map_err(|_| failed),
            Runner::Turns(_, mut task) => loop {
                if let Some(done) = task.step(&self.progress) {
                    break Ok(done);
                }
            },
        }
    }

    fn failed(&self) -> String {
        format!("{}: failed without a result", self.what)
    }

    pub(super) fn what(&self) -> &str {
        &self.what
    }

    /// The progress, once the work has taken a while.
    pub(super) fn shown(&self) -> Option<WorkShown> {
        if self.since.elapsed() < SHOWN_AFTER {
            return None;
        }
        let done = self.progress.done.load(Relaxed);
        let of_all = |count: u64, of| {
            let part = (done as f32 / count.max(1) as f32).min(1.0);
            (format!("{done} of {count} {of}"), Some(part))
        };
        let (far, part) = match self.kind {
            Kind::Reading => (format!("{done} events"), None),
            Kind::Writing { count, of } => of_all(count, of),
            Kind::Filming { count } => of_all(count, "pictures"),
        };
        Some(WorkShown { text: format!("{}: {far}", self.what), part })
    }

    pub(super) fn cancel(&self) {
        self.progress.is_cancelled.store(true, Relaxed);
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.progress.is_cancelled.load(Relaxed)
    }

    pub(super) fn is_reading(&self) -> bool {
        self.kind == Kind::Reading
    }

    pub(super) fn is_filming(&self) -> bool {
        matches!(self.kind, Kind::Filming { .. })
    }

    pub(super) fn is_in_turns(&self) -> bool {
        matches!(self.runner, Runner::Turns(..))
    }
}

pub(super) fn reading(path: &Path) -> String {
    format!("reading {}", path.display())
}

/// The progress of background work, for the user.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkShown {
    /// Name of the work, and its progress.
    pub text: String,
    /// The completed part, 0 to 1, if known.
    pub part: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ExportKind {
    Model,
    Sketch,
    Film,
}

impl ExportKind {
    /// The kind of a file with this name; `None` if no export has such a name.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "glb" => Some(Self::Model),
            "tilt" => Some(Self::Sketch),
            "mp4" | "gif" => Some(Self::Film),
            _ => None,
        }
    }
}
