//! `osp verify`: compares occlusion culling with the true visibility.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use clap::Args;
use serde::Serialize;

use super::{
    allocations, numbers,
    output::{Outcome, file_name, print_result, warn},
    parsers::{Size, camera_parser, index_parser},
    progress,
    read_session::{Keep, ReadSession},
    reading::ReadArgs,
    session::OpenSession,
    structure_args::score_parser,
    verify_all::{Overview, Part, name_in, sessions},
    verify_drawn::DrawnTrials,
    verify_method::{NamedMethod, method_parser},
};
use osp::{
    frame::StageClock,
    occlusion::{
        CullConfig, Grouping, NodeTest, Occlusion, PolygonTest, PoolConfig, PreviousFrameOccluders, Score,
        SelectConfig,
    },
    view::View,
};
use osp_lab::{
    Method, literal,
    oracle::OracleConfig,
    pvs::Pvs,
    rows::Rows,
    scenes::TestScene,
    verify::{AtRest, Verifier, VerifyConfig},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Header, Pace, RecordingError},
    replay::{CameraChoice, CameraPath, SessionState},
    scene::Scene,
};

/// Check that occlusion culling removes only hidden polygons.
///
/// At evenly spaced frames of each session, the command draws a picture of polygon numbers at high resolution. A
/// polygon is visible if some pixel shows its number, or if a ray from the eye reaches it. Then each method culls the
/// same view. A conservative method must never cull a visible polygon; if one does, the exit code is 1.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp verify recordings/room.ron
  osp verify castle.obj --whole --camera inside --occluders 4,16,64,256
  osp verify scene:rooms scene:panels --occlusion frusta,svbsp,msvbsp,depth
  osp verify sketch.tilt --occlusion msvbsp-paper,msvbsp-paper-capless \\
      --node-test sphere --score paper
  osp verify room.ron --whole --pvs room.pvs
  osp verify --all sketches --views 32 --lenient
  osp verify sketch.tilt --occlusion hzb,queries --size 1920x1080

The table has a line for each method and number of occluders (times of this machine, one thread):
  used         occluders used in a view
  wrong        visible polygons that were culled, sum over all frames
  misreported  polygons that are listed twice, or that are not in the view
  hidden       share of the really hidden polygons that were culled
  nodes tested, polygons tested
               boxes tested in a view
  planes       splitting planes of the tree, or tiles of the depth buffer that
               are covered
  select, build, query
               time to choose the occluders, to build the culler, and to remove
               hidden polygons from the frustum's result: microseconds a view
--json prints the same values as rows: part, recording, index (the method), figure, unit, value.

All methods are measured on the same frames. At each view the camera rests for --settle frames, which do not count, \
and then for --frames frames, which count; the table gives means over these frames of all views. The methods that \
depend on the previous frames (depth-last, hzb, queries, auto) cull in all of these frames. The other methods would \
repeat the same work, so they cull once.
Errors (a visible polygon that is culled, a pixel that differs) count in the --settle frames, too.

depth-last uses the polygons that were visible in the previous frame as occluders; its column `used` counts the \
polygons that it drew into its depth buffer.

With hzb, queries or auto (in builds with the feature `render`) the command draws each frame with each method and \
without culling. If a pixel differs, the exit code is 1. `auto` selects hzb if hzb is faster; for this it needs \
--settle 24. Columns:
  pixels that differ  from the picture without culling, sum over all frames
  hidden              share of the hidden polygons that were not drawn
  below a sample      smaller than a sample: polygons that are visible by ray
                      but cover no sample of a pixel
  depth pass, colour pass
                      polygons drawn
  draw, gpu           milliseconds a frame, medians; draw mean: the mean of draw

Instead of a file, `scene:NAME` names a built-in scene: rooms, panels, ribbons-narrow, ribbons-wide.
`osp replay --help` describes the indexes and the methods of occlusion culling.")]
pub(super) struct VerifyArgs {
    /// The sessions, of any format that replay reads, or `scene:NAME` for a built-in scene; with --all folders, too.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Verify every session in the named folders, and end with a table of all. After an unreadable session the command
    /// continues; the exit code is then 1.
    #[arg(long)]
    all: bool,
    /// Verify only part K of N of the sessions of --all, sorted by path: every N-th session, beginning with the K-th.
    /// With another K each day, all sessions are verified in N days.
    #[arg(long, value_name = "K/N", requires = "all")]
    part: Option<Part>,
    /// Number of views of each session.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    views: u64,
    /// The methods, separated by commas [default: all conservative methods on the processor].
    #[arg(long, value_delimiter = ',', value_parser = method_parser())]
    occlusion: Vec<NamedMethod>,
    /// Width and height of the pictures drawn for hzb, queries and auto, pixels.
    #[arg(long, default_value = "1920x1080")]
    size: Size,
    /// Number of frames of each view that are measured.
    #[arg(long, default_value_t = AtRest::default().frames, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Number of frames of each view before the measured frames. In the first of these frames, methods that depend on
    /// the previous frame use the data of the previous view. `auto` first tries another method after 16 frames.
    #[arg(long, default_value_t = AtRest::default().settle, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000))]
    settle: u32,
    /// Largest number of occluders in a view; several numbers, separated by commas, are tried one after the other.
    #[arg(long, value_delimiter = ',', default_value = "64", value_parser = numbers::occluders)]
    occluders: Vec<usize>,
    /// The index whose nodes are tested.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    index: IndexKind,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    camera: CameraChoice,
    /// Part of the session that each frame plays. `recorded`: up to the time of the frame, by the recorded time stamps.
    /// `samples:N`: the next N hand samples.
    #[arg(long, default_value = "samples:16")]
    pace: Pace,
    /// Verify every view with the finished model, instead of the model at the time of the view.
    #[arg(long)]
    whole: bool,
    /// Form of an occluder: a `patch` of neighbouring polygons, or a `single` polygon.
    #[arg(long, default_value = "patch", value_parser = ["patch", "single"])]
    grouping: String,
    /// Volume by which a node is tested: its `box`, the `sphere` around it (as in the paper), or
    /// its eight `corners` in one shadow. `corners-apart` lets each corner be in a different shadow (left part of
    /// the paper's figure 14; not conservative).
    #[arg(long, default_value = "box", value_parser = ["box", "sphere", "corners", CORNERS_APART])]
    node_test: String,
    /// Score of an occluder: the `solid-angle` of its part in the picture, or equation (1) of the `paper`.
    #[arg(long, default_value = "solid-angle", value_parser = score_parser())]
    score: Score,
    /// Also verify the sets that `osp bake` has written for the finished model (with --whole).
    #[arg(long, value_name = "FILE", requires = "whole")]
    pvs: Option<PathBuf>,
    /// Test nodes only, not the polygons in them.
    #[arg(long)]
    nodes_only: bool,
    /// Measure each stage this many times and report the fastest.
    #[arg(long, default_value_t = 9, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Size of the picture that determines the visible polygons, pixels.
    #[arg(long, default_value = "2560x1440", value_name = "WxH", value_parser = pixels)]
    pixels: (u32, u32),
    /// Do not determine the visible polygons, which takes minutes for a million polygons; report only times, counts and
    /// pixels that differ.
    #[arg(long)]
    no_truth: bool,
    /// Print one JSON object for each session instead of a table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: ReadArgs,
}

/// Name of the node test in the left part of the paper's figure 14.
const CORNERS_APART: &str = "corners-apart";

fn pixels(text: &str) -> Result<(u32, u32), String> {
    numbers::sides(text, &(16..=16_384))
}

impl VerifyArgs {
    fn methods(&self) -> Vec<NamedMethod> {
        if self.occlusion.is_empty() { NamedMethod::conservative() } else { self.occlusion.clone() }
    }

    fn tests_corners_apart(&self) -> bool {
        self.node_test == CORNERS_APART
    }

    fn node_test(&self) -> NodeTest {
        let named = NodeTest::ALL.into_iter().find(|test| test.name() == self.node_test);
        named.unwrap_or(NodeTest::Corners)
    }

    /// Adds the variants that follow the paper literally and cull visible polygons.
    fn add_literal(&self, verifier: &mut Verifier) {
        let apart = self.tests_corners_apart();
        for method in self.methods().into_iter().filter(|method| method.capless || apart) {
            if !Method::CULLERS.contains(&method.occlusion) {
                continue;
            }
            for &occluders in &self.occluders {
                let culler = match method.capless {
                    true => literal::msvbsp_without_caps(occluders),
                    false => method.occlusion.create(occluders),
                };
                let culler = if apart { Box::new(literal::CornersApart::new(culler)) } else { culler };
                verifier.add(culler, occluders);
            }
        }
    }
}

/// The events of a file or of a built-in scene.
enum Source {
    File(Box<OpenSession>),
    Scene(std::vec::IntoIter<Event>),
}

impl Source {
    fn open(path: &Path, reading: &ReadArgs) -> anyhow::Result<Self> {
        match path.to_str().and_then(|name| name.strip_prefix("scene:")) {
            Some(name) => {
                let scene = TestScene::from_name(name).ok_or_else(|| {
                    let names: Vec<_> = TestScene::ALL.iter().map(|scene| scene.name()).collect();
                    anyhow::anyhow!("no scene is called {name}: expected {}", names.join(", "))
                })?;
                Ok(Self::Scene(scene.events().into_iter()))
            }
            None => Ok(Self::File(Box::new(OpenSession::open(path, reading)?))),
        }
    }

    fn header(&self) -> Option<&Header> {
        match self {
            Self::File(session) => Some(&session.header),
            Self::Scene(_) => None,
        }
    }
}

impl Iterator for Source {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self {
            Self::File(session) => session.next(),
            Self::Scene(events) => events.next().map(Ok),
        }
    }
}

pub(super) fn run(args: &VerifyArgs) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::Done;
    let files = match args.all {
        true => sessions(&args.files, args.part.unwrap_or(Part::WHOLE))?,
        false => args.files.clone(),
    };
    let mut overview = args.all.then(Overview::default);
    for file in &files {
        let (verifier, drawn, polygons) = match (verify(args, file), &mut overview) {
            (Ok(verified), _) => verified,
            (Err(error), None) => return Err(error),
            (Err(error), Some(overview)) => {
                warn(&format!("{error:#}"));
                overview.add_unread();
                outcome = Outcome::CheckFailed;
                continue;
            }
        };
        let name = file_name(file).into_owned();
        let mut rows = Rows::default();
        verifier.add_to(&mut rows, &name, polygons);
        if let Some(drawn) = &drawn {
            drawn.add_to(&mut rows, &name);
        }
        print_result(&match args.json {
            true => serde_json::to_string(&Verified {
                recording: &name,
                node_test: &args.node_test,
                score: args.score.name(),
                rows: &rows,
            })?,
            false => rows.all_tables(|_| true).trim_start().to_owned(),
        })?;
        for fault in &rows.faults {
            warn(fault);
            outcome = Outcome::CheckFailed;
        }
        if let Some(overview) = &mut overview {
            overview.add(&name_in(&args.files, file), polygons, &verifier);
        }
    }
    if let Some(overview) = overview.filter(|_| !args.json) {
        print_result(&overview.text())?;
    }
    Ok(outcome)
}

/// The JSON object of a session.
#[derive(Serialize)]
struct Verified<'a> {
    recording: &'a str,
    node_test: &'a str,
    score: &'a str,
    #[serde(flatten)]
    rows: &'a Rows,
}

fn config(args: &VerifyArgs) -> VerifyConfig {
    let grouping = if args.grouping == "single" { Grouping::Single } else { Grouping::Patches };
    let methods = args.methods();
    // [`VerifyArgs::add_literal`] adds the other methods.
    let methods = methods.iter().filter(|method| !method.capless && !args.tests_corners_apart());
    let methods = methods.map(|method| method.occlusion);
    let kinds = methods.filter(|occlusion| Method::CULLERS.contains(occlusion));
    VerifyConfig {
        kinds: kinds.collect(),
        occluders: args.occluders.clone(),
        pool: PoolConfig { grouping, ..PoolConfig::default() },
        select: SelectConfig { score: args.score, ..SelectConfig::default() },
        cull: CullConfig {
            node_test: args.node_test(),
            polygon_test: if args.nodes_only {
                PolygonTest::Never
            } else {
                PolygonTest::InPartlyHiddenLeaves
            },
            ..CullConfig::default()
        },
        oracle: OracleConfig { width: args.pixels.0 as usize, height: args.pixels.1 as usize },
        repeats: args.repeats,
    }
}

fn verify_view(
    verifier: &mut Verifier,
    drawn: &mut Option<DrawnTrials>,
    scene: &Scene,
    view: &View,
) -> anyhow::Result<()> {
    let views = verifier.views().views;
    verifier.verify_view(scene, view);
    if let Some(drawn) = drawn.as_mut().filter(|_| verifier.views().views > views) {
        drawn.draw_view(scene, view, verifier)?;
    }
    Ok(())
}

/// Plays a session and verifies its views. Returns the verifier, the drawn trials, and the number of polygons.
fn verify(args: &VerifyArgs, file: &Path) -> anyhow::Result<(Verifier, Option<DrawnTrials>, u64)> {
    let mut source = Source::open(file, &args.reading)?;
    let is_built_in = matches!(source, Source::Scene(_));
    // The last events of a built-in scene are the head poses of its views.
    let has_own_views = is_built_in && args.camera == CameraChoice::Auto;
    let whole = args.whole || is_built_in;
    let header = source.header().cloned().unwrap_or_else(|| Header::new("", ""));
    // The poses of the views of a finished model.
    let mut moments = Vec::new();
    let note = |events: &[Event], state: &SessionState| {
        if has_own_views {
            let heads = events.iter().filter(|event| matches!(event, Event::Head { .. }));
            moments.extend(heads.map(|head| {
                let mut moment = state.moment;
                moment.note(head);
                moment
            }));
        } else if whole {
            moments.push(state.moment);
        }
    };
    let keep = if whole { Keep::Frames } else { Keep::Events };
    let (session, read) = ReadSession::of(header.clone(), &mut source, args.pace, keep, note);
    if let Source::File(session) = &source {
        session.warn();
    }
    read?;
    let summary = session.summary;
    // A table of zeros would look like a result. With `--all`, folders may contain empty sessions.
    ensure!(args.all || summary.counts.polygons > 0, "{} has no polygons", file.display());
    // The views are evenly spaced and include the last frame.
    let mut verified = 0;
    let mut is_view = |frame: u64| {
        let is_due = frame * args.views / summary.frames.max(1) > verified;
        verified += u64::from(is_due);
        is_due
    };
    if !has_own_views {
        moments.retain(|moment| is_view(moment.frame));
    }
    let camera = CameraPath::new(args.camera, header.camera, &summary.bounds);
    let index = args.index.create(&session.index);
    let at_rest = AtRest { settle: args.settle, frames: args.frames };
    let mut verifier =
        Verifier::new(index, config(args), StageClock::counting(allocations::count)).with_rest(at_rest);
    args.add_literal(&mut verifier);
    if args.no_truth {
        verifier = verifier.without_truth();
    }
    if args.methods().iter().any(|method| method.occlusion == Occlusion::PreviousFrame.into()) {
        verifier
            .add_last(PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, session.index.capacity));
    }

    let mut drawn = DrawnTrials::new(&args.occlusion, args.size, at_rest)?;
    let mut player = session.into_player();
    let progress = progress::bar(args.views, "views", &file.to_string_lossy());
    while player.step()? {
        let (scene, changes) = (player.scene(), player.changes());
        verifier.follow(scene, changes);
        if let Some(drawn) = &mut drawn {
            drawn.follow(changes);
        }
        let moment = player.state().moment;
        if !whole && is_view(moment.frame) {
            verify_view(&mut verifier, &mut drawn, scene, &camera.view(&moment))?;
            progress.inc(1);
        }
    }
    if let Some(path) = &args.pvs {
        verifier = verifier.with_pvs(Pvs::read(path, player.scene())?);
    }
    for moment in moments.iter().take(args.views as usize) {
        verify_view(&mut verifier, &mut drawn, player.scene(), &camera.view(moment))?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok((verifier, drawn, summary.counts.polygons))
}
