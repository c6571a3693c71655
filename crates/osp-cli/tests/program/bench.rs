//! `osp bench`: its rows as text, JSON, CSV and page.

#[path = "../gpu/render/decoded_film.rs"]
mod decoded_film;
mod film;
mod moving;
mod page;
mod paper;
mod race;
mod rays;

use std::{path::Path, process::Output};

use crate::{OSP, csv::Lines};
use osp_testkit::json;
use serde_json::Value;

/// A session with walls that hide, named with characters that HTML and CSV must not take for their own.
fn session(folder: &Path) -> String {
    let path = folder.join("a <b> & \"c\".ron").to_str().expect("utf-8").to_owned();
    OSP.done(["synth", "room", "--polygons", "1500", &path]);
    path
}

/// A report of `osp bench --json`.
struct Report(Value);

impl Report {
    fn of(output: &Output) -> Self {
        Self(json(output))
    }

    fn rows(&self) -> &[Value] {
        self.0["rows"].as_array().expect("rows")
    }

    /// The row of a figure, if it was measured.
    fn row(&self, part: &str, recording: &str, index: &str, figure: &str) -> Option<&Value> {
        let is_it = |row: &&Value| {
            row["part"] == part
                && row["recording"] == recording
                && row["index"] == index
                && row["figure"] == figure
        };
        self.rows().iter().find(is_it)
    }

    fn maybe(&self, part: &str, recording: &str, index: &str, figure: &str) -> Option<f64> {
        self.row(part, recording, index, figure)?["value"].as_f64()
    }

    fn value(&self, part: &str, recording: &str, index: &str, figure: &str) -> f64 {
        let value = self.maybe(part, recording, index, figure);
        value.unwrap_or_else(|| panic!("{figure} of {index}, {part}, {recording}"))
    }

    /// What a column of the rows of a part holds, each once.
    fn names(&self, part: &str, column: &str) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for row in self.rows().iter().filter(|row| row["part"] == part) {
            let name = row[column].as_str().expect("text");
            if !name.is_empty() && !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }
}

const NAME: &str = "a <b> & \"c\".ron";

fn all_kinds() -> Vec<&'static str> {
    osp_lab::Contender::usual().into_iter().map(|contender| contender.name()).collect()
}

#[test]
fn every_index_is_measured_and_csv_and_json_have_the_same_rows() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let csv = folder.path().join("bench.csv").to_str().expect("utf-8").to_owned();
    let args =
        ["bench", &session, "--quick", "--sizes", "200,600", "--pace", "samples:8", "--json", "--csv", &csv];
    let report = Report::of(&OSP.run(args));
    assert_eq!(report.0["faults"].as_array().map(Vec::len), Some(0));
    assert_eq!(report.names("session", "recording"), [NAME]);
    for (part, recordings) in [("session", &[NAME][..]), ("growth/still", &["scribble-200", "scribble-600"])]
    {
        assert_eq!(report.names(part, "index"), all_kinds(), "{part}");
        for (recording, kind) in
            recordings.iter().flat_map(|name| all_kinds().into_iter().map(move |kind| (name, kind)))
        {
            let of = |figure| report.value(part, recording, kind, figure);
            assert!(0.0 < of("time") && of("time") <= of("p99") && of("p99") <= of("max"), "{part} {kind}");
            assert!(of("values") >= 3.0 && of("reference") > 0.0, "{part} {kind}");
            assert!(kind != "osp" || part != "session" || of("ratio") == 1.0, "{part}");
        }
    }
    for row in report.rows() {
        let [low, value, high] = ["low", "value", "high"].map(|key| row[key].as_f64());
        assert!(low.is_none() == high.is_none() && low <= value.or(low) && value <= high.or(value), "{row}");
    }
    // In a room something is hidden.
    let flight = format!("{NAME} orbit");
    let [osp, both] = ["osp", "osp + msvbsp"].map(|index| report.value("flight", &flight, index, "drawn"));
    assert!(both < osp, "{both} {osp}");

    let lines = Lines::read(&csv);
    let columns = ["part", "recording", "index", "figure", "unit", "value", "low", "high"];
    assert_eq!(lines.names, columns);
    assert_eq!(lines.rows.len(), report.rows().len());
    for (line, row) in lines.rows.iter().zip(report.rows()) {
        let same = columns[..5].iter().zip(line).all(|(column, cell)| row[*column] == cell.as_str());
        assert!(same, "{line:?} {row}");
        let [written, value]: [f64; 2] =
            [line[5].parse().expect("a number"), row["value"].as_f64().expect("a number")];
        assert!((written - value).abs() <= 1.0e-12 * value.abs(), "{written} {row}");
    }
}
