use super::{Axis, Chart, Line};
use crate::{
    bench::{Estimate, GrowthRow},
    report::{short, thousands},
};

/// Structures that take a new polygon where they are, without being built again.
const IN_PLACE: [&str; 12] = [
    "brute-force",
    "brute-simd",
    "time-order",
    "osp-paper",
    "dynamic-bvh",
    "loose-octree",
    "kd-tree",
    "quadtree",
    "parry3d",
    "obvhs",
    "rstar",
    "bvh-crate",
];

/// What a chart shows of a row: the time of a frame with the reference's time for the same frames and the ratio, or a number.
#[derive(Clone, Copy)]
enum Figure {
    Time {
        us: fn(&GrowthRow) -> &Estimate,
        reference_us: fn(&GrowthRow) -> &Estimate,
        ratio: fn(&GrowthRow) -> &Estimate,
    },
    Number(fn(&GrowthRow) -> f64),
}

impl Figure {
    fn value(self, row: &GrowthRow) -> f64 {
        match self {
            Self::Time { us, .. } => us(row).median,
            Self::Number(value) => value(row),
        }
    }
}

const FIGURES: [(&str, &str, Figure); 4] = [
    (
        "a frame that inserts and culls",
        "µs",
        Figure::Time {
            us: |row| &row.frame_us,
            reference_us: |row| &row.reference_us,
            ratio: |row| &row.ratio,
        },
    ),
    (
        "a frame that inserts nothing, from inside",
        "µs",
        Figure::Time {
            us: |row| &row.still_us,
            reference_us: |row| &row.still_reference_us,
            ratio: |row| &row.still_ratio,
        },
    ),
    (
        "a frame that inserts nothing, all in view",
        "µs",
        Figure::Time {
            us: |row| &row.still_all_us,
            reference_us: |row| &row.still_all_reference_us,
            ratio: |row| &row.still_all_ratio,
        },
    ),
    ("memory", "bytes a polygon", Figure::Number(|row| row.bytes_per_polygon)),
];

/// The charts of the model that grows: each figure of the structures that grow in place, and of those that are rebuilt. The
/// lines of the others are seen when somebody asks for them.
pub(in crate::bench) fn growth_charts(rows: &[GrowthRow], reference: &str) -> Vec<Chart> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.index.as_str()) {
            names.push(&row.index);
        }
    }
    let groups = [("structures that grow in place", true), ("structures that are rebuilt", false)];
    let mut charts = Vec::new();
    for (title, unit, figure) in FIGURES {
        for (group, grows) in groups {
            let is_drawn = |name: &str| name == reference || IN_PLACE.contains(&name) == grows;
            if !names.iter().any(|name| *name != reference && is_drawn(name)) {
                continue;
            }
            let mut ordered = names.clone();
            ordered.sort_by_key(|name| (*name != reference, !is_drawn(name)));
            let line = |name: &str| {
                let of_name = rows.iter().filter(|row| row.index == name);
                let points = of_name.map(|row| (f64::from(row.polygons), figure.value(row))).collect();
                Line { is_extra: !is_drawn(name), ..Line::of_structure(name, points) }
            };
            let drawn: Vec<&GrowthRow> = rows.iter().filter(|row| is_drawn(&row.index)).collect();
            charts.push(Chart {
                title: format!("{title}: {group}"),
                remarks: ahead(&drawn, reference, figure, unit),
                x: Axis::Log("polygons"),
                y: Axis::Log(unit),
                lines: ordered.into_iter().map(line).collect(),
            });
        }
    }
    charts
}

/// At each size: how far the reference is ahead of the best of the others that are drawn, or behind it.
fn ahead(drawn: &[&GrowthRow], reference: &str, figure: Figure, unit: &str) -> Vec<String> {
    let mut sizes: Vec<u32> = drawn.iter().map(|row| row.polygons).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let line = |size: u32| {
        let of_size = || drawn.iter().filter(|row| row.polygons == size);
        let others = || of_size().filter(|row| row.index != reference);
        let (best, theirs, ours, ratio) = match figure {
            Figure::Time { us, reference_us, ratio } => {
                let best = others().min_by(|a, b| ratio(a).median.total_cmp(&ratio(b).median))?;
                (best, us(best).median, reference_us(best).median, ratio(best).median)
            }
            Figure::Number(value) => {
                let best = others().min_by(|a, b| value(a).total_cmp(&value(b)))?;
                let ours = value(of_size().find(|row| row.index == reference)?);
                (best, value(best), ours, value(best) / ours.max(f64::MIN_POSITIVE))
            }
        };
        let size = thousands(u64::from(size));
        let [ours, theirs, times] = [ours, theirs, ratio].map(short);
        let best = &best.index;
        Some(match (figure, ratio >= 1.0) {
            // A median of ratios need not be the quotient of two medians.
            (Figure::Time { .. }, is_ahead) => format!(
                "{size} polygons: {reference} is {} {best}, which takes {times} times as long frame by frame (medians of the \
                 same frames: {theirs} and {ours} {unit}).",
                if is_ahead { "ahead of" } else { "BEHIND" }
            ),
            (Figure::Number(_), true) => {
                format!(
                    "{size} polygons: {reference} {ours} {unit}, less than {best}, {theirs} ({times} times)."
                )
            }
            (Figure::Number(_), false) => {
                format!(
                    "{size} polygons: {reference} {ours} {unit}, MORE than {best}, {theirs} ({times} times)."
                )
            }
        })
    };
    sizes.into_iter().filter_map(line).collect()
}
