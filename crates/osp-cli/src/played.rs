//! A session that is played up to a frame, for commands that examine only that frame.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::{Context, bail};
use clap::Args;

use super::{
    parsers::index_parser,
    progress,
    read_session::{Keep, ReadSession},
    reading::ReadArgs,
    session::OpenSession,
};
use osp::frame::Pipeline;
use osp_rivals::{IndexKind, IndexSettings};
use osp_session::{
    recording::{Event, Header, Pace},
    replay::{Moment, SessionState, Summary},
    scene::Scene,
};

/// The session and the frame that a command examines.
#[derive(Args, Debug)]
pub(super) struct FrameArgs {
    /// The session, of any format that replay reads.
    pub(super) file: PathBuf,
    /// Number of the frame, from 0, or `last`. The changes of this frame are included.
    #[arg(long, default_value = "last")]
    frame: FrameChoice,
    /// Part of the session that each frame plays. `recorded`: up to the time of the frame, by the recorded time stamps.
    /// `samples:N`: the next N hand samples.
    #[arg(long, default_value = "samples:16")]
    pace: Pace,
    #[command(flatten)]
    reading: ReadArgs,
}

impl FrameArgs {
    /// Returns the arguments for the last frame of a session.
    pub(super) fn end_of(file: PathBuf, reading: ReadArgs) -> Self {
        Self { file, frame: FrameChoice::Last, pace: Pace::Samples(16), reading }
    }
}

/// A frame, and the index for its polygons.
#[derive(Args, Debug)]
pub(super) struct IndexedFrameArgs {
    #[command(flatten)]
    pub(super) session: FrameArgs,
    /// The index (`osp replay --help` describes them).
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    pub(super) index: IndexKind,
}

/// The model after a frame, and its indexes.
pub(super) struct Played {
    pub(super) header: Header,
    pub(super) summary: Summary,
    pub(super) scene: Scene,
    /// The pipelines of the indexes, in the order of the command line.
    pub(super) pipelines: Vec<Pipeline>,
    /// Number of the frame, and the poses of head and hand in it.
    pub(super) moment: Moment,
}

impl Played {
    /// Plays up to the frame. Returns the model, and the pipeline with its index.
    pub(super) fn in_index(args: &IndexedFrameArgs) -> anyhow::Result<(Self, Pipeline)> {
        let mut played = Self::in_indexes(&args.session, &[args.index], &IndexSettings::default())?;
        let pipeline = played.pipelines.pop().context("--index: expected an index")?;
        Ok((played, pipeline))
    }

    /// Reads and plays the session once for all indexes.
    pub(super) fn in_indexes(
        args: &FrameArgs,
        indexes: &[IndexKind],
        settings: &IndexSettings,
    ) -> anyhow::Result<Self> {
        Self::play(args, indexes, settings, |_, _| {})
    }

    /// Plays up to the frame, without an index. `each` gets the events of every frame, and the model after them.
    pub(super) fn model(args: &FrameArgs, each: impl FnMut(&[Event], &Scene)) -> anyhow::Result<Self> {
        Self::play(args, &[], &IndexSettings::default(), each)
    }

    fn play(
        args: &FrameArgs,
        indexes: &[IndexKind],
        settings: &IndexSettings,
        mut each: impl FnMut(&[Event], &Scene),
    ) -> anyhow::Result<Self> {
        let FrameArgs { file, frame, pace, reading } = args;
        let mut session = OpenSession::open(file, reading)?.counted();
        let keep = if indexes.is_empty() { Keep::Frames } else { Keep::Events };
        // Without indexes, the model of an earlier frame is kept as it passes.
        let mut earlier = None;
        let note = |events: &[Event], state: &SessionState| {
            let number = state.moment.frame - 1;
            if indexes.is_empty() && frame.includes(number) {
                each(events, &state.scene);
                earlier = frame.is(number).then(|| state.clone());
            }
        };
        let (read_session, read) = ReadSession::of(session.header.clone(), &mut session, *pace, keep, note);
        session.warn_losses();
        read?;
        let (header, summary) = (read_session.header.clone(), read_session.summary);
        let last = frame.number(file, &summary, *pace)?;
        let config = read_session.index;
        let of = |index: &IndexKind| Pipeline::new(index.create_with(&config, settings), config.capacity);
        let mut pipelines: Vec<Pipeline> = indexes.iter().map(of).collect();
        let state = match (indexes.is_empty(), earlier) {
            (true, Some(earlier)) => earlier,
            (true, None) => read_session.end,
            (false, _) => {
                let mut player = read_session.into_player();
                let progress = progress::bar(last + 1, "frames", &file.to_string_lossy());
                while player.frames() <= last && player.step()? {
                    progress.inc(1);
                    for pipeline in &mut pipelines {
                        pipeline.skip(player.scene(), player.changes());
                    }
                    each(player.events(), player.scene());
                }
                progress.finish_and_clear();
                player.into_state()
            }
        };
        pipelines.iter_mut().for_each(Pipeline::commit);
        let moment = Moment { frame: last, ..state.moment };
        Ok(Self { header, summary, scene: state.scene, pipelines, moment })
    }
}

/// A frame, in the form of the command line.
#[derive(Clone, Copy, Debug)]
pub(super) enum FrameChoice {
    Last,
    Number(u64),
}

impl FromStr for FrameChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "last" => Ok(Self::Last),
            _ => text
                .parse()
                .map(Self::Number)
                .map_err(|_| format!("expected a frame number or `last`; found `{text}`")),
        }
    }
}

impl FrameChoice {
    /// Whether a command that plays up to this frame plays frame `number`.
    pub(super) fn includes(self, number: u64) -> bool {
        match self {
            Self::Last => true,
            Self::Number(last) => number <= last,
        }
    }

    pub(super) fn is(self, number: u64) -> bool {
        matches!(self, Self::Number(frame) if frame == number)
    }

    /// Returns the number of the frame in a session.
    pub(super) fn number(self, file: &Path, summary: &Summary, pace: Pace) -> anyhow::Result<u64> {
        let Some(end) = summary.frames.checked_sub(1) else {
            bail!("{}: nothing was drawn in this session", file.display());
        };
        match self {
            Self::Last => Ok(end),
            Self::Number(n) if n <= end => Ok(n),
            Self::Number(n) => bail!(
                "{}: there is no frame {n}; the session has {} frames at the pace {pace}",
                file.display(),
                summary.frames
            ),
        }
    }
}
