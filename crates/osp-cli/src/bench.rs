//! `osp bench`: every structure on sessions, on growth to millions of polygons, and on a flight through the models.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, ensure};
use indicatif::ProgressBar;

use super::{
    bench_args::BenchArgs,
    bench_paper,
    outcome::Outcome,
    output::{complain, one_line, say},
    outputs::Outputs,
    progress,
    session::OpenSession,
};
use osp::{
    index::IndexConfig,
    math::Aabb,
    occlusion::{CullConfig, Occlusion, OcclusionConfig, SelectConfig},
};
use osp_lab::bench::{
    self, Adapter, BenchReport, Contender, Flight, GrowthConfig, Machine, MovingConfig, MovingResult,
    PaperInput, PaperResult, RaysConfig, RaysModel, RaysResult, SessionInput, SessionResult,
};
use osp_session::{
    output_file::OutputKind,
    recording::{Event, Header, RecordingError, SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, RigPath, Summary, root_cube, summarize},
    scene::Scene,
};

/// Polygons that a frame of the growing model inserts.
const BATCH: u32 = 8;
/// Frames of a flight.
const FLIGHT_FRAMES: u64 = 360;
/// Polygons of the synthetic model that rays are cast into, at most.
const MOST_FOR_RAYS: u32 = 1_000_000;
/// Polygons of the synthetic model of which some move, at most.
const MOST_MOVING: u32 = 1_000_000;

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Outcome> {
    ensure!(
        !args.files.is_empty() || !args.no_growth || args.paper.is_asked(),
        "nothing to measure: name a session, or leave --no-growth out"
    );
    let rig = args.rig.path()?;
    ensure!(
        rig.is_none() || (!args.files.is_empty() && !args.paper.is_alone()),
        "--rig is about the frames of sessions: name a session"
    );
    let mut outputs = Outputs::new(args.force).reads(&args.files).reads(&args.rig.screens.file());
    let csv = outputs.add_any("--csv", args.csv.as_ref(), OutputKind::Csv)?;
    let html = outputs.add_any("--html", args.html.as_ref(), OutputKind::Html)?;
    let mut kinds = if args.index.is_empty() { Contender::all() } else { args.index.clone() };
    if !kinds.contains(&Contender::Own(args.reference)) {
        kinds.insert(0, Contender::Own(args.reference));
    }
    let progress = progress::spinner();
    let adapter = args.paper.adapter();
    let (mut sessions, mut flights, mut rays, mut paper) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for file in &args.files {
        let opened = read(args, file, &progress)?;
        if !args.paper.is_alone() {
            let (session, more) = measure_session(args, rig.clone(), &kinds, &opened, &progress)?;
            sessions.push(session);
            flights.extend(more);
            if !args.no_rays {
                let model = RaysModel::of_scene(&opened.name(), &opened.scene, opened.root());
                rays.extend(cast_rays(args, &kinds, &model, &progress));
            }
        }
        if args.paper.is_asked() {
            let events = OpenSession::open(file, &args.reading)?;
            paper.push(measure_paper(args, &opened, events, adapter.as_ref(), &progress)?);
        }
    }
    if args.files.is_empty() && args.paper.is_asked() {
        let events = || synthesize(SynthKind::Room, bench_paper::SYNTHETIC, 1);
        let (summary, scene, read) = summarize(events(), args.pace);
        read?;
        let (file, header) = (PathBuf::from("synth-room"), Header::new("", ""));
        let opened = Opened { file: &file, header, summary, scene };
        paper.push(measure_paper(args, &opened, events(), adapter.as_ref(), &progress)?);
    }
    let (growth, skipped) = match args.no_growth || args.paper.is_alone() {
        true => (Vec::new(), Vec::new()),
        false => grow(args, &kinds, &progress)?,
    };
    if !args.no_growth && !args.no_rays && !args.paper.is_alone() {
        for size in args.sizes().into_iter().filter(|&size| size <= MOST_FOR_RAYS) {
            rays.extend(cast_rays(args, &kinds, &RaysModel::synthetic(size)?, &progress));
        }
    }
    let moving = match args.no_growth || args.no_moving || args.paper.is_alone() {
        true => Vec::new(),
        false => move_things(args, &kinds, &progress)?,
    };
    progress.finish_and_clear();

    let report = BenchReport {
        machine: Machine::here(super::version::COMMIT),
        command: command(),
        reference: args.reference.name().to_owned(),
        sessions,
        growth,
        skipped,
        flights,
        rays,
        moving,
        paper,
    };
    if let Some(output) = csv {
        output.write(report.to_csv().as_bytes())?;
    }
    if let Some(output) = html {
        let page = bench::page(&report).map_err(|e| anyhow!("{}: {e}", output.path().display()))?;
        output.write(page.as_bytes())?;
    }
    say(&if args.json { report.to_json() } else { report.to_text() })?;
    let agree = report.sessions.iter().all(|session| session.indexes_agree)
        && report.rays.iter().all(|rays| rays.disagree.is_empty())
        && report.moving.iter().all(|moving| moving.disagree.is_empty());
    Ok(if agree { Outcome::Done } else { Outcome::CheckFailed })
}

/// The command line, for the report.
fn command() -> String {
    // A file's name need not be text.
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    words.join(" ")
}

/// A session that was read once.
struct Opened<'a> {
    file: &'a Path,
    header: Header,
    summary: Summary,
    scene: Scene,
}

impl Opened<'_> {
    fn name(&self) -> String {
        self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy().into_owned()
    }

    fn root(&self) -> Aabb {
        root_cube(&self.header, &self.summary.bounds)
    }

    fn path(&self, choice: CameraChoice) -> (CameraPath, &'static str) {
        (CameraPath::new(choice, self.header.camera, &self.summary.bounds), choice.name())
    }
}

fn read<'a>(args: &BenchArgs, file: &'a Path, progress: &ProgressBar) -> anyhow::Result<Opened<'a>> {
    progress.set_message(format!("{}: reading", one_line(&file.to_string_lossy())));
    let mut session = OpenSession::open(file, &args.reading)?;
    let (summary, scene, read) = summarize(&mut session, args.pace);
    read?;
    args.reading.check_frames(file, &summary, args.pace)?;
    for warning in &session.notes().warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(Opened { file, header: session.header.clone(), summary, scene })
}

fn measure_paper(
    args: &BenchArgs,
    opened: &Opened<'_>,
    events: impl Iterator<Item = Result<Event, RecordingError>>,
    adapter: Option<&Adapter>,
    progress: &ProgressBar,
) -> anyhow::Result<PaperResult> {
    let recording = opened.name();
    let input = PaperInput {
        recording: &recording,
        summary: &opened.summary,
        pace: args.pace,
        camera: opened.path(args.camera),
        root: opened.root(),
        scene: &opened.scene,
    };
    let say = |what: &str| progress.set_message(format!("{}, the paper: {what}", one_line(&recording)));
    Ok(bench::run_paper(&input, &args.paper.config(args.quick), events, adapter, say)?)
}

fn measure_session(
    args: &BenchArgs,
    rig: Option<RigPath>,
    kinds: &[Contender],
    opened: &Opened<'_>,
    progress: &ProgressBar,
) -> anyhow::Result<(SessionResult, Vec<Flight>)> {
    let recording = opened.name();
    let shown = one_line(&recording);
    let (root, scene) = (opened.root(), &opened.scene);
    let session = OpenSession::open(opened.file, &args.reading)?;
    let input = SessionInput {
        recording: recording.clone(),
        summary: opened.summary,
        pace: args.pace,
        camera: opened.path(args.camera),
        rig,
        root,
        kinds: kinds.to_vec(),
        reference: args.reference,
        budget_secs: args.session_secs(),
    };
    let config = IndexConfig { root, capacity: scene.polygon_count() };
    let cameras = [opened.path(CameraChoice::Inside), opened.path(CameraChoice::Orbit)];
    let mut frame = 0;
    let result = bench::run_session(&input, session, || {
        frame += 1;
        progress.set_message(format!("{shown}: frame {frame} of {}", input.summary.frames));
    })?;
    progress.set_message(format!("{shown}: flight"));
    let (node_test, score) = (args.paper.tests.node_test(), args.paper.tests.score());
    let occlusion = OcclusionConfig {
        select: SelectConfig { score, ..SelectConfig::default() },
        cull: CullConfig { node_test, ..CullConfig::default() },
        ..OcclusionConfig::default()
    };
    let fly =
        |camera| bench::fly(&recording, scene, config, camera, (Occlusion::Msvbsp, occlusion), FLIGHT_FRAMES);
    Ok((result, cameras.map(fly).to_vec()))
}

fn cast_rays(
    args: &BenchArgs,
    kinds: &[Contender],
    model: &RaysModel,
    progress: &ProgressBar,
) -> Option<RaysResult> {
    let config = RaysConfig {
        kinds: kinds.to_vec(),
        reference: args.reference,
        questions: if args.quick { 64 } else { 512 },
        budget_secs: if args.quick { 0.004 } else { 0.15 },
    };
    let shown = one_line(&model.recording).into_owned();
    bench::cast_rays(&config, model, |what| progress.set_message(format!("{shown}: rays, {what}")))
}

fn move_things(
    args: &BenchArgs,
    kinds: &[Contender],
    progress: &ProgressBar,
) -> anyhow::Result<Vec<MovingResult>> {
    let config = MovingConfig {
        sizes: args.sizes().into_iter().filter(|&size| size <= MOST_MOVING).collect(),
        kinds: kinds.to_vec(),
        reference: args.reference,
        budget_secs: if args.quick { 0.01 } else { 0.3 },
    };
    Ok(bench::move_things(&config, |what| progress.set_message(what.to_owned()))?)
}

type Growth = (Vec<bench::GrowthRow>, Vec<bench::Skipped>);

fn grow(args: &BenchArgs, kinds: &[Contender], progress: &ProgressBar) -> anyhow::Result<Growth> {
    let config = GrowthConfig {
        sizes: args.sizes(),
        kinds: kinds.to_vec(),
        reference: args.reference,
        batch: BATCH,
        budget_secs: args.growth_secs(),
    };
    Ok(bench::grow(&config, |what| progress.set_message(what.to_owned()))?)
}
