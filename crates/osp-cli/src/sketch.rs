//! `osp sketch`: opens the window to draw in.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use super::{
    film,
    output::{Outcome, warn},
    sketch_args::{SketchArgs, WindowArgs},
};
use osp_app::{
    Access, Autosaves, Command, CullingPlan, OpenElsewhere, OpenError, Opened, Opening, Question, Reading,
    Room, Session, Settings, Studio, Waited, WindowOptions, run as run_window,
    tracker::{Listening, TrackerAddress, TrackerOptions},
};
#[cfg(feature = "live")]
use osp_app::{Live, Unjoined};

/// If reading a session takes longer than this, the window opens while the reading continues, and shows errors itself.
pub(super) const BEFORE_THE_WINDOW: Duration = Duration::from_millis(500);

impl SketchArgs {
    /// Opens the session to draw on it. If another window draws on the session, opens it only for viewing, and reports
    /// the owner. A long session is still being read when the window opens.
    fn open(&self, path: &Path, autosaves: &Autosaves) -> anyhow::Result<Start> {
        let access = match (self.read_only, self.copy) {
            (true, _) => Access::ReadOnly,
            (false, true) => Access::Copy,
            (false, false) => Access::Write,
        };
        let how = Opening {
            access,
            lenient: self.lenient,
            limits: self.limits.limits(),
            of_several: self.tracker_authors,
            draws: false,
        };
        let plan = CullingPlan::new(self.window.index, self.window.occlusion);
        let reading = Reading::to_draw(path, autosaves, how, plan).map_err(anyhow::Error::msg)?;
        match reading.wait(Some(BEFORE_THE_WINDOW)) {
            Waited::Read(Ok((session, opened))) => Ok(Start::with(*session, opened)),
            Waited::Read(Err(OpenError::Held(held))) => {
                let (session, opened) = Session::look_at(path, autosaves, how)?;
                Ok(Start { held: Some(held), ..Start::with(session, opened) })
            }
            Waited::Read(Err(OpenError::Recording(error))) => Err(error.into()),
            Waited::Read(Err(error @ OpenError::Cancelled(_))) => Err(error.into()),
            Waited::GoesOn(reading) => {
                let empty = Start::with(Session::new(autosaves), Opened::default());
                Ok(Start { reading: Some(reading), ..empty })
            }
        }
    }
}

#[cfg(feature = "live")]
impl SketchArgs {
    /// Starts to take part in a shared session.
    fn join(&self, address: &str, autosaves: &Autosaves) -> anyhow::Result<Start> {
        let options = self.server.options(self.watch, &self.name);
        let address = self.server.address(address)?;
        let join = || Live::join(&address, &options, autosaves);
        let Some(path) = &self.file else {
            return Ok(Start::with(Session::joining(join()?, autosaves)?, Opened::default()));
        };
        let (unjoined, opened) = Unjoined::open(path, &address.session, autosaves, self.limits.limits())?;
        Ok(Start::with(unjoined.join(join()?), opened))
    }
}

struct Start {
    session: Session,
    opened: Opened,
    held: Option<OpenElsewhere>,
    /// A session that is still being read. It replaces `session` later.
    reading: Option<Reading>,
}

impl Start {
    fn with(session: Session, opened: Opened) -> Self {
        Self { session, opened, held: None, reading: None }
    }
}

impl WindowArgs {
    /// Returns an error if the trace would replace an input or a file of another kind.
    fn check_trace(&self, session: Option<&PathBuf>, tracker: Option<&TrackerAddress>) -> anyhow::Result<()> {
        let rig = self.rig.file();
        let tracker = tracker.and_then(|tracker| match tracker {
            TrackerAddress::File(path) => Some(path),
            _ => None,
        });
        let mut outputs = self.force.outputs().reads(session).reads(&rig).reads(tracker);
        outputs.add_any(self.trace.as_ref(), &[])?;
        Ok(())
    }

    fn room(&self) -> anyhow::Result<Room> {
        let mut room = self.rig.room()?;
        room.show_pattern(self.test_pattern);
        Ok(room)
    }

    pub(super) fn options(&self, tracker: Option<TrackerAddress>) -> WindowOptions {
        let tracker_options = TrackerOptions::default();
        WindowOptions {
            size: self.window,
            tracker,
            tracker_options,
            merges: self.detail == "auto",
            trace: self.trace.clone(),
            settings: Some(Settings::default_path()),
        }
    }
}

pub(super) fn run(args: &SketchArgs) -> anyhow::Result<Outcome> {
    let tracker = &args.tracker.tracker;
    args.window.check_trace(args.file.as_ref(), tracker.as_ref())?;
    args.tracker.check()?;
    let mut tracker_options = args.tracker.options()?;
    #[cfg(feature = "live")]
    anyhow::ensure!(
        args.join.is_some() || !args.server.is_given(),
        "--credentials, --tls-ca, --unencrypted: expected --join ADDRESS"
    );
    #[cfg(feature = "live")]
    anyhow::ensure!(
        args.join.is_none() || !args.tracker_authors,
        "--tracker-authors: expected no --join: in a shared session a window is one author"
    );
    let room = args.window.room()?;
    let autosaves = Autosaves::new(args.autosave.clone());
    #[cfg(feature = "live")]
    let joined = match &args.join {
        Some(address) => Some(args.join(address, &autosaves)?),
        None => None,
    };
    #[cfg(not(feature = "live"))]
    let joined: Option<Start> = None;
    let Start { session, opened, held, reading } = match (joined, &args.file) {
        (Some(start), _) => start,
        (None, Some(path)) => args.open(path, &autosaves)?,
        (None, None) => {
            let (mut session, opened) = Session::recover_or_new_within(&autosaves, args.limits.limits());
            if args.tracker_authors && !opened.is_recovered {
                session = Session::of_several(&autosaves);
            }
            Start::with(session, opened)
        }
    };
    let mut studio = Studio::new(session, autosaves, args.window.index);
    studio.set_room(room);
    studio.set_film_maker(film::maker());
    studio.set_limits(args.limits.limits());
    studio.command(Command::Occlusion(args.window.occlusion));
    for remark in opened.remarks {
        warn(&remark);
        studio.show_message(remark);
    }
    if let Some(held) = held {
        warn(&held.to_string());
        studio.ask(Question::Held { held, is_shown: true });
    }
    if let Some(reading) = reading {
        studio.take_over(reading);
    }
    let mut options = args.window.options(tracker.clone());
    if args.tracker_authors {
        tracker_options.listening = Listening::Authors;
    }
    options.tracker_options = tracker_options;
    run_window(studio, options)?;
    Ok(Outcome::Done)
}
