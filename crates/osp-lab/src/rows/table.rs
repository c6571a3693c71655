//! Rows as tables: a line for each structure, a column for each figure.

use std::collections::HashMap;

use super::{Row, Rows};
use crate::{
    Method,
    report::{one_line, short, thousands},
};

/// The rival structure of the paper. Summaries, charts and verdicts always contain it.
pub(crate) const RIVAL: &str = "octree-rebuild";
/// Number of decimals of numbers below a tenth.
const DECIMALS: usize = 4;

/// Whether a task belongs to a part.
pub(crate) fn is_of(task: &str, part: &str) -> bool {
    task.split('/').next() == Some(part)
}

pub(crate) fn distinct<'a>(texts: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for text in texts {
        if !found.contains(&text) {
            found.push(text);
        }
    }
    found
}

/// A number with three significant digits; integers in full.
pub(super) fn number(value: f64) -> String {
    match value {
        x if x.fract() == 0.0 && (0.0..1.0e15).contains(&x) => thousands(x as u64),
        x if x.abs() < 0.1 => format!("{x:.DECIMALS$}"),
        x => short(x),
    }
}

/// The text of a table: names of columns, and cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cells {
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
    /// The column by which the rows are sorted, ascending.
    pub(crate) sorted_by: Option<usize>,
}

/// The rows of one task and one recording.
pub(crate) struct Table<'a> {
    pub(crate) part: &'a str,
    pub(crate) recording: &'a str,
    rows: Vec<&'a Row>,
}

impl<'a> Table<'a> {
    pub(crate) fn indexes(&self) -> Vec<&'a str> {
        distinct(self.rows.iter().map(|row| row.index.as_str()).filter(|index| !index.is_empty()))
    }

    pub(super) fn row(&self, index: &str, figure: &str) -> Option<&'a Row> {
        self.rows.iter().find(|row| row.index == index && row.figure == figure).copied()
    }

    pub(crate) fn value(&self, index: &str, figure: &str) -> Option<f64> {
        Some(self.row(index, figure)?.value)
    }

    /// Figures of the recording itself, in one line.
    pub(crate) fn about(&self) -> String {
        let own = self.rows.iter().filter(|row| row.index.is_empty());
        let own = own.map(|row| match named(row).split_once('\n') {
            Some((figure, unit)) => format!("{figure} {} {unit}", number(row.value)),
            None => format!("{} {}", number(row.value), named(row)),
        });
        own.collect::<Vec<_>>().join(", ")
    }

    /// A line for each structure with all figures, sorted by the ratio if there is one.
    pub(crate) fn cells(&self) -> Cells {
        let heads = self.rows.iter().filter(|row| !row.index.is_empty()).copied();
        let figures = distinct(heads.clone().map(|row| row.figure.as_str()));
        let head =
            |figure: &&str| heads.clone().find(|row| row.figure == *figure).map_or(String::new(), named);
        let cell = |index: &str, figure: &str| match self.row(index, figure) {
            Some(&Row { value, low: Some(low), high: Some(high), .. }) if figure == "ratio" => {
                format!("{} ({}..{})", number(value), number(low), number(high))
            }
            Some(row) => number(row.value),
            None => "-".to_owned(),
        };
        let mut indexes = self.indexes();
        // A race has no ratios.
        let by = ["ratio", "frame_p50"].into_iter().find(|by| figures.contains(by));
        let sorted_by = by.and_then(|by| Some(figures.iter().position(|figure| *figure == by)? + 1));
        if let Some(by) = by.filter(|_| sorted_by.is_some()) {
            let value = |index: &str| self.value(index, by).unwrap_or(f64::INFINITY);
            indexes.sort_by(|a, b| value(a).total_cmp(&value(b)));
        }
        let line = |index: &&str| {
            let name = (*index).to_owned();
            [name].into_iter().chain(figures.iter().map(|figure| cell(index, figure))).collect()
        };
        Cells {
            head: [kind_of(&indexes)].into_iter().chain(figures.iter().map(head)).collect(),
            rows: indexes.iter().map(line).collect(),
            sorted_by,
        }
    }
}

/// The heading of a table's names: `index`, or `method` for methods of occlusion culling (`msvbsp, 64 occluders`).
fn kind_of(names: &[&str]) -> String {
    let is_method = |name: &&str| Method::from_name(name.split([',', ' ']).next().unwrap_or(name)).is_some();
    let kind = if !names.is_empty() && names.iter().all(is_method) { "method" } else { "index" };
    kind.to_owned()
}

/// The name of a figure, and its unit in a second line.
fn named(row: &Row) -> String {
    let figure = one_line(&row.figure).replace('_', " ");
    match row.unit {
        "" => figure,
        unit if unit == figure => figure,
        unit => format!("{figure}\n{unit}"),
    }
}

/// A summary of a part: time, 99th percentile and ratio of each structure for the first task, and its ratio for each
/// other task. These are geometric means over the recordings.
pub(crate) struct Summary {
    pub(crate) cells: Cells,
    /// Number of recordings of the task that has most of them.
    pub(crate) recordings: usize,
    /// The task of median and 99th percentile; empty if the part has only one task.
    pub(crate) times_of: String,
}

impl Rows {
    /// The tables, in the order of their first rows.
    pub(crate) fn tables(&self) -> Vec<Table<'_>> {
        let mut tables: Vec<Table<'_>> = Vec::new();
        let mut places = HashMap::new();
        for row in &self.rows {
            let (part, recording) = (row.part.as_str(), row.recording.as_str());
            let place = *places.entry((part, recording)).or_insert_with(|| {
                tables.push(Table { part, recording, rows: Vec::new() });
                tables.len() - 1
            });
            tables[place].rows.push(row);
        }
        tables
    }
}

impl Summary {
    /// The summary of a part, whose tables are `tables`; `None` for a part without ratios.
    pub(crate) fn of(tables: &[&Table<'_>]) -> Option<Self> {
        let has_ratio =
            |table: &&&Table<'_>| table.indexes().iter().any(|index| table.value(index, "ratio").is_some());
        let tables: Vec<&Table<'_>> = tables.iter().filter(has_ratio).copied().collect();
        let tasks = distinct(tables.iter().map(|table| table.part));
        let of = |task: &str| tables.iter().filter(|table| table.part == task).copied().collect::<Vec<_>>();
        let name = |task: &str| task.split_once('/').map_or(String::new(), |(_, name)| name.to_owned());
        let times_of = name(tasks.first()?);
        let first = of(tasks.first()?);
        let mut columns = vec![
            ("median\nµs".to_owned(), first.clone(), "time"),
            ("p99\nµs".to_owned(), first.clone(), "p99"),
        ];
        for task in &tasks {
            let name = name(task);
            let head = if name.is_empty() { "ratio".to_owned() } else { in_two_lines(&name) };
            columns.push((head, of(task), "ratio"));
        }
        let recordings = tasks.iter().map(|task| of(task).len()).max()?;
        let mut indexes = distinct(tables.iter().flat_map(|table| table.indexes()));
        let mean = |tables: &[&Table<'_>], index: &str, figure: &str| {
            geometric_mean(tables, |table| table.value(index, figure))
        };
        let ratio = |index: &str| mean(&first, index, "ratio").unwrap_or(f64::INFINITY);
        indexes.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        let cell = |index: &str, (_, tables, figure): &(String, Vec<&Table<'_>>, &str)| {
            mean(tables, index, figure).map_or("-".to_owned(), number)
        };
        let line = |index: &&str| {
            let name = (*index).to_owned();
            [name].into_iter().chain(columns.iter().map(|column| cell(index, column))).collect()
        };
        let head = [kind_of(&indexes)].into_iter().chain(columns.iter().map(|(head, ..)| head.clone()));
        let cells =
            Cells { head: head.collect(), rows: indexes.iter().map(line).collect(), sorted_by: Some(3) };
        Some(Self { cells, recordings, times_of })
    }
}

/// The name with a line break at its middle space.
fn in_two_lines(name: &str) -> String {
    let middle = name.len() / 2;
    let spaces = name.match_indices(' ').map(|(at, _)| at);
    match spaces.min_by_key(|at| at.abs_diff(middle)) {
        Some(at) => format!("{}\n{}", &name[..at], &name[at + 1..]),
        None => name.to_owned(),
    }
}

/// The geometric mean over tables, in which every recording has the same weight. `None` if one of the tables lacks the
/// value.
pub(super) fn geometric_mean<'a>(
    tables: &[&Table<'a>],
    value: impl Fn(&Table<'a>) -> Option<f64>,
) -> Option<f64> {
    let logarithm = |table: &&Table<'a>| Some(value(table)?.max(super::LEAST_US).ln());
    let logarithms: Vec<f64> = tables.iter().map(logarithm).collect::<Option<_>>()?;
    let count = logarithms.len();
    (count > 0).then(|| (logarithms.iter().sum::<f64>() / count as f64).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_best_first_and_a_summary_is_of_all_recordings() {
        let mut rows = Rows::default();
        for (recording, slow) in [("a", 2.0), ("b", 9.0)] {
            rows.of("p", recording, "").value("polygons", "polygons", 1234.0);
            rows.of("p", recording, "x").against(&[(slow, 1.0)]).value("boxes", "1/frame", 7.25);
            rows.of("p", recording, "osp").against(&[(1.0, 1.0)]);
        }
        rows.of("p", "b", "late").against(&[(1.0, 1.0)]);
        let tables = rows.tables();
        assert_eq!(tables[0].about(), "1,234 polygons");
        let cells = tables[0].cells();
        assert_eq!(cells.head[5], "ratio");
        let names: Vec<&str> = cells.rows.iter().map(|row| row[0].as_str()).collect();
        assert_eq!((names, &*cells.rows[1][5]), (vec!["osp", "x"], "2 (2..2)"));
        assert_eq!((&*cells.rows[0][7], &*cells.rows[1][7]), ("-", "7.25"));
        let summary = Summary::of(&tables.iter().collect::<Vec<_>>()).expect("ratios");
        assert_eq!(summary.recordings, 2);
        assert_eq!(summary.cells.head, ["index", "median\nµs", "p99\nµs", "ratio"]);
        assert_eq!(summary.cells.rows[1], ["x", "4.24", "4.24", "4.24"]);
        // The structure was not measured on every recording.
        assert_eq!(summary.cells.rows[2], ["late", "-", "-", "-"]);
    }
}
