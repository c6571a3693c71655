//! `osp replay`: plays sessions through several indexes, and writes the tables and checks.

use std::path::{Path, PathBuf};

#[cfg(feature = "window")]
use anyhow::bail;
use anyhow::{Context, ensure};

pub(super) use super::replay_args::ReplayArgs;
use super::{
    output::{Outcome, columns, one_line, print_result, warn},
    outputs::Output,
    replay_session::replay_file,
};
#[cfg(feature = "window")]
use osp::occlusion::Occlusion;
use osp::occlusion::Soundness;
#[cfg(feature = "bench")]
use osp_lab::report::{ChartFormat, draw_frame_times};
use osp_lab::{
    Method,
    report::{
        CsvWriter, OcclusionColumns, Pin, Pins, ReplayReport, RigReport, RunReport, pinned_name, thousands,
    },
};
use osp_rivals::CutNodes;
#[cfg(feature = "window")]
use osp_rivals::IndexKind;
#[cfg(feature = "window")]
use osp_session::replay::RoomMotion;

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<Outcome> {
    let outputs = Files::checked(args)?;
    #[cfg(feature = "window")]
    if args.window {
        return in_window(args, &outputs);
    }
    // Reports errors in the arguments before the work begins.
    args.play.check(args.draw.is_some())?;
    args.tuning.check(&args.play)?;
    ensure!(
        args.tuning.cut_nodes.cut_nodes != Some(CutNodes::Drawn)
            || (args.check.is_none() && args.pin.is_none()),
        "--cut-nodes drawn: expected no --check and no --pin, because fingerprints contain only polygons in view"
    );
    let rig = args.rig.path()?;
    let pins = args.check.as_deref().map(Pins::read).transpose()?;
    let mut new_pins = match &outputs.pin {
        Some(output) if output.path().exists() => Pins::read(output.path())?,
        _ => Pins::default(),
    };
    let mut csv = match &outputs.csv {
        Some(output) => {
            let columns = match args.play.occlusion.is_empty() {
                true => OcclusionColumns::Without,
                false => OcclusionColumns::With,
            };
            let file = CsvWriter::new(output.create()?, columns, rig.as_ref().map(RigReport::new).as_ref());
            Some(file.with_context(|| output.path().display().to_string())?)
        }
        None => None,
    };
    let mut outcome = Outcome::Done;
    #[cfg(feature = "bench")]
    let mut charts = outputs.charts.iter();
    for file in &args.files {
        let report = replay_file(args, file, rig.clone(), csv.as_mut())?;
        #[cfg(feature = "bench")]
        charts.next().map_or(Ok(()), |chart| draw_chart(chart, &report))?;
        let (text, complaints) = verdict(args, file, &report, pins.as_ref(), &mut new_pins)?;
        print_result(&text)?;
        for complaint in complaints {
            warn(&format!("{}: {complaint}", file.display()));
            outcome = Outcome::CheckFailed;
        }
    }
    if let (Some(csv), Some(output)) = (csv, &outputs.csv) {
        output.commit(csv.finish().with_context(|| output.path().display().to_string())?)?;
    }
    // Writes no pins if a check has failed.
    if let Some(output) = outputs.pin.filter(|_| outcome == Outcome::Done) {
        output.write_by(|file| new_pins.write(file))?;
    }
    Ok(outcome)
}

/// Returns the printed text of a session, and the failed checks. Adds the session's fingerprint to `new_pins`.
fn verdict(
    args: &ReplayArgs,
    file: &Path,
    report: &ReplayReport,
    pins: Option<&Pins>,
    new_pins: &mut Pins,
) -> anyhow::Result<(String, Vec<String>)> {
    let mut text = if args.json { serde_json::to_string(report)? } else { text(args, report) };
    let mut complaints = Vec::new();
    if let Some((first, second, frame)) = report.first_disagreement() {
        complaints.push(format!("{first} and {second} found different polygons in frame {frame}"));
    }
    for run in &report.runs {
        let Some(occlusion) = &run.occlusion else { continue };
        let is_sound = Method::from_name(occlusion.method)
            .is_some_and(|choice| choice.soundness() == Soundness::Conservative);
        let false_culls = occlusion.false_culls.unwrap_or(0);
        if is_sound && false_culls > 0 {
            complaints.push(format!("{} culled {false_culls} visible polygons", run.name()));
        }
    }
    let pin_in = |pins: &Path| {
        let name = pinned_name(file, pins);
        report.runs.iter().find_map(|run| Pin::of(&name, &report.pace, &report.camera, run))
    };
    let mut pinned = None;
    if let (Some(pins), Some(path)) = (pins, &args.check) {
        pinned = compare(pins, pin_in(path).as_ref());
        if pinned.is_none() && !args.json {
            text += &format!("\nas pinned in {}", path.display());
        }
    }
    if let Some(path) = &args.pin {
        match pin_in(path) {
            Some(pin) => new_pins.set(pin),
            None => pinned = Some(INCOMPLETE.to_owned()),
        }
    }
    complaints.extend(pinned);
    Ok((text, complaints))
}

struct Files {
    csv: Option<Output>,
    /// A chart for each session, if there are charts.
    #[cfg_attr(not(feature = "bench"), expect(dead_code, reason = "such a build refuses --chart"))]
    charts: Vec<Output>,
    pin: Option<Output>,
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only a window writes it"))]
    trace: Option<Output>,
}

impl Files {
    fn checked(args: &ReplayArgs) -> anyhow::Result<Self> {
        let mut outputs = args.force.outputs().reads(&args.files).reads(&args.check);
        outputs = outputs.reads(&args.rig.screens.file());
        let several = args.files.len() > 1;
        let charts = args.chart.iter().flat_map(|chart| {
            (1..=args.files.len()).map(move |n| if several { numbered(chart, n) } else { chart.clone() })
        });
        Ok(Self {
            charts: charts.map(|chart| outputs.add(&chart, &[".svg", ".png"])).collect::<Result<_, _>>()?,
            csv: outputs.add_any(args.csv.as_ref(), &[])?,
            pin: args.pin.as_ref().map(|pin| outputs.adds_to(pin, &[])).transpose()?,
            trace: outputs.add_any(args.trace.as_ref(), &[])?,
        })
    }
}

/// Appends a number to the name: `frames.png` becomes `frames-2.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    path.with_file_name(format!("{stem}-{number}{ending}"))
}

#[cfg(feature = "bench")]
fn draw_chart(chart: &Output, report: &ReplayReport) -> anyhow::Result<()> {
    let path = chart.path();
    let drawn =
        draw_frame_times(report, ChartFormat::of(path)).with_context(|| path.display().to_string())?;
    match drawn {
        Some(picture) => chart.write(&picture)?,
        None => warn(&format!("warning: {}: there is no frame to draw", path.display())),
    }
    Ok(())
}

/// The message if a session has no fingerprint to compare or to pin.
const INCOMPLETE: &str = "no index replayed every frame, so the session has no fingerprint: raise --budget";

/// Plays the first session in a window with the first index.
#[cfg(feature = "window")]
fn in_window(args: &ReplayArgs, outputs: &Files) -> anyhow::Result<Outcome> {
    use osp_app::{Autosaves, Command, ReplayStart, Session, Settings, Studio, WindowOptions, run};
    if args.rig.room == RoomMotion::Stands {
        bail!("--room stands does not work with --window: in a window the room follows the replay's camera");
    }
    let index = args.play.index.first().copied().unwrap_or(IndexKind::Osp);
    let settings = args.tuning.settings(&[index])?;
    let room = args.rig.screens.room()?;
    let [file] = &args.files[..] else { anyhow::bail!("a window plays one session") };
    let options = args.play.reading.options();
    let autosaves = Autosaves::new(None);
    let mut studio = Studio::new(Session::new(&autosaves), autosaves, index);
    studio.set_room(room);
    studio.set_film_maker(super::film::maker());
    studio.set_limits(options.limits);
    let plan = studio.culling_plan_mut();
    plan.settings = settings;
    (plan.node_test, plan.score) = (args.tuning.tests.node_test(), args.tuning.tests.score());
    let occlusion = args.play.occlusion.first().copied();
    studio.command(Command::Occlusion(occlusion.unwrap_or(Occlusion::Auto.into())));
    let trace = outputs.trace.as_ref().map(|output| output.path().to_owned());
    let start = if args.paused { ReplayStart::Paused } else { ReplayStart::Playing };
    studio.work_in_background();
    studio.replay_in_background(file, args.play.pace, args.play.camera, &options, start);
    studio.wait_for_small(file);
    if let Some(error) = studio.take_unread() {
        return Err(error.into());
    }
    studio.messages().iter().for_each(|said| warn(said));
    let settings = Some(Settings::default_path());
    run(studio, WindowOptions { trace, settings, ..WindowOptions::default() })?;
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

/// Returns the table of a session, with remarks on it.
fn text(args: &ReplayArgs, report: &ReplayReport) -> String {
    let mut lines = vec![format!(
        "{}: {} strokes, {} points, {} polygons; {} frames ({}, camera {})",
        one_line(&report.recording),
        thousands(report.strokes),
        thousands(report.points),
        thousands(report.polygons),
        thousands(report.frames),
        args.play.pace,
        one_line(&report.camera),
    )];
    if report.frames == 0 {
        lines.push("Nothing was drawn in this session: there is nothing to measure.".to_owned());
        return lines.join("\n");
    }
    let rows = report.rows();
    lines.push(rows.bare_tables(columns()));
    lines.extend(report.fastest().into_iter().flat_map(|fastest| rows.verdict(&fastest.name())));
    lines.extend(report.rig.iter().flat_map(|rig| rig.blind(report.frames)));
    if args.tuning.tests.given().is_some() {
        lines.push(format!(
            "Occlusion culling: nodes tested by {}, occluders scored by {}.",
            args.tuning.tests.node_test().name(),
            args.tuning.tests.score().name()
        ));
    }
    for run in report.runs.iter().filter(|run| !run.is_complete()) {
        lines.push(format!(
            "{} was slow: measured on {} of {} frames, in evenly spaced ranges (--budget {}).",
            run.name(),
            thousands(run.measured_frames()),
            thousands(report.frames),
            args.play.budget
        ));
    }
    for run in report.runs.iter().filter(|run| run.refused > 0) {
        lines.push(format!(
            "{} refused {} changes: they moved polygons out of range, where polygons cannot be drawn.",
            run.index, run.refused
        ));
    }
    let verified = |run: &RunReport| Some((run.name(), run.occlusion.as_ref()?.false_culls?));
    for (name, false_culls) in report.runs.iter().filter_map(verified) {
        lines.push(format!("{name} culled {} visible polygons.", thousands(false_culls)));
    }
    lines.extend(report.load.note());
    if report.first_disagreement().is_none() {
        lines.push("All indexes found the same polygons in every measured frame.".to_owned());
    }
    lines.join("\n")
}
