//! `osp replay`: a session through several indexes, from the file to the table.

use std::{
    io::IsTerminal,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{
    Outcome, allocations, numbers,
    occlusion_tests::TestArgs,
    output::{complain, one_line, say},
    outputs::{Output, Outputs},
    parsers::{camera_parser, index_parser, occlusion_parser},
    reading::ReadArgs,
    session::{OpenSession, root_cube},
};
use crate::{
    atomic_file::{AtomicFile, Destination},
    frame::{AutoBasis, PassConfig, Pipeline, StageClock},
    index::IndexConfig,
    lab::{
        lost_polygons,
        oracle::OracleConfig,
        pvs::{Pvs, PvsPass},
        report::{
            ChartError, ChartFormat, CsvWriter, OcclusionColumns, OcclusionReport, Pin, Pins, ReplayReport,
            RunReport, draw_frame_times, pinned_name, replay_table, thousands,
        },
        verify,
    },
    occlusion::{Occlusion, Soundness},
    output_file::OutputKind,
    recording::{Event, Header, Pace, RecordingError},
    replay::{Budget, CameraChoice, CameraPath, Lane, Player, Replay, Summary, summarize},
    rivals::IndexKind,
    scene::Scene,
};

/// Play sessions through several indexes, frame by frame, and say what every frame cost.
///
/// Each frame takes the next samples of the session and turns them into polygons. Each index then inserts these polygons
/// and culls against the camera's frustum. Within a frame the indexes run one after the other, on the same polygons and
/// view. If two indexes find different polygons in a frame, the exit code is 1.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp replay recordings/portrait.ron
  osp replay sketch.tilt --index osp,octree-rebuild --chart frames.png
  osp replay painting.apa --pace samples:1 --camera inside --csv frames.csv
  osp replay recordings/*.ron --check recordings/fingerprints.pins
  osp replay recordings/room.ron --occlusion none,msvbsp,auto --verify-frames 8
  osp replay recordings/room.ron --occlusion msvbsp --node-test sphere --score paper

The table has a line for each index (times of this machine, one thread):
  insert   time to insert the frame's polygons, including a rebuild: nanoseconds per polygon, median
  cull     time of one frustum query, median
  frame    insert and cull together: median, 95th and 99th percentile, slowest frame
  visible  polygons in the frustum, mean over the frames
  culled   the other polygons, mean over the frames
  frames measured   a slow index is measured on evenly spaced stretches of the session (--budget)
With --occlusion it has a line for each index and method, and more columns:
  occluded   polygons in the frustum that the method culled because others hide them, mean
  occlusion  time to choose occluders, build the culler and test: median of the frames that used it
  used       share of the frames that used the method
  with drawing   time of the frame plus --polygon-ns for each polygon that is drawn, median
With --draw:
  draw     time from submission to completion on the graphics adapter: median and 99th percentile
With --draw and --occlusion hzb: the groups of polygons tested, the polygons drawn in the depth pass
and in the colour pass (means), and the times of the depth pass, the test and the colour pass as the
adapter reports them (medians).

Indexes:
  brute-force      tests every polygon: the reference
  brute-simd       one pass over all boxes with SIMD
  time-order       a hierarchy of boxes over the order of arrival
  osp-paper        the preallocated octree of the paper, figure by figure
  osp              our own form of it
  octree-rebuild   an adaptive octree, rebuilt in every frame that brings a polygon
  octree-paper     the paper's octree: the same, filed by asking each of eight children
  bvh-midpoint, bvh-median, bvh-sah, bvh-sah-sweep, lbvh, hlbvh
                   bounding volume hierarchies, rebuilt in every frame that brings a polygon
  bvh-two-level, dynamic-bvh
                   bounding volume hierarchies that polygons are inserted into
  loose-octree, kd-tree, quadtree
                   trees that polygons are inserted into
  bsp              a binary space partition along the polygons' planes, rebuilt like the hierarchies

Methods of --occlusion:
  none             frustum culling alone
  frusta           one shadow volume for each occluder
  svbsp            the shadow-volume BSP tree of Chin and Feiner
  msvbsp           the paper's modified tree, made conservative
  depth            a masked depth buffer in software, of pixels that are covered wholly
  depth-last       the same buffer, filled with the polygons that were visible in the last frame
  auto             in each frame the cheapest of none, msvbsp, depth-last, and hzb with --draw
  hzb, queries     on the graphics adapter, while drawing: a hierarchical depth buffer, or hardware
                   occlusion queries
  msvbsp-paper, depth-centers
                   not conservative: they can cull visible polygons")]
pub(super) struct ReplayArgs {
    /// The sessions: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The indexes to run, separated by commas [default: brute-force,osp-paper,osp,octree-rebuild].
    #[arg(long, value_delimiter = ',', value_parser = index_parser())]
    index: Vec<IndexKind>,
    /// How much of the session a frame takes: `recorded` (by its time stamps) or `samples:N` (N samples of
    /// the hand).
    #[arg(long, default_value = "samples:16")]
    pace: Pace,
    /// Where the eye is: `auto` is the recorded head path, else the session's own camera, else `orbit`; `orbit` circles
    /// around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    camera: CameraChoice,
    /// Most seconds to spend on each index.
    #[arg(long, default_value_t = 20.0, value_name = "SECS", value_parser = numbers::seconds)]
    budget: f64,
    /// Write a CSV file with one line for each index and frame.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Draw a chart of the frame times over the session, .png or .svg (with several sessions each name gets a number).
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Print one JSON object for each session instead of a table.
    #[arg(long)]
    json: bool,
    /// Compare the fingerprints of the visible polygons with those in this file; a difference gives exit code 1.
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
    /// Write the fingerprints of this run to a file for --check.
    #[arg(long, value_name = "FILE")]
    pin: Option<PathBuf>,
    /// Methods of occlusion culling, separated by commas; each runs after frustum culling. Without --index the only index
    /// is then `osp`. `auto` chooses by measured times; with --check or --pin it chooses by counts of work, which are the
    /// same on every machine. `hzb` and `queries` need --draw.
    #[arg(long, value_delimiter = ',', value_parser = occlusion_parser())]
    occlusion: Vec<Occlusion>,
    /// Walk through the finished model and add a run, `pvs`, that culls by the sets that `osp bake` has written for it. The
    /// sets are sampled, not exact. A window uses them from the end of the replay on.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["check", "pin"])]
    pvs: Option<PathBuf>,
    /// Largest number of occluders in a frame [default: 64; 16 for `auto`].
    #[arg(long, value_name = "N", value_parser = numbers::occluders)]
    occluders: Option<usize>,
    #[command(flatten)]
    tests: TestArgs,
    /// Assumed time to draw one polygon, nanoseconds: occlusion culling tests only what costs more to draw than to test,
    /// and `auto` decides by it.
    #[arg(long, value_name = "NS", default_value_t = 10.0, value_parser = numbers::nanoseconds)]
    polygon_ns: f64,
    /// Compare in this many frames what occlusion culling leaves out with what really cannot be seen.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "occlusion", value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    verify_frames: u64,
    /// Let an output replace a file of another kind, even a session, but never a file that is read.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: ReadArgs,
    /// Also draw what is left of each frame on the graphics adapter, and measure that time [default size: 1280x720].
    #[cfg(feature = "render")]
    #[arg(long, value_name = "WxH", num_args = 0..=1, default_missing_value = "1280x720", require_equals = true)]
    draw: Option<super::parsers::Size>,
    /// Play the session in a window, with its times and counts.
    #[cfg(feature = "window")]
    #[arg(long, conflicts_with_all = ["csv", "chart", "json", "check", "pin"])]
    window: bool,
    /// With --window: write one line of JSON for each frame shown.
    #[cfg(feature = "window")]
    #[arg(long, value_name = "FILE", requires = "window")]
    trace: Option<PathBuf>,
}

impl ReplayArgs {
    /// The indexes, each with its method of occlusion culling where any is asked for.
    fn runs(&self) -> Vec<(IndexKind, Option<Occlusion>)> {
        let has_methods = !self.occlusion.is_empty() || self.pvs.is_some();
        let indexes = match (self.index.as_slice(), has_methods) {
            ([], false) => IndexKind::DEFAULT,
            ([], _) => &[IndexKind::Osp],
            (indexes, _) => indexes,
        };
        let mut methods: Vec<_> = match self.occlusion.as_slice() {
            [] => vec![None],
            methods => methods.iter().copied().map(Some).collect(),
        };
        if self.pvs.is_some() {
            methods.push(Some(Occlusion::Pvs));
        }
        indexes.iter().flat_map(|index| methods.iter().map(|method| (*index, *method))).collect()
    }
}

/// The outputs of a replay.
struct ReplayOutputs {
    csv: Option<Output>,
    /// One for each session, or none.
    charts: Vec<Output>,
    pin: Option<Output>,
    #[cfg(feature = "window")]
    trace: Option<Output>,
}

impl ReplayOutputs {
    fn checked(args: &ReplayArgs) -> anyhow::Result<Self> {
        let mut outputs = Outputs::new(args.force).reads(&args.files).reads(&args.check).reads(&args.pvs);
        if let Some(path) = &args.pin
            && matches!(Destination::of(path), Ok(Destination::Special(_)))
        {
            bail!(
                "{}: pins are added to what is there: expected a regular file; found a pipe or a device",
                path.display()
            );
        }
        let mut charts = Vec::new();
        if let Some(path) = &args.chart {
            let kind = match ChartFormat::of(path)? {
                ChartFormat::Png => OutputKind::Png,
                ChartFormat::Svg => OutputKind::Svg,
            };
            for number in 1..=args.files.len() {
                let path = if args.files.len() == 1 { path.clone() } else { numbered(path, number) };
                charts.push(outputs.add("--chart", &path, kind)?);
            }
        }
        Ok(Self {
            csv: outputs.add_any("--csv", args.csv.as_ref(), OutputKind::Csv)?,
            charts,
            pin: outputs.add_any("--pin", args.pin.as_ref(), OutputKind::Pins)?,
            #[cfg(feature = "window")]
            trace: outputs.add_any("--trace", args.trace.as_ref(), OutputKind::Trace)?,
        })
    }
}

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<Outcome> {
    let outputs = ReplayOutputs::checked(args)?;
    #[cfg(feature = "window")]
    if args.window {
        return in_window(args, &outputs);
    }
    // Whatever is wrong with the arguments is said before the work, not after it.
    #[cfg(feature = "render")]
    let draws = args.draw.is_some();
    #[cfg(not(feature = "render"))]
    let draws = false;
    if let Some(choice) = args.occlusion.iter().find(|choice| choice.is_while_drawing() && !draws) {
        bail!(
            "--occlusion {} culls while drawing: it needs {}",
            choice.name(),
            if cfg!(feature = "render") { "--draw" } else { "a build with the feature `render`, and --draw" }
        );
    }
    if let Some(option) = args.tests.given().filter(|_| args.occlusion.is_empty()) {
        bail!("{option} is about occlusion culling: it needs --occlusion");
    }
    let pins = args.check.as_deref().map(Pins::read).transpose()?;
    let mut new_pins = match &outputs.pin {
        Some(output) if output.replaces_its_kind() => Pins::read(output.path())?,
        _ => Pins::default(),
    };
    let mut csv = match &outputs.csv {
        Some(output) => {
            let columns = match args.occlusion.is_empty() {
                true => OcclusionColumns::Without,
                false => OcclusionColumns::With,
            };
            let file = CsvWriter::new(output.create()?, columns);
            Some(file.with_context(|| output.path().display().to_string())?)
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
        if let Some(chart) = outputs.charts.get(number) {
            chart.check()?;
            match draw_frame_times(&report, chart.path()) {
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
        for run in &report.runs {
            let Some(occlusion) = &run.occlusion else { continue };
            let is_sound = Occlusion::from_name(occlusion.method)
                .is_some_and(|choice| choice.soundness() == Soundness::Conservative);
            let false_culls = occlusion.false_culls.unwrap_or(0);
            if is_sound && false_culls > 0 {
                complain(&format!(
                    "{}: {} culled {false_culls} visible polygons",
                    file.display(),
                    run.name()
                ));
                outcome = Outcome::CheckFailed;
            }
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
    if let (Some(csv), Some(output)) = (csv, &outputs.csv) {
        output.commit(csv.finish().with_context(|| output.path().display().to_string())?)?;
    }
    // Nothing is pinned that has failed a check.
    if let Some(output) = outputs.pin.filter(|_| outcome == Outcome::Done) {
        output.check()?;
        new_pins.write(output.path())?;
    }
    Ok(outcome)
}

/// Why a session has no fingerprint to compare or to pin.
const INCOMPLETE: &str = "no index replayed every frame, so the session has no fingerprint: raise --budget";

/// Plays the first session in a window with the first index.
#[cfg(feature = "window")]
fn in_window(args: &ReplayArgs, outputs: &ReplayOutputs) -> anyhow::Result<Outcome> {
    use crate::app::{Autosaves, Command, Player, Studio, Subject, WindowOptions, run};
    let [file] = &args.files[..] else { anyhow::bail!("a window plays one session") };
    let options = args.reading.options();
    let player = Player::open_with(file, args.pace, args.camera, &options)?;
    for remark in player.remarks() {
        complain(&format!("warning: {remark}"));
    }
    let index = args.index.first().copied().unwrap_or(IndexKind::Osp);
    let pvs = args.pvs.as_ref().map(|path| Pvs::read(path, &player.finished_model())).transpose()?;
    let mut studio = Studio::new(Subject::Replay(Box::new(player)), Autosaves::new(None), index);
    studio.set_limits(options.limits);
    if let Some(pvs) = pvs {
        studio.set_pvs(Arc::new(pvs));
    }
    studio.set_tests(args.tests.node_test(), args.tests.score());
    let occlusion = args.pvs.as_ref().map_or(Occlusion::Auto, |_| Occlusion::Pvs);
    studio.command(Command::Occlusion(args.occlusion.first().copied().unwrap_or(occlusion)));
    let trace = outputs.trace.as_ref().map(|output| output.path().to_owned());
    run(studio, WindowOptions { trace, ..WindowOptions::default() })?;
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
    mut csv: Option<&mut CsvWriter<AtomicFile>>,
) -> anyhow::Result<ReplayReport> {
    let mut session = OpenSession::open(file, &args.reading)?;
    // Read once to know how long and how large it is, once to play it.
    let (summary, _, read) = summarize(&mut session, args.pace);
    for warning in &session.notes().warnings {
        complain(&format!("warning: {warning}"));
    }
    if session.notes().skipped > 0 {
        complain(&format!("warning: {}: {} damaged pieces skipped", file.display(), session.notes().skipped));
    }
    read?;
    args.reading.check_frames(file, &summary, args.pace)?;
    if summary.frames <= 1 && summary.counts.points > 1 && args.pace == Pace::Recorded {
        complain(&format!(
            "warning: {}: its time stamps put everything into one frame; try --pace samples:16",
            file.display()
        ));
    }

    let kinds = args.runs();
    let session = OpenSession::open(file, &args.reading)?;
    let camera = CameraPath::new(args.camera, session.header.camera, &summary.bounds);
    let finished = args.pvs.as_ref().map(|path| finished_model(args, file, path)).transpose()?;
    let pvs = finished.as_ref().map(|(_, pvs)| pvs);
    let lanes = lanes(args, &kinds, &session.header, &summary, pvs);
    let mut runs: Vec<RunReport> = Vec::new();
    for &(index, method) in &kinds {
        let mut run = RunReport::new(index.name(), summary.frames);
        run.occlusion = method.map(|method| OcclusionReport {
            tests: (args.tests.node_test(), args.tests.score()),
            ..OcclusionReport::new(method.name(), args.polygon_ns)
        });
        runs.push(run);
    }
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();

    #[cfg(feature = "render")]
    let methods = kinds.iter().map(|(_, method)| *method);
    #[cfg(feature = "render")]
    let mut drawing = args.draw.map(|size| super::drawing::Drawing::new(size, methods)).transpose()?;
    let csv_name = || args.csv.as_deref().unwrap_or(Path::new("-")).display().to_string();
    let mut verified = 0;
    let progress = progress_bar(summary.frames, &name);
    let player = match finished {
        Some((scene, _)) => Player::walk(session, args.pace, scene),
        None => Player::new(session, args.pace),
    };
    let mut replay = Replay::new(player, camera, lanes);
    while let Some(outcomes) = replay.step()? {
        let frames = outcomes.to_vec();
        let looked: Vec<bool> = frames.iter().map(Option::is_some).collect();
        for (run, frame) in runs.iter_mut().zip(&frames) {
            let Some(frame) = frame else { continue };
            run.add(frame);
            if let Some(csv) = &mut csv {
                csv.write(&name, run, frame).with_context(csv_name)?;
            }
        }
        // Evenly spaced, the last frame among them.
        if replay.frames() * args.verify_frames / summary.frames.max(1) > verified {
            verified += 1;
            verify_frame(&replay, &looked, &mut runs);
        }
        #[cfg(feature = "render")]
        if let Some(drawing) = &mut drawing {
            drawing.frame(&replay, &frames, &mut runs)?;
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

/// A session's model at its end, and the sets that have been made of it.
fn finished_model(args: &ReplayArgs, file: &Path, sets: &Path) -> anyhow::Result<(Scene, Arc<Pvs>)> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in OpenSession::open(file, &args.reading)? {
        scene.apply(&event?, &mut changes);
        changes.clear();
        scene.let_go();
    }
    let pvs = Pvs::read(sets, &scene)?;
    Ok((scene, Arc::new(pvs)))
}

/// Counts the visible polygons that the lanes of this frame have culled.
fn verify_frame<I>(replay: &Replay<I>, looked: &[bool], runs: &mut [RunReport])
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let Some(view) = replay.view() else { return };
    let Some(window) = view.window() else { return };
    let mut visible = None;
    for ((lane, run), _) in replay.lanes().iter().zip(runs).zip(looked).filter(|(_, looked)| **looked) {
        let Some(occlusion) = &mut run.occlusion else { continue };
        let pipeline = lane.pipeline();
        // All see the same in the frustum.
        let visible = visible.get_or_insert_with(|| {
            // Polygons that the frustum has culled wrongly are tested, too.
            let mut ids = lost_polygons(replay.scene(), view, &pipeline.in_view().to_vec());
            ids.extend(pipeline.in_view().ids());
            verify::visible_polygons(replay.scene(), &window, &ids, OracleConfig::default())
        });
        let missing = verify::missing(visible, &pipeline.draw_list().to_vec());
        *occlusion.false_culls.get_or_insert(0) += missing;
    }
}

fn lanes(
    args: &ReplayArgs,
    kinds: &[(IndexKind, Option<Occlusion>)],
    header: &Header,
    summary: &Summary,
    pvs: Option<&Arc<Pvs>>,
) -> Vec<Lane> {
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: root_cube(header, &summary.bounds), capacity };
    let budget = Budget { ns: (args.budget * 1.0e9) as u64, frames: summary.frames };
    let clock = StageClock::counting(allocations::count);
    let lane = |&(index, method): &(IndexKind, Option<Occlusion>)| {
        let pipeline = Pipeline::new(index.create(&config), capacity, clock);
        let pipeline = match method {
            Some(Occlusion::Pvs) => match pvs {
                Some(pvs) => pipeline.with_pass(PvsPass::new(Arc::clone(pvs))),
                None => pipeline,
            },
            Some(choice) => {
                // A run that is compared with pinned fingerprints must not depend on the clock.
                let is_pinned = args.check.is_some() || args.pin.is_some();
                let basis = if is_pinned { AutoBasis::Work } else { AutoBasis::Time };
                let (occluders, polygon_ns) = (args.occluders, args.polygon_ns);
                let (node_test, score) = (args.tests.node_test(), args.tests.score());
                let pass = PassConfig { choice, occluders, polygon_ns, basis, node_test, score };
                pipeline.with_occlusion(pass)
            }
            None => pipeline,
        };
        Lane::new(pipeline, budget)
    };
    kinds.iter().map(lane).collect()
}

fn progress_bar(frames: u64, name: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} frames, {eta} left");
    ProgressBar::new(frames)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(one_line(name).into_owned())
}

fn text(args: &ReplayArgs, report: &ReplayReport) -> String {
    let mut lines = vec![format!(
        "{}: {} strokes, {} points, {} polygons; {} frames ({}, camera {})",
        one_line(&report.recording),
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
    if args.tests.given().is_some() {
        lines.push(format!(
            "Occlusion culling: nodes tested by {}, occluders scored by {}.",
            args.tests.node_test().name(),
            args.tests.score().name()
        ));
    }
    for run in report.runs.iter().filter(|run| !run.is_complete()) {
        lines.push(format!(
            "{} was slow: measured on {} of {} frames, in evenly spaced stretches (--budget {}).",
            run.name(),
            thousands(run.measured_frames()),
            thousands(report.frames),
            args.budget
        ));
    }
    for run in report.runs.iter().filter(|run| run.refused > 0) {
        lines.push(format!(
            "{} refused {} changes: they moved polygons out of range, where nothing can be drawn.",
            run.index, run.refused
        ));
    }
    let verified = |run: &RunReport| Some((run.name(), run.occlusion.as_ref()?.false_culls?));
    for (name, false_culls) in report.runs.iter().filter_map(verified) {
        lines.push(format!("{name} culled {} visible polygons.", thousands(false_culls)));
    }
    if report.first_disagreement().is_none() {
        lines.push("All indexes saw the same polygons in every frame that they were measured on.".to_owned());
    }
    lines.join("\n")
}
