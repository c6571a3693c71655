//! Work in steps. A thread takes all steps. A web page takes as many steps as it has time for before the next frame.

use std::{
    io,
    path::PathBuf,
    sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
};

use crate::{
    culling::{CullingPlan, Indexed, Indexing},
    journal::Autosaves,
    session::{OpenError, Opened, Opening, ReplayReader, Session, SessionReader, Started},
};
use osp_session::{
    export::{ExportError, GltfCounts, TiltCounts},
    platform::fs,
    recording::RecordingError,
};

/// The state in which a replay appears once it has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayStart {
    /// The replay plays from its first frame.
    Playing,
    /// The replay is paused before its first frame.
    Paused,
    /// The replay shows the finished model from the artist's last view.
    Finished,
}

/// A session that was read for drawing, and the index of its model, if one was built.
#[derive(Debug)]
pub(crate) struct ReadSession {
    pub(crate) session: Session,
    pub(crate) opened: Opened,
    pub(crate) indexed: Option<Indexed>,
}

#[derive(Debug)]
pub(crate) enum Done {
    /// A session for a replay.
    Played {
        path: PathBuf,
        start: ReplayStart,
        outcome: Result<Box<Session>, RecordingError>,
    },
    Opened {
        path: PathBuf,
        how: Opening,
        is_new: bool,
        outcome: Result<Box<ReadSession>, OpenError>,
    },
    Exported {
        path: PathBuf,
        outcome: Result<Exported, ExportError>,
    },
}

/// The counts of a finished export.
#[derive(Debug)]
pub(crate) enum Exported {
    Model(GltfCounts),
    Sketch(TiltCounts),
    /// A line about the film.
    Film(String),
}

/// Work that can be done in steps.
pub(crate) trait Task: Send {
    /// Takes a step. The last step returns the result; after a cancellation the next step is the last.
    fn step(&mut self, progress: &Progress) -> Option<Done>;

    /// Takes all steps; some tasks use several threads.
    fn run(mut self: Box<Self>, progress: &Progress) -> Done {
        loop {
            if let Some(done) = self.step(progress) {
                return done;
            }
        }
    }
}

pub(crate) struct ToPlay {
    pub(crate) path: PathBuf,
    pub(crate) reader: ReplayReader,
    pub(crate) start: ReplayStart,
}

impl Task for ToPlay {
    fn step(&mut self, progress: &Progress) -> Option<Done> {
        let session = match progress.note(self.reader.events) {
            true => self.reader.step(),
            false => Err(RecordingError::io(&self.path, io::ErrorKind::Interrupted.into())),
        };
        let outcome = session.transpose()?.map(|mut session| {
            session.play(self.start == ReplayStart::Playing);
            Box::new(session)
        });
        Some(Done::Played { path: self.path.clone(), start: self.start, outcome })
    }
}

/// Reads a session for drawing and inserts its model into an index.
pub(crate) struct ToDraw {
    path: PathBuf,
    how: Opening,
    is_new: bool,
    plan: CullingPlan,
    autosaves: Autosaves,
    stage: Stage,
}

enum Stage {
    Closed,
    Reading(Box<SessionReader>),
    Indexing(Box<(Session, Opened, Indexing)>),
    Over,
}

impl ToDraw {
    pub(crate) fn new(path: PathBuf, autosaves: Autosaves, how: Opening, plan: CullingPlan) -> Self {
        Self { path, how, is_new: false, plan, autosaves, stage: Stage::Closed }
    }

    fn start(&mut self) -> Result<Started, OpenError> {
        self.is_new = !fs::is_there(&self.path);
        Session::start(&self.path, &self.autosaves, self.how)
    }

    fn done(&self, outcome: Result<ReadSession, OpenError>) -> Done {
        let outcome = outcome.map(Box::new);
        Done::Opened { path: self.path.clone(), how: self.how, is_new: self.is_new, outcome }
    }

    fn begin_index(&self, session: Session, opened: Opened) -> Stage {
        let indexing = self.plan.clone().begin_index(session.scene(), &session.bounds());
        Stage::Indexing(Box::new((session, opened, indexing)))
    }

    /// Takes a step. The last step returns the session.
    fn advance(&mut self, progress: &Progress) -> Result<Option<ReadSession>, OpenError> {
        let cancelled = || OpenError::Cancelled(self.path.clone());
        self.stage = match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::Closed => match self.start()? {
                Started::Empty(session) => self.begin_index(*session, Opened::default()),
                Started::Reads(reader) => Stage::Reading(reader),
            },
            Stage::Reading(mut reader) => {
                if !progress.note(reader.events) {
                    reader.give_up();
                    return Err(cancelled());
                }
                match reader.step() {
                    Ok(true) => Stage::Reading(reader),
                    Ok(false) => {
                        let (session, opened) = reader.finish()?;
                        self.begin_index(session, opened)
                    }
                    Err(error) => {
                        reader.give_up();
                        return Err(error.into());
                    }
                }
            }
            Stage::Indexing(mut indexing) => {
                let (session, _, steps) = &mut *indexing;
                let is_cancelled = !progress.note(session.event_count());
                if !is_cancelled && steps.step(session.scene()) {
                    Stage::Indexing(indexing)
                } else {
                    let (session, opened, steps) = *indexing;
                    if is_cancelled {
                        let closed = session.close();
                        debug_assert!(closed.is_ok(), "nothing was drawn in it");
                        return Err(cancelled());
                    }
                    return Ok(Some(ReadSession { session, opened, indexed: Some(steps.finish()) }));
                }
            }
            Stage::Over => Stage::Over,
        };
        Ok(None)
    }
}

impl Task for ToDraw {
    fn step(&mut self, progress: &Progress) -> Option<Done> {
        let outcome = self.advance(progress).transpose()?;
        Some(self.done(outcome))
    }

    fn run(mut self: Box<Self>, progress: &Progress) -> Done {
        let go_on = |done| progress.note(done);
        let opened = self.start().and_then(|started| started.read_watched(&self.path, &go_on));
        let outcome = opened.map(|(session, opened)| {
            let indexed = Some(self.plan.clone().index(session.scene(), &session.bounds()));
            ReadSession { session, opened, indexed }
        });
        self.done(outcome)
    }
}

pub(crate) struct Whole<F>(Option<F>);

impl<F> Whole<F> {
    pub(crate) fn new(work: F) -> Self {
        Self(Some(work))
    }
}

impl<F: FnOnce(&Progress) -> Done + Send> Task for Whole<F> {
    fn step(&mut self, progress: &Progress) -> Option<Done> {
        self.0.take().map(|work| work(progress))
    }
}

/// The progress of background work, and whether it was cancelled.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    pub(super) done: AtomicU64,
    pub(super) is_cancelled: AtomicBool,
}

impl Progress {
    /// Stores the progress. Returns `false` if the work was cancelled.
    pub(crate) fn note(&self, done: u64) -> bool {
        self.done.store(done, Relaxed);
        !self.is_cancelled.load(Relaxed)
    }
}
