//! The charts of the page: lines along a session, and lines over the sizes of the synthetic model. The script draws them.

use serde::Serialize;

use crate::{
    bench::{BenchReport, curves::SYNTHETIC},
    report::{LineStyle, one_line},
    rows::{RIVAL, Table, distinct},
};

/// Significant digits of the numbers: more cannot be seen.
const DIGITS: usize = 5;
/// Lines that are seen from the start, besides the reference and the paper's rival.
const SHOWN: usize = 5;
/// Figures of which a chart over the sizes is made.
const FIGURES: [(&str, &str); 3] =
    [("time", "µs"), ("boxes", "boxes a question or frame"), ("memory", "bytes a polygon")];

/// The data of all charts of a page.
#[derive(Default, Serialize)]
pub(super) struct Charts {
    charts: Vec<ChartData>,
}

#[derive(Serialize)]
struct ChartData {
    /// Id of the figure in the page.
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
    /// Name of the colour in the style sheet.
    pub(super) color: &'static str,
    /// A character, if the line bears a mark.
    pub(super) mark: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) dash: Option<(u32, u32)>,
    /// Whether it is seen from the start.
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

    /// The data as JSON that may stand in a `script` element: no character of it is a command to the page.
    pub(super) fn to_json(&self) -> String {
        let json = serde_json::to_string(self).unwrap_or_else(|_| "{\"charts\":[]}".to_owned());
        json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }
}

/// The charts of a part, with their titles.
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
            // One size makes no line.
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

/// The lines with their looks: the reference first, then those that end lowest.
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
            dash: style.dash(),
            on: at <= SHOWN || name == RIVAL,
            name: one_line(&name).into_owned(),
            x: points.iter().map(|point| rounded(point.0)).collect(),
            y: points.iter().map(|point| rounded(point.1)).collect(),
        }
    };
    lines.into_iter().enumerate().map(line).collect()
}

fn rounded(value: f64) -> f64 {
    // A number that is written can be read.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bench::Machine,
        rows::{Curves, Rows},
    };

    #[test]
    fn sizes_make_lines_and_names_are_no_commands() {
        let mut rows = Rows::default();
        for (size, us) in [(1000, 123.456_789), (2000, 2.0)] {
            rows.of("growth", format!("{SYNTHETIC}{size}"), "osp").against(&[(us, us)]);
        }
        let name = "</script><b>&\u{202e}".to_owned();
        let title = "curves".to_owned();
        let lines = vec![(name, vec![(1.0, 1.0)]), ("none".to_owned(), Vec::new())];
        rows.curves.push(Curves { part: "growth", title, x: "frame", y: "µs", lines });
        let (machine, reference) = (Machine::here(None), "osp".to_owned());
        let report = BenchReport { machine, command: String::new(), reference, rows };
        let tables = report.rows.tables();
        let found = of(&report, "growth", &tables.iter().collect::<Vec<_>>());
        let titles: Vec<&str> = found.iter().map(|(title, _)| title.as_str()).collect();
        assert_eq!(titles, ["curves", "growth: time"]);
        let mut charts = Charts::default();
        found.into_iter().for_each(|(title, chart)| charts.add(title, chart));
        let json = charts.to_json();
        assert!(!json.contains(['<', '>', '&', '\u{202e}']), "{json}");
        let data: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(data["charts"][0]["lines"].as_array().map(Vec::len), Some(1), "a line without points");
        assert_eq!(data["charts"][1]["lines"][0]["y"], serde_json::json!([123.46, 2.0]));
        assert_eq!(data["charts"][1]["lines"][0]["x"], serde_json::json!([1000.0, 2000.0]));
    }
}
