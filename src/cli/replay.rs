//! `osp replay`: a session through several indexes, from the file to the table.

use std::{
    fs::File,
    io::{BufWriter, IsTerminal},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::{Args, builder::PossibleValuesParser, builder::TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};

use super::{
    Outcome, allocations,
    output::{complain, say},
    session::OpenSession,
};
use crate::{
    index::{IndexConfig, IndexKind},
    math::Aabb,
    metrics::{StageClock, Summary, summarize},
    recording::{Header, Pace, Pacer},
    report::{
        ChartError, ChartFormat, CsvWriter, Pin, Pins, ReplayReport, RunReport, draw_frame_times,
        pinned_name, replay_table, thousands,
    },
    visibility::{Budget, CameraChoice, CameraPath, Lane, Pipeline, Replay},
};

/// Play sessions through several indexes, frame by frame, and say what every frame cost.
///
/// Each frame takes the next samples of the session, turns them into polygons, files these into each index, and asks
/// it what the camera may see. The indexes run one after the other within each frame, on the same polygons and view.
/// All must see the same set in every frame; if they do not, the exit code is 1.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp replay recordings/portrait.ron
  osp replay sketch.tilt --index osp,octree-rebuild --chart frames.png
  osp replay painting.apa --pace samples:1 --camera inside --csv frames.csv
  osp replay recordings/*.ron --check recordings/fingerprints.pins

The table, a line for each index (times of this machine, one thread):
  insert   filing the frame's polygons, a rebuild included, nanoseconds a polygon, median
  cull     one frustum query, median
  frame    both together: median, 95 and 99 per cent, slowest
  visible  polygons the view may see, mean of the frames; culled: the others
A slow index is measured on evenly spaced stretches of a long session (--budget); `frames measured` says how many.")]
pub(super) struct ReplayArgs {
    /// The sessions: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj or .obj.gz.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The indexes to run, separated by commas [default: brute-force,osp-paper,osp,octree-rebuild].
    #[arg(long, value_delimiter = ',', value_parser = index_parser())]
    index: Vec<IndexKind>,
    /// How much of the session a frame takes: `recorded` (by time stamps) or `samples:N`.
    #[arg(long, default_value = "samples:16")]
    pace: Pace,
    /// Where the eye is: `auto` is the recorded head path, else the session's own camera, else `orbit`.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    camera: CameraChoice,
    /// Seconds to spend on each index.
    #[arg(long, default_value_t = 20.0, value_name = "SECS", value_parser = seconds)]
    budget: f64,
    /// Write one line for each index and frame.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Draw the frame times over the session, as .png or .svg (several sessions: the name gets a number).
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Print one JSON object for each session instead of a table.
    #[arg(long)]
    json: bool,
    /// Compare the fingerprints with those pinned in this file; a difference gives exit code 1.
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
    /// Pin the fingerprints of this run in a file for --check.
    #[arg(long, value_name = "FILE")]
    pin: Option<PathBuf>,
    /// Skip damaged pieces and count them, instead of stopping at the first.
    #[arg(long)]
    lenient: bool,
    /// Play the session in a window, with its times and counts.
    #[cfg(feature = "window")]
    #[arg(long)]
    window: bool,
    /// With --window: write one line of JSON for each frame shown.
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FILE", requires = "window")]
    trace: Option<PathBuf>,
}

pub(super) fn index_parser() -> impl TypedValueParser<Value = IndexKind> {
    let names = IndexKind::ALL.iter().map(|kind| kind.name());
    PossibleValuesParser::new(names)
        .try_map(|name| IndexKind::from_name(&name).ok_or_else(|| format!("no index is called {name}")))
}

pub(super) fn camera_parser() -> impl TypedValueParser<Value = CameraChoice> {
    let names = CameraChoice::ALL.iter().map(|choice| choice.name());
    PossibleValuesParser::new(names).try_map(|name| {
        let found = CameraChoice::ALL.iter().find(|choice| choice.name() == name);
        found.copied().ok_or_else(|| format!("no camera is called {name}"))
    })
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s > 0.0)
        .ok_or_else(|| "expected seconds above 0".to_owned())
}

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<Outcome> {
    #[cfg(feature = "window")]
    if args.window {
        return in_window(args);
    }
    // Whatever is wrong with the arguments is said before the work, not after it.
    args.chart.as_deref().map(ChartFormat::of).transpose()?;
    for path in args.chart.iter().chain(&args.pin) {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            bail!("{}: there is no such folder", path.display());
        }
    }
    let pins = args.check.as_deref().map(Pins::read).transpose()?;
    let mut new_pins = match &args.pin {
        Some(path) if path.exists() => Pins::read(path)?,
        _ => Pins::default(),
    };
    let mut csv = match &args.csv {
        Some(path) => {
            let file = File::create(path).with_context(|| path.display().to_string())?;
            Some(CsvWriter::new(BufWriter::new(file))?)
        }
        None => None,
    };
    let mut outcome = Outcome::Done;
    for (number, file) in args.files.iter().enumerate() {
        let report = replay_file(args, file, csv.as_mut())?;
        if args.json {
            say(&report.to_json())?;
        } else {
            say(&text(args, &report))?;
        }
        if let Some(path) = &args.chart {
            let path = if args.files.len() == 1 { path.clone() } else { numbered(path, number + 1) };
            match draw_frame_times(&report, &path) {
                Err(nothing @ ChartError::Empty(_)) => complain(&format!("warning: {nothing}")),
                outcome => outcome?,
            }
        }
        if let Some((first, second, frame)) = report.first_disagreement() {
            complain(&format!(
                "{}: {first} and {second} saw different polygons in frame {frame}",
                file.display()
            ));
            outcome = Outcome::CheckFailed;
        }
        let pin_in = |pins: &Path| {
            let name = pinned_name(file, pins);
            report.runs.iter().find_map(|run| Pin::of(&name, &report.pace, &report.camera, run))
        };
        let mut complaint = None;
        if let (Some(pins), Some(path)) = (&pins, &args.check) {
            complaint = compare(pins, pin_in(path).as_ref());
        }
        if let Some(path) = &args.pin {
            match pin_in(path) {
                Some(pin) => new_pins.set(pin),
                None => complaint = Some(INCOMPLETE.to_owned()),
            }
        }
        if let Some(complaint) = complaint {
            complain(&format!("{}: {complaint}", file.display()));
            outcome = Outcome::CheckFailed;
        }
    }
    if let Some(csv) = csv {
        csv.finish()?;
    }
    // Nothing is pinned that has failed a check.
    if let Some(path) = args.pin.as_ref().filter(|_| outcome == Outcome::Done) {
        new_pins.write(path)?;
    }
    Ok(outcome)
}

/// Why a session has no fingerprint to compare or to pin.
const INCOMPLETE: &str = "no index looked at every frame, so the session has no fingerprint: raise --budget";

/// Plays the first session in a window with the first index.
#[cfg(feature = "window")]
fn in_window(args: &ReplayArgs) -> anyhow::Result<Outcome> {
    use crate::app::{Autosaves, Player, Studio, Subject, WindowOptions, run};
    let [file] = &args.files[..] else { anyhow::bail!("a window plays one session") };
    let player = Player::open(file, args.pace, args.camera)?;
    for remark in player.remarks() {
        complain(&format!("warning: {remark}"));
    }
    let index = args.index.first().copied().unwrap_or(IndexKind::Osp);
    let studio = Studio::new(Subject::Replay(Box::new(player)), Autosaves::new(None), index);
    run(studio, WindowOptions { trace: args.trace.clone(), ..WindowOptions::default() })?;
    Ok(Outcome::Done)
}

fn compare(pins: &Pins, found: Option<&Pin>) -> Option<String> {
    let Some(found) = found else {
        return Some(INCOMPLETE.to_owned());
    };
    match pins.find(found) {
        Some(pin) => pin.difference(found),
        None => Some(format!("no fingerprint is pinned for pace {} and camera {}", found.pace, found.camera)),
    }
}

/// `frames.png` as `frames-2.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(ending) => format!("{stem}-{number}.{}", ending.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}

fn replay_file(
    args: &ReplayArgs,
    file: &Path,
    mut csv: Option<&mut CsvWriter<BufWriter<File>>>,
) -> anyhow::Result<ReplayReport> {
    let mut session = OpenSession::open(file, args.lenient)?;
    // Read once to know how long and how large it is, once to play it.
    let (summary, _, read) = summarize(&mut session, args.pace);
    for warning in &session.notes().warnings {
        complain(&format!("warning: {warning}"));
    }
    if session.notes().skipped > 0 {
        complain(&format!("warning: {}: {} damaged pieces skipped", file.display(), session.notes().skipped));
    }
    read?;
    if summary.frames <= 1 && summary.counts.points > 1 && args.pace == Pace::Recorded {
        complain(&format!(
            "warning: {}: its time stamps do not pace it, all is in one frame; try --pace samples:16",
            file.display()
        ));
    }

    let kinds = if args.index.is_empty() { IndexKind::DEFAULT } else { &args.index };
    let session = OpenSession::open(file, args.lenient)?;
    let camera = CameraPath::new(args.camera, session.header.camera, &summary.bounds);
    let lanes = lanes(args, kinds, &session.header, &summary);
    let mut runs: Vec<RunReport> =
        kinds.iter().map(|kind| RunReport::new(kind.name(), summary.frames)).collect();
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();

    let progress = progress_bar(summary.frames, &name);
    let mut replay = Replay::new(Pacer::new(session, args.pace), camera, lanes);
    while let Some(outcomes) = replay.step()? {
        for (run, frame) in runs.iter_mut().zip(outcomes) {
            let Some(frame) = frame else { continue };
            run.add(frame);
            if let Some(csv) = &mut csv {
                csv.write(&name, &run.index, frame).context("the CSV file")?;
            }
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    for (run, lane) in runs.iter_mut().zip(replay.lanes()) {
        run.bytes = lane.pipeline().index().bytes();
        run.refused = lane.pipeline().refused();
    }
    let counts = summary.counts;
    Ok(ReplayReport {
        recording: name,
        strokes: counts.strokes,
        points: counts.points,
        polygons: counts.polygons,
        frames: summary.frames,
        pace: args.pace.to_string(),
        camera: args.camera.name().to_owned(),
        runs,
    })
}

fn lanes(args: &ReplayArgs, kinds: &[IndexKind], header: &Header, summary: &Summary) -> Vec<Lane> {
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: root_cube(header, &summary.bounds), capacity };
    let budget = Budget { ns: (args.budget * 1.0e9) as u64, frames: summary.frames };
    let clock = StageClock::counting(allocations::count);
    kinds.iter().map(|kind| Lane::new(Pipeline::new(kind.create(&config), capacity, clock), budget)).collect()
}

/// The recording's own modelling volume, else a cube around everything that it draws.
pub(super) fn root_cube(header: &Header, bounds: &Aabb) -> Aabb {
    match header.root {
        Some(root) if root.size > 0.0 && root.size.is_finite() && root.center.is_finite() => {
            Aabb::cube(root.center, root.size)
        }
        _ if bounds.is_empty() => IndexConfig::default().root,
        _ => Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.01),
    }
}

fn progress_bar(frames: u64, name: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} frames, {eta} left");
    ProgressBar::new(frames)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(name.to_owned())
}

fn text(args: &ReplayArgs, report: &ReplayReport) -> String {
    let mut lines = vec![format!(
        "{}: {} strokes, {} points, {} polygons; {} frames ({}, camera {})",
        report.recording,
        thousands(report.strokes),
        thousands(report.points),
        thousands(report.polygons),
        thousands(report.frames),
        args.pace,
        args.camera.name(),
    )];
    if report.frames == 0 {
        lines.push("Nothing was drawn in this session: there is nothing to measure.".to_owned());
        return lines.join("\n");
    }
    lines.push(replay_table(report));
    for run in report.runs.iter().filter(|run| !run.is_complete()) {
        lines.push(format!(
            "{} was slow: measured on {} of {} frames, in evenly spaced stretches (--budget {}).",
            run.index,
            thousands(run.measured_frames()),
            thousands(report.frames),
            args.budget
        ));
    }
    for run in report.runs.iter().filter(|run| run.refused > 0) {
        lines.push(format!(
            "{} refused {} changes: polygons moved beyond all range, which cannot be drawn.",
            run.index, run.refused
        ));
    }
    if report.first_disagreement().is_none() {
        lines.push("All indexes saw the same polygons in every frame that they were measured on.".to_owned());
    }
    lines.join("\n")
}
