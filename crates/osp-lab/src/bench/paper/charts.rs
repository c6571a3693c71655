use super::{
    FlightRow, GrowingRow, PaperResult,
    flight::FRUSTUM,
    growing::{GrowingFrame, STILL},
};
use crate::{
    bench::charts::{Axis, Chart, Line, Points, grouped},
    report::{GREEN, INK, LineStyle, ORANGE, PURPLE, SKY, VERMILION, short, thousands},
};

/// Ways of the flight that have a line, and how it looks: the others are in the table.
const FLOWN: [(&str, LineStyle); 6] = [
    ("no culling", LineStyle::plain(INK)),
    ("paper, frustum", LineStyle::plain(VERMILION)),
    ("paper, msvbsp-paper, sphere", LineStyle::plain(PURPLE)),
    (FRUSTUM, LineStyle::plain(ORANGE)),
    ("osp, msvbsp", LineStyle::plain(GREEN)),
    ("osp, hzb", LineStyle::plain(SKY)),
];

/// The charts of a session.
pub(in crate::bench) fn charts(result: &PaperResult) -> Vec<Chart> {
    let mut charts = Vec::new();
    let mut parts: Vec<&str> = Vec::new();
    for row in result.growing.iter().filter(|row| row.part != STILL) {
        if !parts.contains(&row.part) {
            parts.push(row.part);
        }
    }
    charts.extend(parts.iter().map(|part| growing(result, part)));
    charts.extend(flight(result));
    charts.extend(cubes(result));
    charts.retain(|chart| !chart.is_empty());
    charts
}

/// Frames a second where something was drawn, else microseconds.
fn figure(draws: bool) -> (&'static str, impl Fn(u64) -> f64) {
    let name = if draws { "frames a second" } else { "µs a frame (nothing is drawn)" };
    let value = move |ns: u64| if draws { 1.0e9 / ns.max(1) as f64 } else { ns as f64 / 1000.0 };
    (name, value)
}

/// An axis from zero, as in the paper, unless the lines then lie on the ground.
fn axis(name: &'static str, lines: &[Line]) -> Axis {
    let values = || lines.iter().flat_map(|line| line.points.iter().map(|&(_, y)| y));
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
    if high > 30.0 * low { Axis::Log(name) } else { Axis::Linear(name) }
}

/// A point for each stretch of frames that was measured: its median. The frames themselves, where all were measured.
fn points(frames: &[GrowingFrame], value: impl Fn(u64) -> f64) -> Points {
    let point = |frame: &GrowingFrame| (frame.frame as f64, value(frame.total_ns()));
    let mut stretches: Vec<Vec<(f64, f64)>> = frames
        .chunk_by(|a, b| a.frame + 1 == b.frame)
        .map(|stretch| stretch.iter().map(point).collect())
        .collect();
    match &mut stretches[..] {
        [] => Points::new(),
        [all] => grouped(all).0,
        stretches => {
            let middle = |stretch: &mut Vec<(f64, f64)>| {
                stretch.sort_unstable_by(|a, b| a.1.total_cmp(&b.1));
                (stretch[0].0, stretch[stretch.len() / 2].1)
            };
            stretches.iter_mut().map(middle).collect()
        }
    }
}

fn growing(result: &PaperResult, part: &str) -> Chart {
    let (name, value) = figure(result.drawn_by.is_some());
    let rows: Vec<&GrowingRow> = result.growing.iter().filter(|row| row.part == part).collect();
    let lines: Vec<Line> =
        rows.iter().map(|row| Line::of_structure(row.tree, points(&row.frames, &value))).collect();
    let paper = match part {
        "whole session" => {
            "The paper (Fig. 19): where nothing is inserted the octree is faster; wherever something is, it falls far below \
             the OSP tree."
        }
        "up to 1,000 polygons" => {
            "The paper (Fig. 21): with few polygons both are fast enough; the octree dips a little at insertions."
        }
        "1,000 to 10,000" => {
            "The paper (Fig. 22): the octree is rebuilt for each polygon until modelling stutters; the OSP tree slows only as \
             drawing does."
        }
        _ => {
            "The paper (Fig. 23): the octree stands still at every insertion; the OSP tree slows only as drawing does."
        }
    };
    let mut remarks = vec![paper.to_owned()];
    remarks.extend(compared(&rows).map(|words| format!("Here {words}")));
    if part == "whole session" {
        let still: Vec<&GrowingRow> = result.growing.iter().filter(|row| row.part == STILL).collect();
        remarks.extend(compared(&still).map(|words| format!("In frames that insert nothing {words}")));
    }
    Chart {
        title: format!("{}, {part}: the OSP tree and the octree", result.recording),
        remarks,
        x: Axis::Linear("frame"),
        y: axis(name, &lines),
        lines,
    }
}

/// The OSP tree and the octree, both as printed, in a sentence.
fn compared(rows: &[&GrowingRow]) -> Option<String> {
    let of = |tree: &str| rows.iter().find(|row| row.tree == tree);
    let (osp, octree) = (of("osp-paper")?, of("octree-paper")?);
    let (osp_us, octree_us) = (osp.frame_us.median, octree.frame_us.median);
    let words = if osp_us < octree_us { "osp-paper is ahead" } else { "octree-paper is ahead" };
    let apart = |row: &GrowingRow| {
        let share = |ns: fn(&GrowingFrame) -> u64| {
            let all: u64 = row.frames.iter().map(GrowingFrame::total_ns).sum();
            100.0 * row.frames.iter().map(ns).sum::<u64>() as f64 / all.max(1) as f64
        };
        match row.draw_us {
            Some(_) => format!(
                "{} % filing, {} % culling, {} % drawing",
                short(share(|frame| frame.insert_ns)),
                short(share(|frame| frame.cull_ns)),
                short(share(|frame| frame.draw_ns))
            ),
            None => format!(
                "{} % filing, {} % culling",
                short(share(|frame| frame.insert_ns)),
                short(share(|frame| frame.cull_ns))
            ),
        }
    };
    Some(format!(
        "{words}: osp-paper {} µs a frame ({}), octree-paper {} µs ({}); medians, shares of the sum of all frames.",
        short(osp_us),
        apart(osp),
        short(octree_us),
        apart(octree)
    ))
}

fn flight(result: &PaperResult) -> Vec<Chart> {
    let shown = |value: &dyn Fn(&FlightRow) -> Points| -> Vec<Line> {
        let line = |&(way, style): &(&str, LineStyle)| {
            let row = result.flight.iter().find(|row| row.way == way)?;
            let name = match row.not_conservative {
                Some(_) => format!("{way} (not conservative)"),
                None => way.to_owned(),
            };
            Some(Line::new(&name, style, value(row)))
        };
        FLOWN.iter().filter_map(line).collect()
    };
    let (name, value) = figure(result.drawn_by.is_some());
    let series = |value: &dyn Fn(&super::flight::FlownFrame) -> f64, row: &FlightRow| {
        let points: Vec<(f64, f64)> =
            row.frames.iter().enumerate().map(|(i, frame)| (i as f64, value(frame))).collect();
        grouped(&points).0
    };
    let fastest = result
        .flight
        .iter()
        .filter(|row| row.not_conservative.is_none())
        .min_by(|a, b| a.frame_us.median.total_cmp(&b.frame_us.median));
    let mut remarks = vec![
        "The paper (Fig. 20): frustum culling gains where polygons are out of view; with occlusion culling nearly all of the \
         flight is faster, and parts are slower, where computing takes longer than drawing what it saves."
            .to_owned(),
    ];
    remarks.extend(fastest.map(|row| {
        format!(
            "Here the fastest that culls nothing visible is {}: {} µs a frame (median), slower than frustum culling alone in \
             {} % of the frames.",
            row.way,
            short(row.frame_us.median),
            short(row.slower_percent)
        )
    }));
    let wrong = result.flight.iter().filter(|row| row.wrong.is_some_and(|wrong| wrong > 0));
    remarks.extend(wrong.map(|row| {
        format!(
            "{} culled {} visible polygons in the frames that were verified.",
            row.way,
            thousands(row.wrong.unwrap_or(0))
        )
    }));
    let lines = shown(&|row| series(&|frame| value(frame.total_ns()), row));
    vec![
        Chart {
            title: format!("{}, flight: culling (Fig. 20)", result.recording),
            remarks,
            x: Axis::Linear("frame"),
            y: axis(name, &lines),
            lines,
        },
        Chart {
            title: format!("{}, flight: polygons handed to the renderer", result.recording),
            remarks: handed_over(result),
            x: Axis::Linear("frame"),
            y: Axis::Linear("polygons a frame"),
            lines: shown(&|row| series(&|frame| frame.drawn as f64, row)),
        },
    ]
}

/// What the flight's ways hand to the renderer, mean of the frames.
fn handed_over(result: &PaperResult) -> Vec<String> {
    let drawn = FLOWN.iter().filter_map(|(way, _)| result.flight.iter().find(|row| row.way == *way));
    let means: Vec<String> = drawn.map(|row| format!("{} {}", row.way, short(row.drawn))).collect();
    let mut remarks = vec![format!("Here, mean of the frames: {}.", means.join("; "))];
    if result.flight.iter().any(|row| row.way == "osp, hzb") {
        remarks.push(
            "The hidden polygons that hzb leaves out are found while drawing, so they are handed over, too."
                .to_owned(),
        );
    }
    remarks
}

/// A sentence for each cube: a figure of its shallowest tree and of its deepest.
fn by_depth(rows: &[super::CubeRow], value: &dyn Fn(&super::CubeRow) -> f64) -> Vec<String> {
    let mut edges: Vec<f32> = Vec::new();
    for row in rows {
        if !edges.contains(&row.cube) {
            edges.push(row.cube);
        }
    }
    let sentence = |cube: f32| {
        let of_cube = || rows.iter().filter(|row| row.cube == cube);
        let (first, last) = (of_cube().min_by_key(|row| row.depth)?, of_cube().max_by_key(|row| row.depth)?);
        let least = of_cube().min_by(|a, b| value(a).total_cmp(&value(b)))?;
        Some(format!(
            "Cube x {}: {} at depth {}, {} at depth {}; least at depth {}, {}.",
            short(f64::from(cube)),
            short(value(first)),
            first.depth,
            short(value(last)),
            last.depth,
            least.depth,
            short(value(least))
        ))
    };
    edges.into_iter().filter_map(sentence).collect()
}

/// Tests and times against the depth, a line for each cube.
fn cubes(result: &PaperResult) -> Vec<Chart> {
    let colors = [INK, VERMILION, GREEN, ORANGE, PURPLE, SKY];
    let mut edges: Vec<f32> = Vec::new();
    for row in &result.cubes {
        if !edges.contains(&row.cube) {
            edges.push(row.cube);
        }
    }
    let lines = |value: &dyn Fn(&super::CubeRow) -> f64| -> Vec<Line> {
        let line = |(number, &cube): (usize, &f32)| {
            let rows = result.cubes.iter().filter(|row| row.cube == cube);
            let mut points: Points = rows.map(|row| (f64::from(row.depth), value(row))).collect();
            points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let style = LineStyle::plain(colors[number % colors.len()]);
            Line::new(&format!("cube x {}", short(f64::from(cube))), style, points)
        };
        edges.iter().enumerate().map(line).collect()
    };
    type Value<'a> = &'a dyn Fn(&super::CubeRow) -> f64;
    let chart = |what: &str, unit: &'static str, about: &str, value: Value<'_>| {
        let lines = lines(value);
        Chart {
            title: format!("{}: {what} against the tree's depth", result.recording),
            remarks: [about.to_owned()].into_iter().chain(by_depth(&result.cubes, value)).collect(),
            x: Axis::Linear("depth, binary levels"),
            y: axis(unit, &lines),
            lines,
        }
    };
    vec![
        chart("boxes tested", "boxes a frame", "The paper gives no depth and no size.", &|row| row.tests),
        chart(
            "time of culling",
            "µs a frame",
            "The paper (section 5): the tree is inefficient where the polygons fill far less of the space than it has.",
            &|row| row.cull_us.median,
        ),
        chart(
            "over-draw",
            "polygons drawn for each in view",
            "As in Fig. 6 all polygons of a cut node are drawn.",
            &|row| row.drawn / row.in_view.max(1.0),
        ),
    ]
}
