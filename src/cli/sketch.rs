//! `osp sketch`: the window to draw in.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::Args;

#[cfg(feature = "live")]
use super::shared_args::{self, ServerArgs};
use super::{
    Outcome, numbers,
    occlusion_tests::TestArgs,
    output::complain,
    outputs::Outputs,
    parsers::{index_parser, occlusion_parser},
    reading::LimitArgs,
    rig_args::RigArgs,
    tracker_args::TrackerArgs,
};
#[cfg(feature = "live")]
use crate::app::{Shared, Unjoined};
use crate::{
    app::{
        Access, Autosaves, Command, CullingPlan, Document, OpenElsewhere, OpenError, Opened, Opening,
        Question, Reading, Room, Settings, Studio, Subject, Waited, WindowOptions, run as run_window,
        tracker::{Listening, TrackerAddress, TrackerOptions},
    },
    occlusion::Occlusion,
    output_file::OutputKind,
    rivals::IndexKind,
};

/// If reading a session takes longer than this, the window opens meanwhile, and says itself what is wrong with the session.
pub(super) const BEFORE_THE_WINDOW: Duration = Duration::from_millis(500);

/// Draw in a window: with a mouse or a pen, or with a tracker.
///
/// The window writes every sample to the session's file before it takes the next one, and flushes the file to the disk at
/// the next pause. If you name no file, the session is written to an autosave file; after a crash the next `osp sketch`
/// restores it. Nothing is written before something is drawn, and no file is replaced unless you say so.
///
/// The menus and F1 list all keys. The window remembers recent sessions, its colours and the size of its letters in
/// osp/window.settings in the folder XDG_CONFIG_HOME (else ~/.config); you may delete that file.
///
/// Only one window at a time draws on a session. A second window says who has the session open, and asks whether you want
/// to look at it or to draw on a copy (--read-only and --copy answer beforehand). If somebody removes or replaces the file,
/// another program changes it, or the disk is full, the window leaves the file alone, says so, and goes on in an autosave
/// file.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp sketch
  osp sketch house.ron
  osp sketch painting.tilt --index bvh-sah
  osp sketch house.ron --read-only
  osp sketch damaged.ron --lenient
  osp sketch --tracker udp://127.0.0.1:9327
  osp sketch --rig dual-wall --tracker poses.txt
  osp sketch class.ron --tracker udp:// --tracker-authors

A tracker sends lines of text (or the same as OSC), metres and unit quaternions, +y up:
  head  X Y Z  QX QY QZ QW
  hand  X Y Z  QX QY QZ QW  PRESSURE  [HAND]     draws while the pressure is above 0
  brush TOOL WIDTH  R G B A  [HAND] [NORMAL]     ribbon, wall, tube or a brush, as Light
  erase X Y Z | undo | redo
  key WORD                                       first in each packet, if --tracker-key is given
The window listens to the first sender until it has been silent for 5 s; it counts the packets of
others and does not read them.
Packets of ART's DTrack (ASCII) are understood, too: body 0 is the head, Flysticks are the hands, and a
hand draws while the first button is pressed (--tracker udp://0.0.0.0:5000).
As OSC: /osp/head, /osp/hand and so on; the key as /osp/key, the first message of a bundle.
`osp send SESSION --to 127.0.0.1:9327` plays a session as such a tracker.")]
pub(super) struct SketchArgs {
    /// The session to continue, or a new one (.ron). A session that `osp sketch` did not draw (imported, shipped, of
    /// another format, write-protected) is opened as a copy.
    file: Option<PathBuf>,
    #[command(flatten)]
    window: WindowArgs,
    #[command(flatten)]
    tracker: TrackerArgs,
    /// Each sender of the tracker's messages is an author of its own, 16 at a time: with strokes, undo and a colour of its own, in
    /// a session that is new or of several authors. It joins with its first message and leaves after five seconds without one.
    #[arg(long, requires = "tracker", conflicts_with = "tracker_any")]
    tracker_authors: bool,
    /// Only look at the session.
    #[arg(long, requires = "file", conflicts_with = "copy")]
    read_only: bool,
    /// Draw on a copy of the session, in an autosave file.
    #[arg(long, requires = "file")]
    copy: bool,
    /// Skip damaged pieces and count them, instead of refusing the session, and draw on a copy.
    #[arg(long, requires = "file")]
    lenient: bool,
    /// Draw together with others, in a session on a server of NATS: nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME
    /// (`osp join --help` says how to start one). The recording of the whole session is saved as you draw, in FILE if it is
    /// given: a new file, or one that is the beginning of this session, as it was left; what was drawn since is appended.
    // Parsed later: what is wrong with it is said without the password in it.
    #[cfg(feature = "live")]
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["read_only", "copy", "lenient"])]
    join: Option<String>,
    /// Only watch the others.
    #[cfg(feature = "live")]
    #[arg(long, requires = "join")]
    watch: bool,
    /// The name by which the others know you.
    #[cfg(feature = "live")]
    #[arg(long, default_value = "", hide_default_value = true, requires = "join", conflicts_with = "watch")]
    #[arg(value_parser = shared_args::name)]
    name: String,
    #[cfg(feature = "live")]
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// The folder for autosave files [default: the user's own data folder].
    #[arg(long, value_name = "DIR")]
    autosave: Option<PathBuf>,
}

/// The options of every window.
#[derive(Args, Debug)]
pub(super) struct WindowArgs {
    /// The index that culls by the frustum (`osp replay --help` describes them); the window can change it.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    pub(super) index: IndexKind,
    /// The method of occlusion culling (`osp replay --help` describes them); the window can change it.
    #[arg(long, default_value = "auto", value_parser = occlusion_parser())]
    pub(super) occlusion: Occlusion,
    #[command(flatten)]
    pub(super) tests: TestArgs,
    #[command(flatten)]
    rig: RigArgs,
    /// Show a test pattern on the rig's screens: border, grid in metres, number of the screen, letter of the eye.
    #[arg(long, requires = "rig")]
    test_pattern: bool,
    /// Width and height of the window, in points.
    #[arg(long, value_name = "WxH", value_parser = size)]
    window: Option<(u32, u32)>,
    /// Write one line of JSON for each frame to this file.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Let --trace replace a file of another kind, but never the session.
    #[arg(long)]
    force: bool,
}

impl SketchArgs {
    /// Opens the session to draw on it; if another window has it, for reading only, and says who has it. A long session is
    /// read beside the window.
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
        };
        let reading =
            Reading::to_draw(path, autosaves, how, self.window.culling()).map_err(anyhow::Error::msg)?;
        match reading.wait(Some(BEFORE_THE_WINDOW)) {
            Waited::Read(Ok((subject, opened))) => Ok(Start { subject, opened, held: None, reading: None }),
            Waited::Read(Err(OpenError::Held(held))) => {
                let (document, opened) = Document::look_at(path, autosaves, how)?;
                Ok(Start { held: Some(held), ..Start::with(document, opened) })
            }
            Waited::Read(Err(OpenError::Recording(error))) => Err(error.into()),
            Waited::Read(Err(error @ OpenError::Cancelled(_))) => Err(error.into()),
            Waited::GoesOn(reading) => {
                let empty = Start::with(Document::new(autosaves), Opened::default());
                Ok(Start { reading: Some(reading), ..empty })
            }
        }
    }
}

#[cfg(feature = "live")]
impl SketchArgs {
    /// Begins to take part in a shared session.
    fn join(&self, address: &str, autosaves: &Autosaves) -> anyhow::Result<Start> {
        let options = self.server.options(self.watch, &self.name);
        let address = self.server.address(address)?;
        let join = || Shared::join(&address, &options, autosaves);
        let Some(path) = &self.file else {
            return Ok(Start::with(Document::joining(join()?, autosaves)?, Opened::default()));
        };
        let (unjoined, opened) = Unjoined::open(path, address.session(), autosaves, self.limits.limits())?;
        Ok(Start::with(unjoined.join(join()?), opened))
    }
}

/// What a window begins with.
struct Start {
    subject: Subject,
    opened: Opened,
    held: Option<OpenElsewhere>,
    /// The session that is to be shown instead, once it has been read.
    reading: Option<Reading>,
}

impl Start {
    fn with(document: Document, opened: Opened) -> Self {
        Self { subject: Subject::Sketch(Box::new(document)), opened, held: None, reading: None }
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    numbers::sides(text, &(1..=16_384))
}

impl WindowArgs {
    /// How the window culls until somebody changes it.
    fn culling(&self) -> CullingPlan {
        let plan = CullingPlan::new(self.index, self.occlusion);
        plan.with_tests(self.tests.node_test(), self.tests.score())
    }

    /// Refuses a trace that would replace a file of another kind.
    fn check_trace(&self, session: Option<&PathBuf>, tracker: Option<&TrackerAddress>) -> anyhow::Result<()> {
        let rig = self.rig.file();
        let tracker = tracker.and_then(|tracker| match tracker {
            TrackerAddress::File(path) => Some(path),
            _ => None,
        });
        let mut outputs = Outputs::new(self.force).reads(session).reads(&rig).reads(tracker);
        outputs.add_any("--trace", self.trace.as_ref(), OutputKind::Trace)?;
        Ok(())
    }

    /// The screens.
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
    let Start { subject, opened, held, reading } = match (joined, &args.file) {
        (Some(start), _) => start,
        (None, Some(path)) => args.open(path, &autosaves)?,
        (None, None) => {
            let (mut document, opened) = Document::recover_or_new_within(&autosaves, args.limits.limits());
            if args.tracker_authors && !opened.is_recovered {
                document = Document::of_several(&autosaves);
            }
            Start::with(document, opened)
        }
    };
    let mut studio = Studio::new(subject, autosaves, args.window.index);
    studio.set_room(room);
    studio.set_limits(args.limits.limits());
    studio.set_tests(args.window.tests.node_test(), args.window.tests.score());
    studio.command(Command::Occlusion(args.window.occlusion));
    for remark in opened.remarks {
        complain(&remark);
        studio.say(remark);
    }
    if let Some(held) = held {
        complain(&held.to_string());
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
