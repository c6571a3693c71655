//! `osp bench`: every structure on sessions, on growth to millions of polygons, and on a flight through the models.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, ensure};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use indicatif::ProgressBar;

use super::{
    Outcome,
    bench_paper::{self, PaperArgs},
    built::{Feature, Lacking},
    output::{complain, one_line, say},
    outputs::Outputs,
    parsers::{camera_parser, index_parser},
    progress,
    reading::ReadArgs,
    rig_args::RigPathArgs,
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
use osp_rivals::IndexKind;
use osp_session::{
    output_file::OutputKind,
    recording::{Event, Header, Pace, RecordingError, SynthKind, synthesize},
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

/// Compare all structures, on sessions of yours and on a synthetic one that grows to millions of polygons.
///
/// All indexes take turns in one process: each frame goes through every index before the next frame begins. The report
/// gives each median with its 95 % confidence interval, and each time with counts of work.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp bench recordings/*.ron --quick
  osp bench sketch.tilt --html sketch.html --csv sketch.csv
  osp bench --sizes 1000,100000,10000000 --index osp,octree-rebuild,lbvh
  osp bench recordings/room.ron --no-growth --json
  osp bench --sizes 10000,1000000 --no-rays --index osp,bvh-sah,bvh-two-level,dynamic-bvh
  osp bench recordings/room.ron --rig dual-wall --no-growth --no-rays
  osp bench recordings/room.ron --paper --draw --html paper.html
  osp bench sketch.tilt --paper --depth 15 --cube 0.5,1,2 --score paper --node-test sphere

Parts of the report:
  sessions  each file through every index, with one sample of the hand per frame
            (with --rig each frame is culled for all screens and eyes, beside one view times their
            number)
  growth    a synthetic session at each of the sizes: frames that insert a few polygons, and
            frames that insert none
  flight    the finished sessions: frustum culling alone, and with occlusion culling
  rays      the finished sessions, and the synthetic one at each of the sizes up to a million:
            nearest hit, any hit, what is in a box, nearest polygons of a point; in order and
            best first; while polygons arrive; refit against rebuild as polygons move
  moving    the synthetic session at each of the sizes up to a million: 1, 10 and 100 % of the
            polygons move in every frame, in pieces, as a group that is placed as a whole, and as
            instances of one mesh; each structure files their boxes again, `group-index` has an
            entry a group. Entries and boxes changed are counted. The command fails if a
            structure does not see what it has to
  paper     with --paper: the paper's experiments as it is printed. Its tree and its octree while
            the model grows (figures 19, 21 to 23): the planes that filing asks are counted, and
            all polygons of cut nodes are drawn. A flight with every culler (figure 20), also the
            paper's own that cull visible polygons: the column `conservative` says NO. How deep
            and how large its tree is best made. --node-test and --score are those of the
            conservative cullers
The page (--html) is one file that works offline: the verdict first, then links to all parts. A
click on a head sorts its table (best first at the start). Charts show the values under the
pointer; a click on a name shows or hides its line, and every structure has one. Beside each
chart stands what the paper found and what was measured. Dark where the system is; on paper, and
without scripts, the charts are pictures.
`osp replay --help` describes the indexes.")]
pub(super) struct BenchArgs {
    /// The sessions, of any format that replay reads.
    files: Vec<PathBuf>,
    /// Measure for a shorter time: under a minute for the shipped recordings.
    #[arg(long)]
    quick: bool,
    /// The indexes, separated by commas [default: all].
    #[arg(long, value_delimiter = ',', value_parser = contender_parser())]
    index: Vec<Contender>,
    /// The index that the others are compared with.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    reference: IndexKind,
    /// Numbers of polygons of the growing model [default: 1000,10000,100000,1000000; with --quick up to 100000].
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    sizes: Vec<u32>,
    /// Leave out the growing model.
    #[arg(long, conflicts_with = "sizes")]
    no_growth: bool,
    /// Leave out rays, ranges and neighbours.
    #[arg(long)]
    no_rays: bool,
    /// Leave out moving things.
    #[arg(long)]
    no_moving: bool,
    /// How much of a session a frame takes: `recorded` (by its time stamps) or `samples:N` (N samples of
    /// the hand).
    #[arg(long, default_value = "samples:1")]
    pace: Pace,
    /// Where the eye is in the sessions: `auto` is the recorded head path, else the session's own camera, else `orbit`;
    /// `orbit` circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    camera: CameraChoice,
    /// Write every figure to a CSV file, one per line.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print one JSON object instead of the tables.
    #[arg(long)]
    json: bool,
    /// Write one HTML page with tables and charts.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Let an output replace a file of another kind, even a session, but never a file that is read.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    paper: PaperArgs,
    #[command(flatten)]
    rig: RigPathArgs,
    #[command(flatten)]
    reading: ReadArgs,
}

impl BenchArgs {
    /// Seconds for each index on a session.
    fn session_secs(&self) -> f64 {
        if self.quick { 0.15 } else { 5.0 }
    }

    /// Numbers of polygons of the growing model.
    fn sizes(&self) -> Vec<u32> {
        match (&self.sizes[..], self.quick) {
            ([], true) => vec![1000, 10_000, 100_000],
            ([], false) => vec![1000, 10_000, 100_000, 1_000_000],
            (sizes, _) => sizes.to_vec(),
        }
    }

    /// Seconds for each index at a size.
    fn growth_secs(&self) -> f64 {
        if self.quick { 0.15 } else { 3.0 }
    }
}

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

fn contender_parser() -> impl TypedValueParser<Value = Contender> {
    let own = IndexKind::ALL.iter().map(|kind| kind.name());
    PossibleValuesParser::new(own.chain(Contender::PEERS)).try_map(|name| {
        let lacking = || Lacking(&[Feature::Peers]).to_string();
        Contender::from_name(&name).ok_or_else(lacking)
    })
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
