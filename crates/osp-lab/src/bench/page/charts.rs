//! The charts of the page: curves over a session, and curves over the sizes of the synthetic model. The page's script
//! draws them.

use serde::Serialize;

use crate::{
    bench::{BenchReport, curves::SYNTHETIC},
    report::{LineStyle, one_line},
    rows::{RIVAL, Table, distinct},
};

/// Number of significant digits of values; more digits would be invisible.
const DIGITS: usize = 5;
/// Number of curves that are visible at first, besides those of the reference and of [`RIVAL`].
const SHOWN: usize = 6;
/// Figures that get a chart over the sizes.
const FIGURES: [(&str, &str); 3] =
    [("time", "µs"), ("boxes", "boxes a query or frame"), ("memory", "bytes a polygon")];

#[derive(Default, Serialize)]
pub(super) struct Charts {
    charts: Vec<ChartData>,
}

#[derive(Serialize)]
struct ChartData {
    id: String,
    #[serde(flatten)]
    chart: Chart,
}

#[derive(Serialize)]
pub(super) struct Chart {
    x: Axis,
    y: Axis,
    pub(super) lines: Vec<Line>,
}

#[derive(Serialize)]
struct Axis {
    name: &'static str,
    log: bool,
}

#[derive(Serialize)]
pub(super) struct Line {
    pub(super) name: String,
    /// Name of the colour's variable in the style sheet.
    pub(super) color: &'static str,
    /// The mark on the curve, a character; empty for none.
    pub(super) mark: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) dash: Option<(u32, u32)>,
    /// Whether the curve is visible at first.
    on: bool,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Charts {
    pub(super) fn is_empty(&self) -> bool {
        self.charts.is_empty()
    }

    pub(super) fn add(&mut self, id: String, chart: Chart) {
        self.charts.push(ChartData { id, chart });
    }

    /// The data as JSON for a `script` element; characters that HTML would interpret are escaped.
    pub(super) fn to_json(&self) -> String {
        let json = serde_json::to_string(self).unwrap_or_else(|_| "{\"charts\":[]}".to_owned());
        json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }
}

pub(super) fn of(report: &BenchReport, part: &str, tables: &[&Table<'_>]) -> Vec<(String, Chart)> {
    let curves = report.rows.curves.iter().filter(|curves| curves.part == part);
    let mut charts: Vec<(String, Chart)> = curves
        .map(|curves| {
            let lines = curves.lines.clone();
            let x = Axis { name: curves.x, log: false };
            (
                curves.title.clone(),
                Chart { x, y: Axis { name: curves.y, log: true }, lines: styled(report, lines) },
            )
        })
        .collect();
    let size_of = |table: &Table<'_>| table.recording.strip_prefix(SYNTHETIC)?.parse::<f64>().ok();
    let synthetic: Vec<_> = tables.iter().filter_map(|table| Some((table, size_of(table)?))).collect();
    for task in distinct(synthetic.iter().map(|(table, _)| table.part)) {
        for (figure, unit) in FIGURES {
            let mut lines: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
            for &(table, size) in synthetic.iter().filter(|(table, _)| table.part == task) {
                for index in table.indexes() {
                    let Some(value) = table.value(index, figure) else { continue };
                    match lines.iter_mut().find(|(name, _)| name == index) {
                        Some((_, points)) => points.push((size, value)),
                        None => lines.push((index.to_owned(), vec![(size, value)])),
                    }
                }
            }
            // A single size gives no curve.
            if lines.iter().any(|(_, points)| points.len() > 1) {
                let x = Axis { name: "polygons", log: true };
                let chart = Chart { x, y: Axis { name: unit, log: true }, lines: styled(report, lines) };
                charts.push((format!("{task}: {figure}"), chart));
            }
        }
    }
    charts.retain(|(_, chart)| !chart.lines.is_empty());
    charts
}

/// The curves with their styles: the curve of the reference, then the others, sorted by their last value.
fn styled(report: &BenchReport, mut lines: Vec<(String, Vec<(f64, f64)>)>) -> Vec<Line> {
    lines.retain(|(_, points)| !points.is_empty());
    let end = |points: &[(f64, f64)]| points.last().map_or(0.0, |point| point.1);
    lines.sort_by(|(a, of), (b, against)| {
        (*a != report.reference).cmp(&(*b != report.reference)).then(end(of).total_cmp(&end(against)))
    });
    let line = |(at, (name, mut points)): (usize, (String, Vec<(f64, f64)>))| {
        points.retain(|(x, y)| x.is_finite() && y.is_finite());
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let style = LineStyle::of_any(&name, at);
        Line {
            color: style.css_name(),
            mark: style.mark_character(),
            dash: style.dash,
            on: at <= SHOWN || name == RIVAL,
            name: one_line(&name).into_owned(),
            x: points.iter().map(|point| rounded(point.0)).collect(),
            y: points.iter().map(|point| rounded(point.1)).collect(),
        }
    };
    lines.into_iter().enumerate().map(line).collect()
}

fn rounded(value: f64) -> f64 {
    // A formatted number always parses.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}
