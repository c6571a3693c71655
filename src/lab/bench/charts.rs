use std::{error::Error, fmt::Write, ops::Range};

use plotters::{
    coord::{
        Shift,
        ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    },
    prelude::*,
};

use super::{
    BenchReport, Flight, GrowthRow, SessionResult, estimate::quantile, moving, rays::show,
    session::same_frames,
};
use crate::{
    frame::FrameRecord,
    lab::report::{GREEN, INK, LineStyle, ORANGE, VERMILION, register_font, thousands},
    rivals::IndexKind,
};

/// Size of a chart, pixels.
const SIZE: (u32, u32) = (960, 420);
/// Points of a line at most: values are gathered into this many groups, of which the median is drawn.
const GROUPS: usize = 240;
/// Lines of the charts over a session, so that each can be told from the others.
const SHOWN: [IndexKind; 7] = [
    IndexKind::Osp,
    IndexKind::OctreeRebuild,
    IndexKind::OspPaper,
    IndexKind::BvhTwoLevel,
    IndexKind::DynamicBvh,
    IndexKind::BvhSah,
    IndexKind::BruteSimd,
];

/// The looks of the lines of a flight, which stand for no structure.
const NO_CULLING: LineStyle = LineStyle::plain(INK);
const FRUSTUM: LineStyle = LineStyle::plain(ORANGE);
const BOTH: LineStyle = LineStyle::plain(GREEN);

pub(super) type Points = Vec<(f64, f64)>;
type Figure = fn(&GrowthRow) -> f64;

/// A chart with the sentences that belong to it.
pub(super) struct Chart {
    pub(super) title: String,
    /// The paper's finding, and ours.
    pub(super) remarks: Vec<String>,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) lines: Vec<Line>,
}

#[derive(Clone, Copy)]
pub(super) enum Axis {
    Linear(&'static str),
    Log(&'static str),
}

pub(super) struct Line {
    name: String,
    style: LineStyle,
    /// Points of the line, and of a thin line beside it (the slowest frame of each group).
    pub(super) points: Points,
    thin: Points,
}

impl Line {
    /// The line of a structure.
    pub(super) fn of_structure(name: &str, points: Points) -> Self {
        Self::new(name, LineStyle::of_structure(name), points)
    }

    pub(super) fn new(name: &str, style: LineStyle, points: Points) -> Self {
        Self { name: name.to_owned(), style, points, thin: Vec::new() }
    }
}

/// The charts of a report, in the order of the page.
pub(super) fn charts(report: &BenchReport) -> Vec<Chart> {
    let sessions = report.sessions.iter().flat_map(|session| {
        let parts = [
            ("fewer than 1,000", 0..1000),
            ("1,000 to 10,000", 1000..10_000),
            ("over 10,000", 10_000..u64::MAX),
        ];
        let by_size = parts.map(|(name, polygons)| frames_per_second(session, Some((name, polygons))));
        [Some(frames_per_second(session, None))]
            .into_iter()
            .chain(by_size.map(Some))
            .chain([Some(insertion(session))])
            .flatten()
    });
    let growth = growth(&report.growth, &report.reference);
    let flights = report.flights.iter().flat_map(flight);
    let rays = show::charts(&report.rays, &report.reference);
    let moving = moving::show::charts(&report.moving, &report.reference);
    sessions
        .chain(growth)
        .chain(flights)
        .chain(rays)
        .chain(moving)
        .filter(|chart| !chart.is_empty())
        .collect()
}

/// The middle of neighbouring values, with the slowest beside it.
pub(super) fn grouped(values: &[(f64, f64)]) -> (Points, Points) {
    let group = |chunk: &[(f64, f64)]| {
        let mut sorted: Vec<f64> = chunk.iter().map(|&(_, y)| y).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let x = chunk[chunk.len() / 2].0;
        ((x, quantile(&sorted, 0.5)), (x, quantile(&sorted, 1.0)))
    };
    values.chunks(values.len().div_ceil(GROUPS).max(1)).map(group).unzip()
}

/// The frames measured of an index; none if it is not in the session.
fn records_of(session: &SessionResult, kind: IndexKind) -> &[FrameRecord] {
    let at = session.rows.iter().position(|row| row.index == kind.name());
    at.map_or(&[], |at| &session.records[at])
}

/// A line for each index that is shown and that has values.
fn session_lines(
    session: &SessionResult,
    kinds: &[IndexKind],
    value: impl Fn(&FrameRecord) -> Option<(f64, f64)>,
) -> Vec<(Line, Vec<f64>)> {
    let mut lines = Vec::new();
    for kind in kinds {
        let values: Vec<(f64, f64)> = records_of(session, *kind).iter().filter_map(&value).collect();
        if !values.is_empty() {
            let (points, thin) = grouped(&values);
            let mut sorted: Vec<f64> = values.iter().map(|&(_, y)| y).collect();
            sorted.sort_unstable_by(f64::total_cmp);
            lines.push((Line { thin, ..Line::of_structure(kind.name(), points) }, sorted));
        }
    }
    lines
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
    let lines = session_lines(session, &kinds, |record| {
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
    Chart {
        title: format!("{}, {name}: frames a second", session.recording),
        remarks,
        x: Axis::Linear("frame"),
        y: Axis::Log("insertion and culling, frames a second"),
        lines: lines
            .into_iter()
            // The fastest of a group says nothing about stuttering.
            .map(|(line, _)| Line { thin: Vec::new(), ..line })
            .collect(),
    }
}

/// Insertion over the session.
fn insertion(session: &SessionResult) -> Chart {
    let lines = session_lines(session, &SHOWN, |record| {
        let us = record.insert.ns as f64 / 1000.0;
        (record.inserted > 0).then_some((record.polygons as f64, us))
    });
    let best = lines
        .iter()
        .filter(|(line, _)| line.name != "osp")
        .min_by(|(_, a), (_, b)| quantile(a, 0.99).total_cmp(&quantile(b, 0.99)));
    let mut remarks = vec![
        "The paper: building the OSP tree takes the same time however many polygons there are; the octree's grows with \
         them."
            .to_owned(),
    ];
    if let (Some((_, osp)), Some((other, times))) = (lines.iter().find(|(line, _)| line.name == "osp"), best)
    {
        let [p50, p99, max] = [0.5, 0.99, 1.0].map(|q| quantile(osp, q));
        let behind = quantile(times, 0.99) < p99;
        remarks.push(format!(
            "Here: osp {p50:.2} µs at 50 %, {p99:.2} at 99 %, {max:.1} at most; the best of the others at 99 % is {} with \
             {:.2} µs{}.",
            other.name,
            quantile(times, 0.99),
            if behind { ": osp LOSES there" } else { "" }
        ));
    }
    Chart {
        title: format!("{}: inserting what a frame brings", session.recording),
        remarks,
        x: Axis::Linear("polygons"),
        y: Axis::Log("µs (thin: slowest)"),
        lines: lines.into_iter().map(|(line, _)| line).collect(),
    }
}

fn growth(rows: &[GrowthRow], reference: &str) -> Vec<Chart> {
    let in_place = [
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
    let mut charts = Vec::new();
    let mut names: Vec<&str> = rows.iter().map(|row| row.index.as_str()).collect();
    let mut seen = Vec::new();
    names.retain(|name| !seen.contains(name) && (seen.push(*name), true).1);
    names.sort_by_key(|name| *name != reference);
    let sizes: Vec<u32> = rows.iter().map(|row| row.polygons).collect();
    let figures: [(&str, &str, Figure); 4] = [
        ("a frame that inserts and culls", "µs", |row| row.frame_us.median),
        ("a frame that inserts nothing, from inside", "µs", |row| row.still_us.median),
        ("a frame that inserts nothing, all in view", "µs", |row| row.still_all_us.median),
        ("memory", "bytes a polygon", |row| row.bytes_per_polygon),
    ];
    for (title, unit, value) in figures {
        for (group, grows) in
            [("structures that grow in place", true), ("structures that are rebuilt", false)]
        {
            let mut lines = Vec::new();
            for name in names.iter().filter(|name| **name == reference || in_place.contains(name) == grows) {
                let points = rows
                    .iter()
                    .filter(|row| row.index == **name)
                    .map(|row| (f64::from(row.polygons), value(row)))
                    .collect();
                lines.push(Line::of_structure(name, points));
            }
            charts.push(Chart {
                title: format!("{title}: {group}"),
                remarks: ahead(rows, &sizes, reference, value),
                x: Axis::Log("polygons"),
                y: Axis::Log(unit),
                lines,
            });
        }
    }
    charts
}

/// At each size: how far the reference is ahead of the best of the others, or behind it.
fn ahead(rows: &[GrowthRow], sizes: &[u32], reference: &str, value: Figure) -> Vec<String> {
    let mut sizes = sizes.to_vec();
    sizes.sort_unstable();
    sizes.dedup();
    let line = |size: u32| {
        let at = |row: &&GrowthRow| row.polygons == size;
        let mine = rows.iter().filter(at).find(|row| row.index == reference)?;
        let best = rows
            .iter()
            .filter(at)
            .filter(|row| row.index != reference)
            .min_by(|a, b| value(a).total_cmp(&value(b)))?;
        let ratio = value(best) / value(mine).max(f64::MIN_POSITIVE);
        let words = if ratio >= 1.0 { "ahead of" } else { "BEHIND" };
        Some(format!(
            "{} polygons: {reference} {:.2}, {words} {} {:.2} ({ratio:.2} times)",
            thousands(u64::from(size)),
            value(mine),
            best.index,
            value(best)
        ))
    };
    sizes.into_iter().filter_map(line).collect()
}

/// The paper's figure 20, and where culling by occlusion pays.
fn flight(flight: &Flight) -> Vec<Chart> {
    let series = |value: &dyn Fn(usize) -> f64| {
        let values: Vec<(f64, f64)> = (0..flight.frames.len()).map(|i| (i as f64, value(i))).collect();
        grouped(&values).0
    };
    let frames = &flight.frames;
    let us = |ns: u64| ns as f64 / 1000.0;
    let title = |what: &str| format!("{}, flight ({}): {what}", flight.recording, flight.camera);
    let slower = frames.iter().filter(|frame| frame.both_ns > frame.frustum_ns).count();
    let paper = "The paper (figure 20): frustum culling gains where polygons are out of view; with occlusion culling nearly all \
                 of the flight is faster, but parts are slower, because what is computed exceeds what is saved.";
    let break_even = match flight.break_even_ns_per_polygon {
        Some(ns) => format!(
            "Here: occlusion culling saves {:.1} polygons a frame and costs {:.1} µs; it pays where drawing a polygon costs \
             more than {ns:.1} ns.",
            flight.in_view - flight.drawn,
            flight.both_us.median - flight.frustum_us.median
        ),
        None => "Here: nothing in view is hidden by the chosen occluders; occlusion culling cannot pay."
            .to_owned(),
    };
    let saved = |frame: &super::FlightFrame| {
        let saved = frame.in_view.saturating_sub(frame.drawn);
        // Below a tenth of a nanosecond it pays whatever is drawn.
        (saved > 0).then(|| (frame.both_ns.saturating_sub(frame.frustum_ns) as f64 / saved as f64).max(0.1))
    };
    vec![
        Chart {
            title: title("polygons to draw"),
            remarks: vec![paper.to_owned(), break_even],
            x: Axis::Linear("frame"),
            y: Axis::Linear("polygons a frame"),
            lines: vec![
                Line::new("no culling", NO_CULLING, series(&|_| flight.polygons as f64)),
                Line::new("frustum", FRUSTUM, series(&|i| frames[i].in_view as f64)),
                Line::new("frustum and occlusion", BOTH, series(&|i| frames[i].drawn as f64)),
            ],
        },
        Chart {
            title: title("time of culling"),
            remarks: vec![format!("Culling by both took longer in {slower} of {} frames.", frames.len())],
            x: Axis::Linear("frame"),
            y: Axis::Log("µs"),
            lines: vec![
                Line::new("frustum", FRUSTUM, series(&|i| us(frames[i].frustum_ns))),
                Line::new("frustum and occlusion", BOTH, series(&|i| us(frames[i].both_ns))),
            ],
        },
        Chart {
            title: title("break-even of occlusion culling"),
            remarks: vec![
                "Above the line occlusion culling pays: there drawing a polygon costs more than it."
                    .to_owned(),
            ],
            x: Axis::Linear("frame"),
            y: Axis::Log("ns for drawing a polygon"),
            lines: vec![Line::new(
                "break-even",
                LineStyle::plain(VERMILION),
                frames.iter().enumerate().filter_map(|(i, frame)| Some((i as f64, saved(frame)?))).collect(),
            )],
        },
    ]
}

impl Chart {
    pub(super) fn is_empty(&self) -> bool {
        self.lines.iter().all(|line| line.points.is_empty())
    }

    /// Names and looks of the lines.
    pub(super) fn legend(&self) -> impl Iterator<Item = (&str, LineStyle)> {
        let drawn = self.lines.iter().filter(|line| !line.points.is_empty());
        drawn.map(|line| (line.name.as_str(), line.style))
    }

    /// The picture.
    ///
    /// # Errors
    /// It cannot be drawn.
    pub(super) fn svg(&self) -> Result<String, Box<dyn Error>> {
        register_font();
        let mut svg = String::new();
        let points = || self.lines.iter().flat_map(|line| line.points.iter().chain(&line.thin));
        let (x, y) = (self.x.range(points().map(|p| p.0)), self.y.range(points().map(|p| p.1)));
        {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            match (self.x, self.y) {
                (Axis::Linear(_), Axis::Linear(_)) => self.draw(&area, x, y)?,
                (Axis::Linear(_), Axis::Log(_)) => self.draw(&area, x, y.log_scale())?,
                (Axis::Log(_), Axis::Linear(_)) => self.draw(&area, x.log_scale(), y)?,
                (Axis::Log(_), Axis::Log(_)) => self.draw(&area, x.log_scale(), y.log_scale())?,
            }
            area.present()?;
        }
        Ok(svg)
    }

    fn draw<X, Y>(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, x: X, y: Y) -> Result<(), Box<dyn Error>>
    where
        X: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(28)
            .x_label_area_size(44)
            .y_label_area_size(92)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(RGBColor(244, 244, 244))
            .bold_line_style(RGBColor(222, 222, 222))
            .x_desc(self.x.name())
            .y_desc(self.y.name())
            .x_label_formatter(&|v| self.x.label(*v))
            .y_label_formatter(&|v| self.y.label(*v))
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 16))
            .draw()?;
        for line in &self.lines {
            chart.draw_series(LineSeries::new(line.thin.iter().copied(), line.style.faint()))?;
        }
        // The first line lies on top.
        for line in self.lines.iter().rev() {
            line.style.draw(&mut chart, &line.points, 2)?;
        }
        Ok(())
    }
}

impl Axis {
    fn name(self) -> &'static str {
        match self {
            Self::Linear(name) | Self::Log(name) => name,
        }
    }

    /// What stands beside a line of the mesh. Of the numbers of a decade 1, 2 and 5: nine do not fit on a short axis.
    fn label(self, value: f64) -> String {
        let decade = 10f64.powf(value.abs().log10().floor());
        let digit = (value.abs() / decade).round() as u32;
        match self {
            Self::Log(_) if !matches!(digit, 1 | 2 | 5 | 10) => String::new(),
            _ => tick(value),
        }
    }

    /// A range in which all values lie, never empty.
    fn range(self, values: impl Iterator<Item = f64>) -> Range<f64> {
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return 1.0..10.0;
        }
        match self {
            Self::Linear(name) if name == "frame" || name == "polygons" && low > 0.0 => {
                low..high.max(low + 1.0)
            }
            Self::Linear(_) => low.min(0.0)..(high * 1.05).max(low + 1.0),
            Self::Log(_) => {
                let low = low.max(1.0e-3);
                let (from, to) = (low / 1.4, high.max(low) * 1.4);
                let (first, last) = (from.log10().ceil(), to.log10().floor());
                // Powers of ten have labels; there should be two at least.
                if last > first { from..to } else { 10f64.powf(first - 1.0)..10f64.powf(last + 1.0) }
            }
        }
    }
}

/// A number short enough for an axis: 1,500 as 1.5 k.
fn tick(value: f64) -> String {
    let mut text = String::new();
    let (scaled, suffix) = match value.abs() {
        v if v >= 1.0e6 => (value / 1.0e6, " M"),
        v if v >= 1.0e3 => (value / 1.0e3, " k"),
        _ => (value, ""),
    };
    // Three significant digits, without trailing zeros; writing to a string does not fail.
    let rounded = format!("{scaled:.2}");
    let short =
        if rounded.contains('.') { rounded.trim_end_matches('0').trim_end_matches('.') } else { &rounded };
    let _ = write!(text, "{short}{suffix}");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decade_has_three_labels() {
        let labels =
            |axis: Axis, scale: f64| (1..=10).map(|i| axis.label(f64::from(i) * scale)).collect::<Vec<_>>();
        assert_eq!(labels(Axis::Log("µs"), 1.0e3), ["1 k", "2 k", "", "", "5 k", "", "", "", "", "10 k"]);
        assert_eq!(labels(Axis::Log("µs"), 0.1), ["0.1", "0.2", "", "", "0.5", "", "", "", "", "1"]);
        assert!(labels(Axis::Linear("frame"), 1.0e3).iter().all(|label| !label.is_empty()));
        assert_eq!(Axis::Linear("frame").label(0.0), "0");
    }

    #[test]
    fn an_axis_has_labels() {
        for (low, high) in
            [(18.0, 35.0), (9.0, 11.0), (5.0, 5.0), (0.2, 4_000.0), (1.0e-9, 1.0e-9), (10.0, 10.0)]
        {
            let Range { start, end } = Axis::Log("µs").range([low, high].into_iter());
            let powers =
                (-4..9).map(|i| 10f64.powi(i) * 1.000_001).filter(|p| (start..=end * 1.000_01).contains(p));
            assert!(powers.count() >= 2, "{low} to {high}: {start} to {end}");
            assert!(start <= low.max(1.0e-3) && high <= end);
        }
    }

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
}
