use serde::Serialize;

use super::{Axis, Chart, Points};
use crate::report::one_line;

/// Significant digits of the numbers: more cannot be seen.
const DIGITS: usize = 5;

/// The data of all charts of a page, as JSON. Places along the x axis that several lines share are there once.
#[derive(Default, Serialize)]
pub(in crate::bench) struct DataSheet {
    charts: Vec<ChartData>,
    /// Places along an x axis, rising.
    xs: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct ChartData {
    /// Of the figure in the page.
    id: String,
    x: AxisData,
    y: AxisData,
    lines: Vec<LineData>,
}

#[derive(Serialize)]
struct AxisData {
    name: &'static str,
    log: bool,
}

#[derive(Serialize)]
struct LineData {
    name: String,
    /// Name of the colour in the style sheet.
    color: &'static str,
    /// A character, if the line bears a mark.
    mark: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    dash: Option<(u32, u32)>,
    /// Whether it is seen from the start.
    on: bool,
    /// Its places along the x axis: a number of a list in `xs`.
    x: usize,
    y: Vec<f64>,
    /// The thin line beside it, at the same places.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    thin: Vec<f64>,
}

impl DataSheet {
    pub(in crate::bench) fn is_empty(&self) -> bool {
        self.charts.is_empty()
    }

    /// Adds a chart that stands in the figure with this id.
    pub(in crate::bench) fn add(&mut self, id: &str, chart: &Chart) {
        let axis = |axis: Axis| AxisData { name: axis.name(), log: matches!(axis, Axis::Log(_)) };
        let lines = chart.lines.iter().filter(|line| !line.points.is_empty()).map(|line| {
            let mut points: Points =
                line.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
            let mut thin: Vec<f64> = line.thin.iter().map(|&(_, y)| rounded(y)).collect();
            if points.len() < thin.len() {
                thin.clear();
            }
            if !points.is_sorted_by(|a, b| a.0 <= b.0) {
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                thin.clear();
            }
            let x = points.iter().map(|&(x, _)| rounded(x)).collect();
            LineData {
                name: one_line(&line.name).into_owned(),
                color: line.style.css_name(),
                mark: line.style.mark_character(),
                dash: line.style.dash(),
                on: !line.is_extra,
                x: self.places(x),
                y: points.iter().map(|&(_, y)| rounded(y)).collect(),
                thin,
            }
        });
        let lines = lines.collect();
        self.charts.push(ChartData { id: id.to_owned(), x: axis(chart.x), y: axis(chart.y), lines });
    }

    fn places(&mut self, x: Vec<f64>) -> usize {
        self.xs.iter().position(|other| *other == x).unwrap_or_else(|| {
            self.xs.push(x);
            self.xs.len() - 1
        })
    }

    /// The data as JSON that may stand in a `script` element: no character of it is a command to the page.
    pub(in crate::bench) fn to_json(&self) -> String {
        let json = serde_json::to_string(self).unwrap_or_else(|_| "{\"charts\":[],\"xs\":[]}".to_owned());
        json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }
}

fn rounded(value: f64) -> f64 {
    // A number that is written can be read.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::{super::Line, *};

    #[test]
    fn places_are_shared_and_names_are_no_commands() {
        let points = vec![(1.0, 123.456_789), (2_000_000.0, 0.001_234_567)];
        let name = "</script><b>&\u{202e}";
        let lines = vec![Line::of_structure("osp", points.clone()), Line::of_structure(name, points)];
        let (x, y) = (Axis::Log("polygons"), Axis::Linear("µs"));
        let chart = Chart { title: String::new(), remarks: Vec::new(), x, y, lines };
        let mut sheet = DataSheet::default();
        assert!(sheet.is_empty());
        sheet.add("a", &chart);
        sheet.add("b", &chart);
        let json = sheet.to_json();
        assert!(!json.contains(['<', '>', '&', '\u{202e}']), "{json}");
        let data: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(data["xs"], serde_json::json!([[1.0, 2_000_000.0]]));
        assert_eq!(data["charts"][1]["lines"][0]["y"], serde_json::json!([123.46, 0.001_234_6]));
        assert_eq!(data["charts"][0]["lines"][1]["name"], "</script><b>&\\u202e");
    }
}
