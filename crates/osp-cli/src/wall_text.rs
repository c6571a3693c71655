//! The state of a wall as text.

use comfy_table::CellAlignment;

use super::output::one_line;
use osp_lab::report::{columns_table, thousands};
use osp_net::wall::{NodeCounts, NodeReport, Times, WallReport};

fn ms(us: u64) -> String {
    format!("{:.2}", us as f64 * 1.0e-3)
}

fn times(times: &Times) -> String {
    let Times { p50_us, p99_us, max_us, .. } = times;
    format!("p50 {}, p99 {}, longest {} ms", ms(*p50_us), ms(*p99_us), ms(*max_us))
}

/// Returns the table of a wall.
pub(super) fn text(report: &WallReport) -> String {
    let mut lines = vec![format!(
        "{} on {}: {:.1} frames a second (at most {}), {} frames; {} events, {} polygons",
        one_line(&report.session),
        one_line(&report.rig),
        report.frames_a_second,
        report.rate_hz,
        thousands(report.frames),
        thousands(report.events),
        thousands(report.polygons),
    )];
    lines.extend(report.trouble.as_deref().map(|trouble| one_line(trouble).into_owned()));
    lines.push(format!("frame (from the hub's message to the swap): {}", times(&report.frame)));
    lines.push(format!("between two swaps: {}", times(&report.period)));
    lines.push(format!(
        "skew (from the first to the last computer that reports a frame): {}",
        times(&report.skew)
    ));
    if report.garbage > 0 {
        lines.push(format!("{} messages did not belong to a wall", thousands(report.garbage)));
    }
    let mut table = columns_table();
    table.set_header([
        "screen",
        "state",
        "host",
        "ready p50 ms",
        "p99 ms",
        "behind",
        "missed",
        "inactive",
        "differed",
    ]);
    for column in table.column_iter_mut().skip(3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    for node in &report.nodes {
        table.add_row(row(node));
    }
    lines.push(table.trim_fmt());
    for node in &report.nodes {
        let differs = |what: &String| {
            format!(
                "{}: {} shows something else than the hub: {what}",
                one_line(&node.screen),
                one_line(&node.host)
            )
        };
        lines.extend(node.difference.as_ref().map(differs));
    }
    lines.join("\n")
}

fn row(node: &NodeReport) -> [String; 9] {
    [
        one_line(&node.screen).into_owned(),
        node.place.name().to_owned(),
        one_line(&node.host).into_owned(),
        ms(node.ready.p50_us),
        ms(node.ready.p99_us),
        thousands(node.behind),
        thousands(node.missed),
        thousands(node.dropped),
        thousands(node.differed),
    ]
}

/// Returns the final report of a computer of the wall.
pub(super) fn counts_text(counts: &NodeCounts) -> String {
    format!("{} frames, {} events of the session", thousands(counts.frames), thousands(counts.events))
}
