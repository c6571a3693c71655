//! Replays one session through all indexes.

use std::path::Path;

use anyhow::Context;
use indicatif::ProgressBar;

use super::{
    allocations,
    output::{file_name, warn},
    progress,
    read_session::{Keep, ReadSession},
    replay_args::{GroupIndexing, PlayArgs, ReplayArgs, TuningArgs},
    session::{OpenSession, Reader},
};
use osp::{
    frame::{AutoBasis, PassConfig, Pipeline, StageClock},
    index::IndexConfig,
    occlusion::Occlusion,
};
use osp_lab::{
    Method, lost_polygons,
    oracle::OracleConfig,
    report::{CsvWriter, OcclusionReport, ReplayReport, RigReport, RunReport, ViewsReport},
    verify,
};
use osp_rivals::{IndexKind, IndexSettings};
use osp_session::{
    atomic_file::AtomicFile,
    recording::{Event, Pace, RecordingError},
    replay::{Budget, CameraPath, Lane, Replay, RigPath},
};

/// Settings of a replay that depend on the command.
pub(super) struct ReplayContext<'a> {
    pub(super) reader: Reader,
    /// Measure by which `auto` chooses. Use counts of work if the culled polygons must not depend on the clock.
    pub(super) basis: AutoBasis,
    pub(super) progress: fn(frames: u64, name: &str) -> ProgressBar,
    /// Receives remarks about the session for the user.
    pub(super) remark: &'a mut dyn FnMut(&str),
    pub(super) rig: Option<RigPath>,
    /// The CSV file of the frames, with its path.
    pub(super) csv: Option<(&'a Path, &'a mut CsvWriter<AtomicFile>)>,
    /// Number of frames in which the culled polygons are compared with the hidden ones.
    pub(super) verify_frames: u64,
    /// Size of the pictures, if frames are also drawn.
    #[cfg(feature = "render")]
    pub(super) draw: Option<super::parsers::Size>,
}

pub(super) struct Replayed {
    pub(super) report: ReplayReport,
    pub(super) format: &'static str,
    pub(super) skipped: u64,
}

pub(super) fn replay_file(
    args: &ReplayArgs,
    file: &Path,
    rig: Option<RigPath>,
    csv: Option<&mut CsvWriter<AtomicFile>>,
) -> anyhow::Result<ReplayReport> {
    // A replay that is compared with pinned fingerprints must not depend on the clock.
    let is_pinned = args.check.is_some() || args.pin.is_some();
    let context = ReplayContext {
        reader: Reader::Thread,
        basis: if is_pinned { AutoBasis::Work } else { AutoBasis::Time },
        progress: |frames, name| progress::bar(frames, "frames", name),
        remark: &mut |remark| warn(&format!("warning: {remark}")),
        rig,
        csv: csv.map(|csv| (args.csv.as_deref().unwrap_or(Path::new("-")), csv)),
        verify_frames: args.verify_frames,
        #[cfg(feature = "render")]
        draw: args.draw,
    };
    Ok(replay(&args.play, &args.tuning, file, context)?.report)
}

pub(super) fn replay(
    play: &PlayArgs,
    tuning: &TuningArgs,
    file: &Path,
    context: ReplayContext<'_>,
) -> anyhow::Result<Replayed> {
    let ReplayContext { rig, mut csv, .. } = context;
    let mut session = OpenSession::read_by(context.reader, file, &play.reading)?;
    if context.reader == Reader::Thread {
        session = session.counted();
    }
    let (header, format) = (session.header.clone(), session.format);
    // The indexes need to know the length and the size of the session before its first frame.
    let (read_session, read) =
        ReadSession::of(header.clone(), &mut session, play.pace, Keep::Events, |_, _| {});
    let (summary, config) = (read_session.summary, read_session.index);
    session.notes().warnings.iter().for_each(|warning| (context.remark)(warning));
    let skipped = session.notes().skipped;
    if skipped > 0 {
        (context.remark)(&format!("{}: damaged parts skipped: {skipped}", file.display()));
    }
    read?;
    play.reading.check_frames(file, &summary, play.pace)?;
    if summary.frames <= 1 && summary.counts.points > 1 && play.pace == Pace::Recorded {
        (context.remark)(&format!(
            "{}: its time stamps put everything into one frame; try --pace samples:16",
            file.display()
        ));
    }

    let kinds = play.runs();
    let settings = tuning.settings(&play.indexes())?;
    let camera = CameraPath::new(play.camera, header.camera, &summary.bounds);
    let mut rig_report = rig.as_ref().map(RigReport::new);
    let mut lanes = lanes((play, tuning), context.basis, &kinds, &settings, &config, summary.frames);
    if rig.is_some() {
        // More lanes measure the cost of a single view, for comparison. With occlusion culling, a lane stays at the
        // same view for several frames, because the cullers use data of the previous frames.
        let turn = if kinds.iter().any(|(_, method)| method.is_some()) { 16 } else { 1 };
        let more = self::lanes((play, tuning), context.basis, &kinds, &settings, &config, summary.frames);
        lanes.extend(more.into_iter().map(|lane| lane.of_one_view(turn)));
    }
    let mut runs: Vec<RunReport> = Vec::new();
    for &(index, method) in &kinds {
        let mut run = RunReport::new(index.name(), summary.frames);
        run.occlusion = method.map(|method| OcclusionReport {
            tests: (tuning.tests.node_test(), tuning.tests.score()),
            ..OcclusionReport::new(method.name(), tuning.polygon_ns)
        });
        run.views = rig.as_ref().map(|_| ViewsReport::default());
        runs.push(run);
    }
    let name = file_name(file).into_owned();

    #[cfg(feature = "render")]
    let methods = kinds.iter().map(|(_, method)| *method);
    #[cfg(feature = "render")]
    let mut drawing = context
        .draw
        .map(|size| super::drawing::Drawing::new(size, methods.clone(), rig.as_ref()))
        .transpose()?;
    let mut verified = 0;
    let progress = (context.progress)(summary.frames, &name);
    let mut player = read_session.into_player();
    if tuning.groups == GroupIndexing::Whole {
        player = player.keeping_groups_whole();
    }
    let mut replay = Replay::new(player, camera, lanes);
    if let Some(rig) = rig {
        replay = replay.on_rig(rig);
    }
    while let Some(outcomes) = replay.step()? {
        let mut frames = outcomes.to_vec();
        // With a rig, the lanes of a single view follow the lanes of all views.
        let of_one_view = frames.split_off(kinds.len());
        if let Some(report) = &mut rig_report {
            report.add(replay.rig_views());
        }
        let replayed: Vec<bool> = frames.iter().map(Option::is_some).collect();
        for (i, (run, frame)) in runs.iter_mut().zip(&frames).enumerate() {
            let Some(frame) = frame else { continue };
            run.add(frame);
            if let Some(views) = &mut run.views {
                let one = of_one_view.get(i).and_then(Option::as_ref);
                views.add(replay.rig_views(), replay.lanes()[i].pipeline(), frame, one);
            }
            if let Some((path, csv)) = &mut csv {
                csv.write(&name, run, frame).with_context(|| path.display().to_string())?;
            }
        }
        #[cfg(feature = "render")]
        if let Some(drawing) = &mut drawing {
            drawing.frame(&replay, &frames, &mut runs)?;
        }
        // These frames are evenly spaced and include the last one.
        if replay.frames() * context.verify_frames / summary.frames.max(1) > verified {
            verified += 1;
            verify_frame(&replay, &replayed, &mut runs);
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    for (run, lane) in runs.iter_mut().zip(replay.lanes()) {
        run.bytes = lane.pipeline().bytes();
        run.refused = lane.pipeline().refused();
    }
    let counts = summary.counts;
    let report = ReplayReport {
        recording: name,
        strokes: counts.strokes,
        points: counts.points,
        polygons: counts.polygons,
        frames: summary.frames,
        pace: play.pace.to_string(),
        camera: match &rig_report {
            Some(rig) => rig.camera(play.camera.name()),
            None => play.camera.name().to_owned(),
        },
        rig: rig_report,
        load: replay.load(),
        runs,
    };
    Ok(Replayed { report, format, skipped })
}

/// Counts the visible polygons that the lanes have wrongly culled in this frame.
fn verify_frame<I>(replay: &Replay<I>, replayed: &[bool], runs: &mut [RunReport])
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    for (number, view) in replay.views().iter().enumerate() {
        let Some(window) = view.window() else { continue };
        let mut visible = None;
        for ((lane, run), _) in
            replay.lanes().iter().zip(&mut *runs).zip(replayed).filter(|(_, replayed)| **replayed)
        {
            let Some(occlusion) = &mut run.occlusion else { continue };
            let pipeline = lane.pipeline();
            let (Some(in_view), Some(drawn)) =
                (pipeline.in_view_lists().get(number), pipeline.draw_lists().get(number))
            else {
                continue;
            };
            // All lanes have the same polygons in the frustum, so the first lane computes the visible polygons.
            let visible = visible.get_or_insert_with(|| {
                // Also tests the polygons that frustum culling has wrongly culled.
                let mut ids = lost_polygons(replay.scene(), view, &in_view.to_vec());
                ids.extend(in_view.ids());
                verify::visible_polygons(replay.scene(), &window, &ids, OracleConfig::default())
            });
            let missing = verify::missing(visible, &drawn.to_vec());
            *occlusion.false_culls.get_or_insert(0) += missing;
        }
    }
}

fn lanes(
    (play, tuning): (&PlayArgs, &TuningArgs),
    basis: AutoBasis,
    kinds: &[(IndexKind, Option<Method>)],
    settings: &IndexSettings,
    config: &IndexConfig,
    frames: u64,
) -> Vec<Lane> {
    let budget = Budget { ns: (play.budget * 1.0e9) as u64, frames };
    let clock = StageClock::counting(allocations::count);
    let lane = |&(index, method): &(IndexKind, Option<Method>)| {
        let pipeline = Pipeline::new(index.create_with(config, settings), config.capacity).with_clock(clock);
        let pipeline = match method {
            Some(method) => {
                let (occluders, polygon_ns) = (tuning.occluders, tuning.polygon_ns);
                let (node_test, score) = (tuning.tests.node_test(), tuning.tests.score());
                let pass = PassConfig {
                    occluders,
                    polygon_ns,
                    basis,
                    node_test,
                    score,
                    ..PassConfig::for_strokes(Occlusion::Auto)
                };
                method.add_to(pipeline, pass)
            }
            None => pipeline,
        };
        Lane::new(pipeline, budget)
    };
    kinds.iter().map(lane).collect()
}
