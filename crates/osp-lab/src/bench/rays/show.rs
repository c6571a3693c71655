//! The rays' part of the report: tables, charts, sentences, lines of CSV.

use super::{Asked, MovedRow, NEIGHBOURS, RayRow, RaysResult};
use crate::{
    bench::{
        charts::{Axis, Chart, Line},
        csv::Lines,
        grid::{Grid, RATIO, REFERENCE, REFERENCE_RAYS, interval},
    },
    report::{GREEN, LineStyle, ORANGE, VERMILION, one_line, short, thousands},
};

/// What the table of times is about.
pub(in crate::bench) fn heading(result: &RaysResult) -> String {
    let [outside, inside] = result.hit_share.map(|share| share * 100.0);
    format!(
        "Rays, ranges and neighbours: {}, {} polygons; {outside:.0} % of the rays from outside hit, {inside:.0} % of those \
         from inside",
        one_line(&result.recording),
        thousands(result.polygons as u64)
    )
}

/// What the columns are.
pub(in crate::bench) fn legend(reference: &str) -> String {
    format!(
        "nearest, any: hits of rays, millions a second, exact test included; box: what is in a tenth of the model's length; \
         near: the {NEIGHBOURS} nearest polygons of a point; growing: a frame that inserts 8 polygons and casts 8 rays; \
         ratios of time against {reference}"
    )
}

/// Times of a structure's own queries.
pub(in crate::bench) fn times(result: &RaysResult) -> Grid {
    let head = vec![
        "index",
        "nearest, outside\nMRays/s",
        REFERENCE_RAYS,
        RATIO,
        "nearest, inside\nMRays/s",
        REFERENCE_RAYS,
        RATIO,
        "any, inside\nMRays/s",
        REFERENCE_RAYS,
        RATIO,
        "box\nµs",
        REFERENCE,
        RATIO,
        "near\nµs",
        REFERENCE,
        RATIO,
        "growing\nµs/frame",
        REFERENCE,
        RATIO,
    ];
    let rays = |asked: &Asked| {
        let reference = millions(1.0 / asked.reference_us.median.max(1.0e-9));
        [millions(asked.millions_a_second()), reference, interval(&asked.ratio)]
    };
    let us =
        |asked: &Asked| [short(asked.us.median), short(asked.reference_us.median), interval(&asked.ratio)];
    let row = |row: &RayRow| {
        let cells = [
            rays(&row.outside),
            rays(&row.inside),
            rays(&row.any),
            us(&row.range),
            us(&row.neighbours),
            us(&row.growing),
        ];
        [row.index.clone()].into_iter().chain(cells.into_iter().flatten()).collect()
    };
    Grid::new(head, result.rows.iter().map(row).collect()).least_first(RATIO)
}

/// What the walks look at, in both orders.
pub(in crate::bench) fn walks(result: &RaysResult) -> Grid {
    let head = vec![
        "index",
        "in order:\nnodes/ray",
        "boxes\n/ray",
        "polygons\n/ray",
        "MRays/s",
        "best first:\nnodes/ray",
        "boxes\n/ray",
        "polygons\n/ray",
        "MRays/s",
        "box:\nnodes",
        "boxes",
        "near:\nnodes",
        "boxes",
    ];
    let row = |row: &RayRow| {
        let walks = [row.in_order, row.best_first];
        let walked = walks.map(|walked| {
            let [nodes, boxes, asked] = [walked.nodes, walked.boxes, walked.polygons_asked].map(short);
            [nodes, boxes, asked, millions(walked.mrays_per_sec)]
        });
        let work = [row.range_work, row.neighbours_work].map(|work| work.map(short));
        let cells = walked.into_iter().flatten().chain(work.into_iter().flatten());
        [row.index.clone()].into_iter().chain(cells).collect()
    };
    Grid::new(head, result.rows.iter().map(row).collect()).least_first("boxes\n/ray")
}

/// Millions a second; [`short`] would make nothing of the slowest.
fn millions(a_second: f64) -> String {
    if a_second < 0.1 { format!("{a_second:.5}") } else { short(a_second) }
}

/// What the table of walks is about.
pub(in crate::bench) const WALKS: &str = "\
     Nearest hit with one and the same walk over each tree, rays from outside and from inside: down into the nearest child \
     first (in order), or always on with the nearest node that waits (best first); and the work of the structures' own range \
     and neighbour queries";

/// Refit against rebuild.
pub(in crate::bench) fn moved(result: &RaysResult) -> Grid {
    let head = vec![
        "every polygon moved\n% of the diagonal",
        "SAH, refitted\nboxes/ray",
        "SAH, rebuilt\nboxes/ray",
        "bvh-sah\nboxes/ray",
        "dynamic-bvh\nboxes/ray",
        "osp\nboxes/ray",
        "bvh-sah\nns/move",
        "dynamic-bvh\nns/move",
        "osp\nns/move",
    ];
    let row = |row: &MovedRow| {
        let boxes = [row.refitted, row.rebuilt, row.bvh_sah, row.dynamic_bvh, row.osp].map(short);
        let ns = row.update_ns_per_polygon.map(|ns| if row.moves == 0 { "-".to_owned() } else { short(ns) });
        [short(row.moved_share * 100.0)].into_iter().chain(boxes).chain(ns).collect()
    };
    Grid::new(head, result.moved.iter().map(row).collect())
}

/// What the table of moves is about.
pub(in crate::bench) const MOVED: &str = "\
     Refit against rebuild: every polygon drifts in its own direction. Refitted: the tree as it was built at first, its boxes \
     made to fit; rebuilt: built after the last move; bvh-sah refits until its boxes have grown by half, then rebuilds";

/// A question by its name.
pub(in crate::bench) type Question = (&'static str, fn(&RayRow) -> &Asked);

pub(in crate::bench) const QUESTIONS: [Question; 6] = [
    ("nearest hit from outside", |row| &row.outside),
    ("nearest hit from inside", |row| &row.inside),
    ("any hit", |row| &row.any),
    ("box", |row| &row.range),
    ("neighbours", |row| &row.neighbours),
    ("growing", |row| &row.growing),
];

/// The best of the others at a question, beside the reference.
fn best_of(result: &RaysResult, reference: &str, (name, asked): Question) -> Option<String> {
    let others = result.rows.iter().filter(|row| row.index != reference);
    let best = others.min_by(|a, b| asked(a).ratio.median.total_cmp(&asked(b).ratio.median))?;
    let ratio = asked(best).ratio.median;
    let words = if ratio < 1.0 { "FASTER is" } else { "the fastest other is" };
    Some(format!("{name}: {words} {}, with {ratio:.2} times the time of {reference}", best.index))
}

/// What is seen in a model.
pub(in crate::bench) fn remarks(result: &RaysResult, reference: &str) -> Vec<String> {
    let mut remarks = Vec::new();
    if !result.disagree.is_empty() {
        remarks.push(format!("NOT THE SAME ANSWERS AS {reference}: {}.", result.disagree.join(", ")));
    }
    let row = |name: &str| result.rows.iter().find(|row| row.index == name);
    let best: Vec<String> =
        QUESTIONS.into_iter().filter_map(|question| best_of(result, reference, question)).collect();
    if !best.is_empty() {
        remarks.push(format!("{}.", best.join("; ")));
    }
    if let [Some(midpoint), Some(sah)] = ["bvh-midpoint", "bvh-sah"].map(row) {
        let (midpoint, sah) = (midpoint.in_order.boxes, sah.in_order.boxes);
        remarks.push(format!(
            "SAH against midpoint: a ray tests {} boxes in bvh-sah and {} in bvh-midpoint, {:.2} times as many.",
            short(sah),
            short(midpoint),
            midpoint / sah.max(f64::MIN_POSITIVE)
        ));
    }
    remarks
}

/// What a chart over the sizes shows of a row.
#[derive(Clone, Copy)]
enum Figure {
    RaysASecond(usize),
    Micros(usize),
    BoxesARay,
}

impl Figure {
    fn of(self, row: &RayRow) -> f64 {
        match self {
            Self::RaysASecond(at) => QUESTIONS[at].1(row).millions_a_second() * 1.0e6,
            Self::Micros(at) => QUESTIONS[at].1(row).us.median,
            Self::BoxesARay => row.in_order.boxes,
        }
    }

    /// What is seen of it in a model.
    fn remark(self, result: &RaysResult, reference: &str) -> Option<String> {
        let about = match self {
            Self::RaysASecond(at) | Self::Micros(at) => best_of(result, reference, QUESTIONS[at])?,
            Self::BoxesARay => {
                let fewest =
                    result.rows.iter().min_by(|a, b| a.in_order.boxes.total_cmp(&b.in_order.boxes))?;
                let own = result.rows.iter().find(|row| row.index == reference)?;
                let [fewest_boxes, own_boxes] = [fewest, own].map(|row| short(row.in_order.boxes));
                format!("fewest in {}, {fewest_boxes}; {reference} {own_boxes}", fewest.index)
            }
        };
        Some(format!("{} polygons: {about}.", thousands(result.polygons as u64)))
    }
}

/// The charts over the sizes of the synthetic session, if there are several.
pub(in crate::bench) fn charts_by_size(results: &[RaysResult], reference: &str) -> Vec<Chart> {
    let mut names: Vec<&str> = Vec::new();
    let grown: Vec<&RaysResult> = results.iter().filter(|result| result.recording == "scribble").collect();
    if grown.len() < 2 {
        return Vec::new();
    }
    for row in grown.iter().flat_map(|result| &result.rows) {
        if !names.contains(&row.index.as_str()) {
            names.push(&row.index);
        }
    }
    names.sort_by_key(|name| *name != reference);
    let figures = [
        ("nearest hit, rays from inside", "rays a second", Figure::RaysASecond(1)),
        ("any hit, rays from inside", "rays a second", Figure::RaysASecond(2)),
        ("what is in a box", "µs", Figure::Micros(3)),
        ("the nearest polygons of a point", "µs", Figure::Micros(4)),
        ("a frame that inserts 8 polygons and casts 8 rays", "µs", Figure::Micros(5)),
        ("boxes that a ray tests, walked in order", "boxes a ray", Figure::BoxesARay),
    ];
    let by_size = figures.into_iter().map(|(title, unit, figure)| {
        let line = |name: &&str| {
            let points = grown.iter().filter_map(|result| {
                let row = result.rows.iter().find(|row| row.index == **name)?;
                Some((result.polygons as f64, figure.of(row)))
            });
            Line::of_structure(name, points.collect())
        };
        Chart {
            title: format!("Rays, ranges and neighbours: {title}"),
            remarks: grown.iter().filter_map(|result| figure.remark(result, reference)).collect(),
            x: Axis::Log("polygons"),
            y: Axis::Log(unit),
            lines: names.iter().map(line).collect(),
        }
    });
    by_size.collect()
}

/// Box tests of a ray against moves.
pub(in crate::bench) fn decay(result: &RaysResult) -> Chart {
    type Figure = fn(&MovedRow) -> f64;
    let line = |name: &str, style: LineStyle, value: Figure| {
        Line::new(name, style, result.moved.iter().map(|row| (row.moved_share * 100.0, value(row))).collect())
    };
    let remark = result.moved.last().map(|last| {
        format!(
            "When every polygon is {:.0} % of the diagonal from where it was, a ray tests {} boxes in the refitted tree and {} \
             in one that was rebuilt.",
            last.moved_share * 100.0,
            short(last.refitted),
            short(last.rebuilt)
        )
    });
    let name = format!("{}, {} polygons", result.recording, thousands(result.polygons as u64));
    Chart {
        title: format!("{name}: refit against rebuild as polygons move"),
        remarks: remark.into_iter().collect(),
        x: Axis::Linear("moved, % of the model's diagonal"),
        y: Axis::Log("boxes a ray"),
        lines: vec![
            line("osp", LineStyle::of_structure("osp"), |row| row.osp),
            line("SAH, refitted", LineStyle::plain(VERMILION), |row| row.refitted),
            line("SAH, rebuilt", LineStyle::plain(GREEN), |row| row.rebuilt),
            line("bvh-sah", LineStyle::plain(ORANGE), |row| row.bvh_sah),
            line("dynamic-bvh", LineStyle::of_structure("dynamic-bvh"), |row| row.dynamic_bvh),
        ],
    }
}

/// The figures, one a line.
pub(in crate::bench) fn csv(results: &[RaysResult], lines: &mut Lines) {
    for result in results {
        let name = result.recording.replace('"', "\"\"");
        for row in &result.rows {
            let of = format!("rays,\"{name}\",{},{},{}", row.index, result.polygons, row.inside.us.values);
            let asked: [(&str, &str, &Asked); 6] = [
                ("nearest_outside", "us/ray", &row.outside),
                ("nearest_inside", "us/ray", &row.inside),
                ("any_inside", "us/ray", &row.any),
                ("box", "us", &row.range),
                ("neighbours", "us", &row.neighbours),
                ("growing", "us/frame", &row.growing),
            ];
            for (figure, unit, asked) in asked {
                lines.estimate(&of, figure, unit, &asked.us);
                lines.estimate(&of, &format!("{figure}_reference"), unit, &asked.reference_us);
                lines.estimate(&of, &format!("{figure}_ratio"), "", &asked.ratio);
                lines.value(&of, &format!("{figure}_polygons_asked"), "polygons", asked.polygons_asked);
            }
            for (order, walked) in [("in_order", &row.in_order), ("best_first", &row.best_first)] {
                lines.value(&of, &format!("{order}_nodes"), "1/ray", walked.nodes);
                lines.value(&of, &format!("{order}_boxes"), "1/ray", walked.boxes);
                lines.value(&of, &format!("{order}_polygons_asked"), "1/ray", walked.polygons_asked);
                lines.value(&of, &format!("{order}_rays"), "million/s", walked.mrays_per_sec);
            }
            for (query, [nodes, boxes]) in [("box", row.range_work), ("neighbours", row.neighbours_work)] {
                lines.value(&of, &format!("{query}_nodes"), "1/query", nodes);
                lines.value(&of, &format!("{query}_boxes"), "1/query", boxes);
            }
        }
        for row in &result.moved {
            let trees = [
                ("sah-refitted", row.refitted),
                ("sah-rebuilt", row.rebuilt),
                ("bvh-sah", row.bvh_sah),
                ("dynamic-bvh", row.dynamic_bvh),
                ("osp", row.osp),
            ];
            for (index, boxes) in trees {
                let of = format!("rays_moved,\"{name}\",{index},{},1", result.polygons);
                lines.value(&of, &format!("boxes_after_{}_moves", row.moves), "1/ray", boxes);
            }
        }
    }
}
