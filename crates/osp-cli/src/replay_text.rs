//! The text of `osp replay` for a session.

use super::{
    output::{columns, one_line},
    replay_args::ReplayArgs,
};
use osp_lab::report::{ReplayReport, RunReport, thousands};

/// Returns the table of a session, with remarks on it.
pub(super) fn text(args: &ReplayArgs, report: &ReplayReport) -> String {
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
    if args.play.tests.given().is_some() {
        lines.push(format!(
            "Occlusion culling: nodes tested by {}, occluders scored by {}.",
            args.play.tests.node_test().name(),
            args.play.tests.score().name()
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
