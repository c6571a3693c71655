use std::ops::Range;

use super::{Axis, Chart, GROUPS, GROUPS_OF_EXTRA, Line, grouped_into};
use crate::{
    bench::{SessionResult, SessionRow, estimate::quantile, session::same_frames},
    report::thousands,
};
use osp::frame::FrameRecord;
use osp_rivals::IndexKind;

/// Lines of the chart of insertion that are seen from the start, so that each can be told from the others.
const SHOWN: [IndexKind; 7] = [
    IndexKind::Osp,
    IndexKind::OctreeRebuild,
    IndexKind::OspPaper,
    IndexKind::BvhTwoLevel,
    IndexKind::DynamicBvh,
    IndexKind::BvhSah,
    IndexKind::BruteSimd,
];

/// The charts of a session: frames a second over all of it and over parts by size, and insertion.
pub(in crate::bench) fn session_charts(session: &SessionResult) -> Vec<Chart> {
    let parts =
        [("fewer than 1,000", 0..1000), ("1,000 to 10,000", 1000..10_000), ("over 10,000", 10_000..u64::MAX)];
    let mut charts = vec![frames_per_second(session, None)];
    charts.extend(parts.map(|part| frames_per_second(session, Some(part))));
    charts.push(insertion(session));
    charts
}

/// The frames measured of an index; none if it is not in the session.
fn records_of(session: &SessionResult, kind: IndexKind) -> &[FrameRecord] {
    let at = session.rows.iter().position(|row| row.index == kind.name());
    at.map_or(&[], |at| &session.records[at])
}

/// A line for each index that has values. Those of `shown` come first, the others are seen when somebody asks for them.
fn session_lines(
    session: &SessionResult,
    shown: &[IndexKind],
    value: impl Fn(&FrameRecord) -> Option<(f64, f64)>,
) -> Vec<Line> {
    let place = |name: &str| shown.iter().position(|kind| kind.name() == name);
    let mut rows: Vec<_> = session.rows.iter().zip(&session.records).collect();
    rows.sort_by_key(|(row, _)| place(&row.index).unwrap_or(shown.len()));
    let line = |(row, records): (&SessionRow, &Vec<FrameRecord>)| {
        let values: Vec<(f64, f64)> = records.iter().filter_map(&value).collect();
        let is_extra = place(&row.index).is_none();
        let groups = if is_extra { GROUPS_OF_EXTRA } else { GROUPS };
        let (points, thin) = grouped_into(&values, groups);
        Line { thin, is_extra, ..Line::of_structure(&row.index, points) }
    };
    rows.into_iter().map(line).filter(|line| !line.points.is_empty()).collect()
}

/// What a frame takes with each of two indexes, microseconds: the medians over the frames that both were measured on and
/// that are wanted.
fn median_us(
    of: &[FrameRecord],
    against: &[FrameRecord],
    wanted: impl Fn(&FrameRecord) -> bool,
) -> Option<[f64; 2]> {
    let pairs = same_frames(of, against).filter(|(record, _)| wanted(record));
    let us = |record: &FrameRecord| record.total_ns().max(1) as f64 / 1000.0;
    let (mut of, mut against): (Vec<f64>, Vec<f64>) = pairs.map(|(a, b)| (us(a), us(b))).unzip();
    for values in [&mut of, &mut against] {
        values.sort_unstable_by(f64::total_cmp);
    }
    (!of.is_empty()).then(|| [quantile(&of, 0.5), quantile(&against, 0.5)])
}

/// The paper's figure 19 and, for a part of the session, 21 to 23.
fn frames_per_second(session: &SessionResult, part: Option<(&str, Range<u64>)>) -> Chart {
    let kinds = [IndexKind::Osp, IndexKind::OctreeRebuild, IndexKind::OspPaper];
    let range = part.as_ref().map_or(0..u64::MAX, |(_, range)| range.clone());
    let mut lines = session_lines(session, &kinds, |record| {
        let fps = 1.0e9 / record.total_ns().max(1) as f64;
        range.contains(&record.polygons).then_some((record.frame as f64, fps))
    });
    let name = part.as_ref().map_or("whole session".to_owned(), |(name, _)| format!("{name} polygons"));
    let paper = match part.as_ref().map(|(_, range)| range.start) {
        None => {
            "The paper (figure 19): the octree is faster where nothing is inserted, and falls far below the OSP tree \
             wherever something is."
        }
        Some(0) => {
            "The paper (figure 21): with few polygons both are fast enough; the octree dips at insertions."
        }
        Some(1000) => {
            "The paper (figure 22): the octree is rebuilt for each polygon until modelling stutters; the OSP tree \
             slows only as drawing does."
        }
        Some(_) => {
            "The paper (figure 23): the octree stands still at every insertion; the OSP tree does not."
        }
    };
    let mut remarks = vec![paper.to_owned()];
    let [osp, octree, paper] = kinds.map(|kind| records_of(session, kind));
    let drawing = |record: &FrameRecord| range.contains(&record.polygons);
    if let Some([osp, octree]) = median_us(osp, octree, drawing) {
        let words = if osp < octree { "the same" } else { "the OPPOSITE" };
        remarks.push(format!(
            "Here: {words}; osp {} frames a second, octree-rebuild {} (medians over the same frames, of insertion and \
             culling alone, nothing is drawn), {:.1} times.",
            thousands((1.0e6 / osp) as u64),
            thousands((1.0e6 / octree) as u64),
            octree / osp
        ));
    }
    let still = |record: &FrameRecord| record.inserted + record.removed + record.updated == 0;
    if part.is_none()
        && let Some([osp, octree]) = median_us(osp, octree, still)
    {
        let words = if octree < osp { "the octree is faster, as in the paper" } else { "osp is faster, too" };
        remarks.push(format!(
            "In frames that insert nothing {words}: osp {osp:.2} µs, octree-rebuild {octree:.2} µs."
        ));
    }
    if let Some([paper, octree]) = median_us(paper, octree, drawing) {
        let words = if paper < octree { "is ahead of the octree, too" } else { "LOSES to the octree here" };
        remarks.push(format!(
            "The tree as the paper has it {words}: {} frames a second.",
            thousands((1.0e6 / paper) as u64)
        ));
    }
    // The fastest of a group says nothing about stuttering.
    lines.iter_mut().for_each(|line| line.thin.clear());
    Chart {
        title: format!("{}, {name}: frames a second", session.recording),
        remarks,
        x: Axis::Linear("frame"),
        y: Axis::Log("insertion and culling, frames a second"),
        lines,
    }
}

/// Insertion over the session.
fn insertion(session: &SessionResult) -> Chart {
    let lines = session_lines(session, &SHOWN, |record| {
        let us = record.insert.ns as f64 / 1000.0;
        (record.inserted > 0).then_some((record.polygons as f64, us))
    });
    let mut remarks = vec![
        "The paper: building the OSP tree takes the same time however many polygons there are; the octree's grows with \
         them."
            .to_owned(),
    ];
    let osp = records_of(session, IndexKind::Osp);
    let others = session.rows.iter().zip(&session.records).filter(|(row, _)| row.index != "osp");
    let best = others
        .filter_map(|(row, records)| Some((row, insertion_us(osp, records)?)))
        .min_by(|(_, a), (_, b)| (a[1][1] / a[0][1]).total_cmp(&(b[1][1] / b[0][1])));
    if let (Some((other, [ours, theirs])), Some([all, _])) = (best, insertion_us(osp, osp)) {
        let [p50, p99, max] = all;
        remarks.push(format!(
            "Here: osp {p50:.2} µs at 50 %, {p99:.2} at 99 %, {max:.1} at most. The best of the others at 99 % is {} with {:.2} \
             µs, osp {:.2} in the same frames{}.",
            other.index,
            theirs[1],
            ours[1],
            if theirs[1] < ours[1] { ": osp LOSES there" } else { "" }
        ));
    }
    Chart {
        title: format!("{}: inserting what a frame brings", session.recording),
        remarks,
        x: Axis::Linear("polygons"),
        y: Axis::Log("µs (thin: slowest)"),
        lines,
    }
}

/// Insertion with each of two indexes at 50, 99 and 100 per cent of the frames that insert and that both were measured on,
/// microseconds.
fn insertion_us(of: &[FrameRecord], against: &[FrameRecord]) -> Option<[[f64; 3]; 2]> {
    let us = |record: &FrameRecord| record.insert.ns.max(1) as f64 / 1000.0;
    let pairs = same_frames(of, against).filter(|(record, _)| record.inserted > 0);
    let (mut of, mut against): (Vec<f64>, Vec<f64>) = pairs.map(|(a, b)| (us(a), us(b))).unzip();
    let high = |values: &mut Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        [0.5, 0.99, 1.0].map(|q| quantile(values, q))
    };
    (!of.is_empty()).then(|| [high(&mut of), high(&mut against)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_over_the_same_frames() {
        let record = |frame: u64, ns: u64| {
            let mut record = FrameRecord { frame, polygons: frame, ..FrameRecord::default() };
            record.cull.ns = ns;
            record
        };
        // The other was measured in every tenth frame only, and those are slow for both.
        let of: Vec<FrameRecord> =
            (0..100).map(|frame| record(frame, if frame % 10 == 3 { 9_000 } else { 1_000 })).collect();
        let other: Vec<FrameRecord> = (0..10).map(|i| record(i * 10 + 3, 20_000)).collect();
        assert_eq!(median_us(&of, &other, |_| true), Some([9.0, 20.0]));
        assert_eq!(median_us(&of, &of, |_| true), Some([1.0, 1.0]));
        assert_eq!(median_us(&of, &of, |record| record.polygons == 13), Some([9.0, 9.0]));
        assert_eq!(median_us(&of, &other, |record| record.polygons == 14), None);
    }

    #[test]
    fn insertion_is_compared_over_the_same_frames() {
        let record = |frame: u64, inserted: u64, ns: u64| {
            let mut record = FrameRecord { frame, inserted, ..FrameRecord::default() };
            record.insert.ns = ns;
            record
        };
        let of = [record(0, 1, 9_000), record(1, 1, 1_000), record(2, 0, 50_000), record(3, 1, 3_000)];
        let other = [record(1, 1, 4_000), record(2, 0, 1), record(3, 1, 8_000)];
        assert_eq!(insertion_us(&of, &other), Some([[1.0, 3.0, 3.0], [4.0, 8.0, 8.0]]));
        assert_eq!(insertion_us(&of, &other[1..2]), None);
    }
}
