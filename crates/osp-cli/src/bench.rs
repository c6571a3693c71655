//! `osp bench`: every structure on sessions, on growth to millions of polygons, and on a flight through the models.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use indicatif::ProgressBar;

use super::{
    bench_args::BenchArgs,
    bench_paper,
    output::{Outcome, file_name, one_line, print_result},
    progress,
    read_session::{Keep, ReadSession},
};
use osp::{
    index::IndexConfig,
    math::Aabb,
    occlusion::{CullConfig, Occlusion, OcclusionConfig, SelectConfig},
};
use osp_lab::{
    bench::{
        self, Adapter, BenchReport, Contender, GrowthConfig, Length, Machine, MovingConfig, PaperInput,
        RaysConfig, RaysModel, SessionInput,
    },
    rows::Rows,
};
use osp_session::{
    recording::{Header, SynthKind, synthesize},
    replay::{CameraChoice, CameraPath},
    scene::Scene,
};

/// Number of polygons that each frame of the growing model inserts.
const BATCH: u32 = 8;
const FLIGHT_FRAMES: u64 = 360;
/// Largest number of polygons of the synthetic model into which rays are cast.
const MOST_FOR_RAYS: u32 = 1_000_000;
/// Largest number of polygons of the synthetic model in which some polygons move.
const MOST_MOVING: u32 = 1_000_000;

pub(super) fn run(args: &BenchArgs) -> anyhow::Result<Outcome> {
    ensure!(
        !args.files.is_empty() || !args.no_growth || args.paper.is_given(),
        "nothing to measure: name a session, or leave --no-growth out"
    );
    let mut outputs = args.force.outputs().reads(&args.files);
    let csv = outputs.add_any(args.csv.as_ref(), &[])?;
    let html = outputs.add_any(args.html.as_ref(), &[])?;
    let mut kinds = if args.index.is_empty() { Contender::usual() } else { args.index.clone() };
    if !kinds.contains(&Contender::Own(args.reference)) {
        kinds.insert(0, Contender::Own(args.reference));
    }
    let progress = progress::spinner();
    let adapter = args.paper.adapter();
    // Order of the report: sessions, flights, growth, rays, moving things, the paper.
    let [mut rows, mut rays, mut paper] = [(); 3].map(|()| Rows::default());
    for (file, name) in args.files.iter().zip(names(&args.files)) {
        let opened = read(args, file, name, &progress)?;
        if !args.paper.is_alone() {
            rows.append(measure_session(args, &kinds, &opened, &progress)?);
            if !args.no_rays {
                let model = RaysModel::of_scene(&opened.name, opened.scene(), opened.root());
                rays.append(cast_rays(args, &kinds, &model, &progress));
            }
        }
        if args.paper.is_given() {
            paper.append(measure_paper(args, &opened, adapter.as_ref(), &progress)?);
        }
    }
    if args.files.is_empty() && args.paper.is_given() {
        let (events, header) = (synthesize(SynthKind::Room, bench_paper::SYNTHETIC, 1), Header::new("", ""));
        let (session, read) = ReadSession::of(header, events, args.pace, Keep::Events, |_, _| {});
        read?;
        let opened = Opened { name: "synth-room".to_owned(), session };
        paper.append(measure_paper(args, &opened, adapter.as_ref(), &progress)?);
    }
    if !args.no_growth && !args.paper.is_alone() {
        rows.append(grow(args, &kinds, &progress)?);
        rows.append(rays);
        if !args.no_rays {
            for size in args.sizes().into_iter().filter(|&size| size <= MOST_FOR_RAYS) {
                rows.append(cast_rays(args, &kinds, &RaysModel::synthetic(size)?, &progress));
            }
        }
        if !args.no_moving {
            rows.append(move_things(args, &kinds, &progress)?);
        }
    } else {
        rows.append(rays);
    }
    rows.append(paper);
    progress.finish_and_clear();

    let report = BenchReport {
        machine: Machine::here(super::version::COMMIT),
        command: command(),
        reference: args.reference.name().to_owned(),
        rows,
    };
    if let Some(output) = csv {
        output.write(report.rows.to_csv().as_bytes())?;
    }
    if let Some(output) = html {
        output.write(bench::page(&report).as_bytes())?;
    }
    let text = match (&args.html, args.all) {
        _ if args.json => serde_json::to_string(&report)?,
        (_, true) => report.to_text(Length::All),
        (None, false) => report.to_text(Length::Short),
        (Some(page), false) => {
            format!("{}\nTables and charts: {}", report.to_text(Length::Verdict), page.display())
        }
    };
    print_result(&text)?;
    Ok(if report.rows.faults.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
}

pub(super) fn command() -> String {
    // A file's name need not be text.
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    words.join(" ")
}

/// Returns the names of the files. Numbers equal names, because rows with the same name belong to the same session.
fn names(files: &[PathBuf]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for file in files {
        let name = file_name(file).into_owned();
        let numbered = (2..).map(|number| format!("{name} ({number})"));
        let free = [name.clone()].into_iter().chain(numbered).find(|name| !names.contains(name));
        names.push(free.unwrap_or(name));
    }
    names
}

/// A session that has been read, and its name in the report.
struct Opened {
    name: String,
    session: ReadSession,
}

impl Opened {
    fn scene(&self) -> &Scene {
        &self.session.end.scene
    }

    fn root(&self) -> Aabb {
        self.session.index.root
    }

    fn path(&self, choice: CameraChoice) -> (CameraPath, &'static str) {
        let ReadSession { header, summary, .. } = &self.session;
        (CameraPath::new(choice, header.camera, &summary.bounds), choice.name())
    }
}

fn read(args: &BenchArgs, file: &Path, name: String, progress: &ProgressBar) -> anyhow::Result<Opened> {
    progress.set_message(format!("{}: reading", one_line(&file.to_string_lossy())));
    let session = ReadSession::at(file, &args.reading, args.pace, Keep::Events)?;
    args.reading.check_frames(file, &session.summary, args.pace)?;
    Ok(Opened { name, session })
}

fn measure_paper(
    args: &BenchArgs,
    opened: &Opened,
    adapter: Option<&Adapter>,
    progress: &ProgressBar,
) -> anyhow::Result<Rows> {
    let recording = opened.name.clone();
    let input = PaperInput {
        recording: &recording,
        summary: &opened.session.summary,
        pace: args.pace,
        camera: opened.path(args.camera),
        root: opened.root(),
        scene: opened.scene(),
    };
    let show = |what: &str| progress.set_message(format!("{}, the paper: {what}", one_line(&recording)));
    let config = args.paper.config(args.quick, &args.index, args.reference);
    Ok(bench::run_paper(&input, &config, opened.session.events(), adapter, show)?)
}

fn measure_session(
    args: &BenchArgs,
    kinds: &[Contender],
    opened: &Opened,
    progress: &ProgressBar,
) -> anyhow::Result<Rows> {
    let recording = opened.name.clone();
    let shown = one_line(&recording);
    let (root, scene) = (opened.root(), opened.scene());
    let input = SessionInput {
        recording: recording.clone(),
        summary: opened.session.summary,
        pace: args.pace,
        camera: opened.path(args.camera),
        root,
        kinds: kinds.to_vec(),
        reference: args.reference,
        budget_secs: args.session_secs(),
    };
    let config = IndexConfig { root, capacity: scene.polygon_count() };
    let cameras = [opened.path(CameraChoice::Inside), opened.path(CameraChoice::Orbit)];
    let mut frame = 0;
    let mut rows = bench::run_session(&input, opened.session.events(), || {
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
    let choice = (Occlusion::Msvbsp, occlusion);
    for camera in cameras {
        rows.append(bench::fly(&recording, scene, config, camera, choice, FLIGHT_FRAMES));
    }
    Ok(rows)
}

fn cast_rays(args: &BenchArgs, kinds: &[Contender], model: &RaysModel, progress: &ProgressBar) -> Rows {
    let config = RaysConfig {
        kinds: kinds.to_vec(),
        reference: args.reference,
        queries: if args.quick { 64 } else { 512 },
        budget_secs: if args.quick { 0.004 } else { 0.15 },
    };
    let shown = one_line(&model.recording).into_owned();
    bench::cast_rays(&config, model, |what| progress.set_message(format!("{shown}: rays, {what}")))
}

fn move_things(args: &BenchArgs, kinds: &[Contender], progress: &ProgressBar) -> anyhow::Result<Rows> {
    let config = MovingConfig {
        sizes: args.sizes().into_iter().filter(|&size| size <= MOST_MOVING).collect(),
        kinds: kinds.to_vec(),
        reference: args.reference,
        budget_secs: if args.quick { 0.01 } else { 0.3 },
    };
    Ok(bench::move_things(&config, |what| progress.set_message(what.to_owned()))?)
}

fn grow(args: &BenchArgs, kinds: &[Contender], progress: &ProgressBar) -> anyhow::Result<Rows> {
    let config = GrowthConfig {
        sizes: args.sizes(),
        kinds: kinds.to_vec(),
        reference: args.reference,
        batch: BATCH,
        budget_secs: args.growth_secs(),
    };
    Ok(bench::grow(&config, |what| progress.set_message(what.to_owned()))?)
}
