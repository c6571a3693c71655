use serde::Serialize;

use super::Machine;
use crate::{report::json_line, rows::Rows};

/// Everything that a run of `osp bench` found.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    /// Machine of the measurement.
    pub machine: Machine,
    /// The arguments that repeat it.
    pub command: String,
    /// The index that the others are compared with.
    pub reference: String,
    /// Measured rows.
    #[serde(flatten)]
    pub rows: Rows,
}

/// Printed part of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// The verdict and a table a part.
    Short,
    /// Every table, too.
    All,
}

impl BenchReport {
    /// The report as one JSON object on one line.
    pub fn to_json(&self) -> String {
        json_line(self)
    }

    /// The sentences that come first: the verdict, what is wrong, and whether the figures mean something.
    pub(super) fn verdict(&self) -> Vec<String> {
        let mut lines = self.rows.verdict(&self.reference);
        lines.extend(self.rows.faults.iter().cloned());
        if !self.machine.optimized && !lines.is_empty() {
            let not_optimized =
                "The program is NOT optimised: build it with --release for figures that mean something.";
            lines.push(not_optimized.to_owned());
        }
        lines
    }

    /// The report as text. The paper's experiments are always printed whole.
    pub fn to_text(&self, length: Length) -> String {
        let mut parts = vec![self.machine.text()];
        parts.extend(self.verdict());
        let summary = self.rows.summary(&self.reference, |part| !is_paper(part));
        if !summary.is_empty() {
            parts.push(format!(
                "\nratio: a frame or question against the same one of {}, median",
                self.reference
            ));
            parts.push(summary);
        }
        parts.push(self.rows.all_tables(|part| length == Length::All || is_paper(part)));
        parts.retain(|part| !part.is_empty());
        parts.join("\n")
    }
}

/// Whether a part is one of the paper's experiments.
fn is_paper(part: &str) -> bool {
    part.starts_with("paper-")
}
