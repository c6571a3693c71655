//! Measurements of the benchmarks as long-format rows: each row is one figure of one structure or method. Text, CSV,
//! JSON, verdict and page are generated from the rows alone, so a benchmark only has to name its figures.

mod estimate;
mod table;
mod text;
mod verdict;

use std::fmt::Write;

use osp_session::platform::time::Load;
use serde::Serialize;

pub use estimate::Estimate;
pub(crate) use estimate::quantile;
#[cfg(feature = "bench")]
pub(crate) use table::{Cells, RIVAL, Summary, Table, distinct, is_of};

/// Smallest time in a ratio, microseconds, because a clock may return zero.
const LEAST_US: f64 = 1.0e-3;

/// One measured figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Part of the report. The name of a task follows after a slash: `rays/box`.
    pub part: String,
    /// The session, or the synthetic model.
    pub recording: String,
    /// The structure or method; empty for a figure of the recording itself.
    pub index: String,
    /// Name of the figure: `time` (a median), `p99`, `reference` (the reference's median for the same work), `ratio`,
    /// and others.
    pub figure: String,
    /// The unit; empty for a number without one.
    pub unit: &'static str,
    pub value: f64,
    /// Lower end of the interval that contains the true median in 95 of 100 cases; `None` for other figures.
    pub low: Option<f64>,
    /// Upper end of the interval.
    pub high: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Part {
    /// The name of the part, which rows have before the slash.
    pub part: &'static str,
    pub title: &'static str,
    pub notes: Vec<String>,
}

/// Values over a path or a session, for a chart of the page.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    pub part: &'static str,
    pub title: String,
    /// Name of the horizontal axis.
    pub x: &'static str,
    /// Name of the vertical axis, which is logarithmic.
    pub y: &'static str,
    /// The curves: name, and points.
    pub lines: Vec<(String, Vec<(f64, f64)>)>,
}

/// All measurements.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Rows {
    /// The figures, in order of measurement.
    pub rows: Vec<Row>,
    pub parts: Vec<Part>,
    /// Faults: different results, culled visible polygons. Empty unless there is an error.
    pub faults: Vec<String>,
    /// Charts whose data are not in the rows.
    #[serde(skip)]
    pub curves: Vec<Curves>,
    /// How undisturbed the measurements were.
    #[serde(skip)]
    pub load: Load,
}

impl Rows {
    pub fn part(&mut self, part: &'static str, title: &'static str) {
        if self.parts.iter().all(|other| other.part != part) {
            self.parts.push(Part { part, title, notes: Vec::new() });
        }
    }

    /// Adds a note to an existing part, unless the part has the same note.
    pub fn note(&mut self, part: &str, note: impl Into<String>) {
        let note = note.into();
        if let Some(part) = self.parts.iter_mut().find(|other| other.part == part)
            && !part.notes.contains(&note)
        {
            part.notes.push(note);
        }
    }

    /// A collector of figures of a structure; of the recording itself if `index` is empty.
    pub fn of(
        &mut self,
        part: impl Into<String>,
        recording: impl Into<String>,
        index: impl Into<String>,
    ) -> Figures<'_> {
        let (part, recording, index) = (part.into(), recording.into(), index.into());
        let (figure, unit, value) = (String::new(), "", 0.0);
        let of = Row { part, recording, index, figure, unit, value, low: None, high: None };
        Figures { rows: &mut self.rows, of }
    }

    pub fn append(&mut self, mut other: Self) {
        for Part { part, title, notes } in other.parts {
            self.part(part, title);
            notes.into_iter().for_each(|note| self.note(part, note));
        }
        self.rows.append(&mut other.rows);
        self.faults.append(&mut other.faults);
        self.curves.append(&mut other.curves);
        self.load += other.load;
    }

    pub fn value(&self, part: &str, recording: &str, index: &str, figure: &str) -> Option<f64> {
        let is_it = |row: &&Row| {
            row.figure == figure && row.index == index && row.part == part && row.recording == recording
        };
        self.rows.iter().find(is_it).map(|row| row.value)
    }

    /// The rows as CSV with a line of column names.
    pub fn to_csv(&self) -> String {
        let mut csv = "part,recording,index,figure,unit,value,low,high\n".to_owned();
        for Row { part, recording, index, figure, unit, value, low, high } in &self.rows {
            let [part, recording, index, figure] =
                [part, recording, index, figure].map(|text| csv_cell(text));
            let [low, high] = [low, high].map(|end| end.map_or(String::new(), |end| end.to_string()));
            // Writing to a string never fails.
            let _ = writeln!(csv, "{part},{recording},{index},{figure},{unit},{value},{low},{high}");
        }
        csv
    }
}

/// Returns a cell of CSV: in quotes if it contains a separator.
pub fn csv_cell(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[derive(Debug)]
pub struct Figures<'a> {
    rows: &'a mut Vec<Row>,
    of: Row,
}

impl Figures<'_> {
    fn push(&mut self, figure: &str, unit: &'static str, value: f64, ends: Option<(f64, f64)>) -> &mut Self {
        let (low, high) = ends.unzip();
        self.rows.push(Row { figure: figure.to_owned(), unit, value, low, high, ..self.of.clone() });
        self
    }

    pub fn value(&mut self, figure: &str, unit: &'static str, value: f64) -> &mut Self {
        self.push(figure, unit, value, None)
    }

    /// Adds a number, if it was measured.
    pub fn maybe(&mut self, figure: &str, unit: &'static str, value: Option<f64>) -> &mut Self {
        value.map(|value| self.push(figure, unit, value, None));
        self
    }

    /// Adds a count of work, which is 0 for a structure that counts none.
    pub fn counted(&mut self, figure: &str, unit: &'static str, count: f64) -> &mut Self {
        self.maybe(figure, unit, (count > 0.0).then_some(count))
    }

    /// Adds the median of the values with its interval; nothing without values.
    pub fn median(&mut self, figure: &str, unit: &'static str, mut values: Vec<f64>) -> &mut Self {
        if let Some(Estimate { median, low, high }) = Estimate::of(&mut values) {
            self.push(figure, unit, median, Some((low, high)));
        }
        self
    }

    /// Adds median, 99th percentile and maximum of times in microseconds; nothing without values.
    pub fn spread(&mut self, figure: &str, mut us: Vec<f64>) -> &mut Self {
        us.sort_unstable_by(f64::total_cmp);
        for (name, q) in [("p50", 0.5), ("p99", 0.99), ("max", 1.0)].into_iter().filter(|_| !us.is_empty()) {
            self.value(&format!("{figure}_{name}"), "µs", quantile(&us, q));
        }
        self
    }

    /// Adds times of the same work with a structure and with the reference, microseconds: `time`, `p99`, `max`,
    /// `reference`, `ratio` and the number of `values`. The ratio is the median of the ratios; it need not be the
    /// quotient of the two medians.
    pub fn against(&mut self, pairs: &[(f64, f64)]) -> &mut Self {
        let mut own: Vec<f64> = pairs.iter().map(|pair| pair.0).collect();
        self.median("time", "µs", own.clone());
        own.sort_unstable_by(f64::total_cmp);
        for (figure, q) in [("p99", 0.99), ("max", 1.0)].into_iter().filter(|_| !own.is_empty()) {
            self.value(figure, "µs", quantile(&own, q));
        }
        let ratio = |&(own, reference): &(f64, f64)| own.max(LEAST_US) / reference.max(LEAST_US);
        self.median("reference", "µs", pairs.iter().map(|pair| pair.1).collect());
        self.median("ratio", "", pairs.iter().map(ratio).collect());
        self.value("values", "", pairs.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_cells_of_csv_whatever_they_hold() {
        let mut rows = Rows::default();
        rows.of("a/b", "x, \"y\"\n", "osp").value("time", "µs", 1.5).median("ratio", "", vec![1.0, 3.0, 2.0]);
        let expected = "part,recording,index,figure,unit,value,low,high\n\
                        a/b,\"x, \"\"y\"\"\n\",osp,time,µs,1.5,,\n\
                        a/b,\"x, \"\"y\"\"\n\",osp,ratio,,2,1,3\n";
        assert_eq!(rows.to_csv(), expected);
    }

    #[test]
    fn a_ratio_is_that_of_the_same_work_and_a_clock_that_stands_still_makes_none_infinite() {
        let mut rows = Rows::default();
        rows.of("a", "r", "x").against(&[(4.0, 2.0), (9.0, 3.0), (1.0, 0.0), (0.0, 0.0)]);
        let of = |figure| rows.value("a", "r", "x", figure);
        assert_eq!([of("time"), of("reference"), of("max")], [Some(2.5), Some(1.0), Some(9.0)]);
        assert_eq!([of("ratio"), of("values")], [Some(2.5), Some(4.0)]);
        rows.of("a", "r", "none").against(&[]);
        assert_eq!(rows.value("a", "r", "none", "ratio"), None);
    }
}
