//! `osp import`: a session of any format, written as a recording.

use std::{
    io::IsTerminal,
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{anyhow, ensure};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{
    Outcome,
    new_recording::{NewRecording, check_output},
    output::{complain, say},
    reading::ReadArgs,
    session::OpenSession,
};
use crate::{
    recording::{Event, RecordingError},
    report::thousands,
};

/// Events between two steps of the progress display.
const EVENTS_PER_STEP: u64 = 4096;

/// Convert a session to the project's own format: text, one event a line, or the same compressed.
///
/// Lengths become metres and axes right-handed with y up; the order of the events stays that of the file. The output
/// appears only once it is whole.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp import sketch.tilt sketch.ron.zst
  osp import painting.apa painting.ron
  osp import sketch_history/chair.json chair.ron   (and raw_data/chair.json, if it is there)
  osp import cut-off.tilt rescued.ron --lenient")]
pub(super) struct ImportArgs {
    /// The session: .tilt (file or folder), .apa, CASSIE .json, .poses, .obj, .obj.gz, .ron or .ron.zst.
    input: PathBuf,
    /// The recording to write: .ron, or .ron.zst to compress it.
    output: PathBuf,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: ReadArgs,
}

/// What was written.
#[derive(Default)]
struct Counts {
    events: u64,
    strokes: u64,
    points: u64,
    polygons: u64,
    heads: u64,
    edits: u64,
}

impl Counts {
    fn add(&mut self, event: &Event) {
        self.events += 1;
        match event {
            Event::Begin { .. } => self.strokes += 1,
            Event::Point { .. } => self.points += 1,
            Event::Polygon { .. } => self.polygons += 1,
            Event::Head { .. } => self.heads += 1,
            Event::End { .. } => {}
            Event::Erase { .. }
            | Event::Undo { .. }
            | Event::Redo { .. }
            | Event::Move { .. }
            | Event::Group { .. }
            | Event::Place { .. } => self.edits += 1,
        }
    }

    /// What there is, by kind; strokes and points always.
    fn text(&self) -> String {
        let rest = [(self.polygons, "faces"), (self.heads, "head poses"), (self.edits, "edits")];
        [(self.strokes, "strokes"), (self.points, "points")]
            .into_iter()
            .chain(rest.into_iter().filter(|&(count, _)| count > 0))
            .map(|(count, of)| format!("{} {of}", thousands(count)))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

pub(super) fn run(args: &ImportArgs) -> anyhow::Result<Outcome> {
    check_output(&args.output, args.force)?;
    ensure!(!is_same(&args.input, &args.output), "{}: is the input, too", args.output.display());

    let mut session = OpenSession::open(&args.input, &args.reading)?;
    let (counts, bytes) = convert(&mut session, &args.output, args.reading.lenient)?;

    let notes = session.notes();
    for warning in &notes.warnings {
        complain(&format!("warning: {warning}"));
    }
    if notes.skipped > 0 {
        complain(&format!("{} damaged pieces were skipped", thousands(notes.skipped)));
    }
    say(&format!(
        "{} ({}) -> {}: {}; {} bytes",
        args.input.display(),
        session.format,
        args.output.display(),
        counts.text(),
        thousands(bytes),
    ))?;
    Ok(Outcome::Done)
}

/// Writes the whole session; what it holds and how many bytes it takes.
fn convert(session: &mut OpenSession, output: &Path, lenient: bool) -> anyhow::Result<(Counts, u64)> {
    let mut recording = NewRecording::create(output, &session.header)?;
    let progress = progress();
    let mut counts = Counts::default();
    for event in session.by_ref() {
        let event = event.map_err(|error| explain(&error, lenient))?;
        recording.write(&event)?;
        counts.add(&event);
        if counts.events.is_multiple_of(EVENTS_PER_STEP) {
            progress.set_position(counts.events);
        }
    }
    progress.finish_and_clear();
    Ok((counts, recording.finish()?))
}

/// A count of events, where somebody can see it. No source knows beforehand how many events it has.
fn progress() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {human_pos} events, {per_sec}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

fn explain(error: &RecordingError, lenient: bool) -> anyhow::Error {
    let hint = if lenient { "" } else { " (--lenient keeps what can be read)" };
    anyhow!("{error}; nothing was written{hint}")
}

/// Whether both names are of one file or folder.
fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
