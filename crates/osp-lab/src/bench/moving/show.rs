//! The part of the report about moving things: tables, charts, sentences, lines of CSV.

use super::{MotionResult, MovingResult, MovingRow, subject::GROUP_INDEX};
use crate::{
    bench::{
        charts::{Axis, Chart, Line},
        csv::Lines,
        grid::{Grid, RATIO, REFERENCE, interval},
    },
    report::{LineStyle, VERMILION, short, thousands},
};

/// Motions of a table, by their places in the result.
const PIECES: [usize; 3] = [0, 1, 2];
const GROUPS: [usize; 4] = [3, 4, 5, 6];
/// The look of the group index, which is no structure of polygons.
const GROUP_STYLE: LineStyle = LineStyle::plain(VERMILION);

/// What the tables of a size are about.
pub(in crate::bench) fn heading(result: &MovingResult, reference: &str) -> String {
    format!(
        "Moving things: {} polygons of loose strokes in a 4 m cube; ratios against the same frame of {reference}",
        thousands(result.polygons as u64)
    )
}

/// The tables of a size, each with what it is about.
pub(in crate::bench) fn tables(result: &MovingResult) -> Vec<(String, Grid)> {
    let boxes_us = |at: usize| short(result.motions[at].boxes_us.median);
    let groups = format!(
        "As a group: the same polygons are placed by one transform, which turns them. A frame: the box of each polygon that \
         moves is computed from its corners ({}, {}, {} and {} µs), filed and all culled; {GROUP_INDEX} gets the transform \
         alone (an entry a group). Instances: 100 nodes show one mesh, and all move",
        boxes_us(3),
        boxes_us(4),
        boxes_us(5),
        boxes_us(6)
    );
    vec![
        (
            "In pieces of 32 polygons, each on its own small circle. A frame: the structure is told the new boxes, and \
             culls from inside"
                .to_owned(),
            times(result, &PIECES),
        ),
        (WORK.to_owned(), work(result, &PIECES)),
        (groups, times(result, &GROUPS)),
        (WORK.to_owned(), work(result, &GROUPS)),
    ]
}

const WORK: &str = "\
     Work to follow, a frame: entries that got another box where they were filed (set), entries filed elsewhere or again, \
     boxes of nodes computed";

/// The names of the structures in a result, in their order; in the first motion all are measured that are at all.
fn names(result: &MovingResult) -> impl Iterator<Item = &str> {
    result.motions.iter().take(1).flat_map(|motion| &motion.rows).map(|row| row.index.as_str())
}

fn row<'a>(result: &'a MovingResult, motion: usize, name: &str) -> Option<&'a MovingRow> {
    result.motions.get(motion)?.rows.iter().find(|row| row.index == name)
}

fn grid(
    result: &MovingResult,
    motions: &[usize],
    head: Vec<&'static str>,
    cells: impl Fn(&MovingRow) -> Vec<String>,
) -> Grid {
    let columns = (head.len() - 1) / motions.len();
    let of = |name: &str| {
        let parts = motions.iter().map(|&motion| match row(result, motion, name) {
            Some(row) => cells(row),
            None => vec!["-".to_owned(); columns],
        });
        [name.to_owned()].into_iter().chain(parts.flatten()).collect()
    };
    Grid::new(head, names(result).map(of).collect())
}

fn times(result: &MovingResult, motions: &[usize]) -> Grid {
    let pieces = vec![
        "index",
        "1 % move:\nframe, µs",
        REFERENCE,
        RATIO,
        "10 %:\nframe, µs",
        REFERENCE,
        RATIO,
        "all:\nframe, µs",
        REFERENCE,
        RATIO,
    ];
    let groups = vec![
        "index",
        "group of 1 %:\nframe, µs",
        REFERENCE,
        RATIO,
        "of 10 %:\nframe, µs",
        REFERENCE,
        RATIO,
        "of all:\nframe, µs",
        REFERENCE,
        RATIO,
        "100 instances:\nframe, µs",
        REFERENCE,
        RATIO,
    ];
    let head = if motions.len() == PIECES.len() { pieces } else { groups };
    grid(result, motions, head, |row| {
        vec![micro(row.frame_us.median), micro(row.reference_us.median), ratio(row)]
    })
    .least_first(RATIO)
}

fn work(result: &MovingResult, motions: &[usize]) -> Grid {
    let pieces = vec![
        "index",
        "1 %:\nset",
        "filed",
        "boxes",
        "10 %:\nset",
        "filed",
        "boxes",
        "all:\nset",
        "filed",
        "boxes",
    ];
    let groups = vec![
        "index",
        "of 1 %:\nset",
        "filed",
        "boxes",
        "of 10 %:\nset",
        "filed",
        "boxes",
        "of all:\nset",
        "filed",
        "boxes",
        "instances:\nset",
        "filed",
        "boxes",
    ];
    let head = if motions.len() == PIECES.len() { pieces } else { groups };
    grid(result, motions, head, |row| match row.upkeep {
        Some(upkeep) => [upkeep.adjusted, upkeep.filed, upkeep.boxes].map(short).to_vec(),
        None => vec!["-".to_owned(); 3],
    })
    .least_first("boxes")
}

/// [`short`] has no place for the smallest ratios.
fn ratio(row: &MovingRow) -> String {
    if row.ratio.median < 0.1 { format!("{:.4}", row.ratio.median) } else { interval(&row.ratio) }
}

fn micro(us: f64) -> String {
    if us < 10.0 { format!("{us:.2}") } else { short(us) }
}

/// The best of the others with each motion, beside the reference.
fn best_of(
    result: &MovingResult,
    reference: &str,
    motions: impl IntoIterator<Item = usize>,
) -> Option<String> {
    let best = |at: usize| {
        let motion: &MotionResult = result.motions.get(at)?;
        let others = motion.rows.iter().filter(|row| row.index != reference);
        let best = others.min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
        let words = if best.ratio.median < 1.0 { "FASTER is" } else { "the fastest other is" };
        let ratio = if best.ratio.median < 0.1 {
            format!("{:.4}", best.ratio.median)
        } else {
            format!("{:.2}", best.ratio.median)
        };
        Some(format!("{}: {words} {}, with {ratio} times the time of {reference}", motion.motion, best.index))
    };
    let best: Vec<String> = motions.into_iter().filter_map(best).collect();
    (!best.is_empty()).then(|| format!("{}.", best.join("; ")))
}

/// The ratios of the structures, a list for each motion.
pub(in crate::bench) fn ratios(result: &MovingResult) -> Vec<Vec<(&str, f64)>> {
    result
        .motions
        .iter()
        .map(|motion| motion.rows.iter().map(|row| (row.index.as_str(), row.ratio.median)).collect())
        .collect()
}

/// What is seen at a size.
pub(in crate::bench) fn remarks(result: &MovingResult, reference: &str) -> Vec<String> {
    let mut remarks = Vec::new();
    if !result.disagree.is_empty() {
        remarks.push(format!("NOT THE POLYGONS THAT HAVE TO BE SEEN: {}.", result.disagree.join(", ")));
    }
    remarks.extend(best_of(result, reference, PIECES.into_iter().chain(GROUPS)));
    for skipped in &result.skipped {
        remarks.push(format!(
            "{} was left out at {} polygons: filling it and moving three frames takes about {} s.",
            skipped.index,
            thousands(u64::from(skipped.polygons)),
            short(skipped.expected_secs)
        ));
    }
    remarks
}

/// The charts of a size: a frame over the share that moves, in pieces and as a group.
pub(in crate::bench) fn charts(result: &MovingResult, reference: &str) -> Vec<Chart> {
    let mut names: Vec<&str> = names(result).collect();
    names.sort_by_key(|name| (*name != reference, *name != GROUP_INDEX));
    let size = thousands(result.polygons as u64);
    let chart = |(motions, how): ([usize; 3], &str)| {
        let line = |name: &&str| {
            let points = motions.iter().filter_map(|&at| {
                let share = 100.0 * result.motions.get(at)?.moving as f64 / result.polygons as f64;
                Some((share, row(result, at, name)?.frame_us.median))
            });
            match *name {
                GROUP_INDEX => Line::new(name, GROUP_STYLE, points.collect()),
                _ => Line::of_structure(name, points.collect()),
            }
        };
        Chart {
            title: format!("Moving things: {size} polygons, a frame that moves a share of them {how}"),
            remarks: best_of(result, reference, motions).into_iter().collect(),
            x: Axis::Log("% of the polygons that move"),
            y: Axis::Log("µs"),
            lines: names.iter().map(line).collect(),
        }
    };
    [(PIECES, "in pieces"), ([3, 4, 5], "as a group")].map(chart).into_iter().collect()
}

/// The figures, one a line.
pub(in crate::bench) fn csv(results: &[MovingResult], lines: &mut Lines) {
    for result in results {
        for motion in &result.motions {
            for row in &motion.rows {
                let of = format!(
                    "moving,\"{}\",{},{},{}",
                    motion.motion, row.index, result.polygons, row.frame_us.values
                );
                lines.estimate(&of, "frame", "us", &row.frame_us);
                lines.estimate(&of, "frame_reference", "us", &row.reference_us);
                lines.estimate(&of, "frame_ratio", "", &row.ratio);
                lines.estimate(&of, "move", "ns/polygon", &row.move_ns_per_polygon);
                lines.estimate(&of, "cull", "us", &row.cull_us);
                if let Some(upkeep) = row.upkeep {
                    lines.value(&of, "entries_set", "1/frame", upkeep.adjusted);
                    lines.value(&of, "entries_filed", "1/frame", upkeep.filed);
                    lines.value(&of, "boxes_computed", "1/frame", upkeep.boxes);
                }
                lines.value(&of, "boxes_culled", "1/frame", row.boxes_culled);
                lines.value(&of, "reported", "polygons", row.reported);
                lines.value(&of, "memory", "bytes/polygon", row.bytes_per_polygon);
            }
        }
    }
}
