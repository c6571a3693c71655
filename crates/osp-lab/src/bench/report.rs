use serde::Serialize;

use super::{Machine, paper};
use crate::rows::Rows;

/// Largest number of printed faults if a page has all of them.
const MOST_FAULTS: usize = 8;

#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    pub machine: Machine,
    /// The arguments that repeat the run.
    pub command: String,
    pub reference: String,
    #[serde(flatten)]
    pub rows: Rows,
}

/// The extent of a printed report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// The verdict alone, for a report whose tables are on a page.
    Verdict,
    /// The verdict, and one summary table per part.
    Short,
    /// Additionally every table.
    All,
}

impl BenchReport {
    /// The first lines of the report: the verdict, at most `most` faults, and a warning if the program is not optimised.
    pub(super) fn verdict(&self, most: usize) -> Vec<String> {
        let mut lines: Vec<String> = self.rows.verdict(&self.reference).into_iter().collect();
        let faults = &self.rows.faults;
        lines.extend(faults.iter().take(most).cloned());
        lines.extend((faults.len() > most).then(|| format!("{} MORE FAULTS.", faults.len() - most)));
        lines.extend(self.rows.load.note());
        if !self.machine.optimized && !lines.is_empty() {
            let not_optimized = "The program is NOT optimised: build it with --release for meaningful times.";
            lines.push(not_optimized.to_owned());
        }
        lines
    }

    /// The verdict's details: insertion, query and memory, the tables of all parts, and the paper's trees.
    pub(super) fn details(&self) -> Vec<String> {
        let mut lines = self.rows.verdict_in_detail(&self.reference);
        lines.extend(paper::verdict(&self.rows));
        lines
    }

    /// The report as text. The paper's experiments are always printed in full.
    pub fn to_text(&self, length: Length) -> String {
        let mut parts = self.verdict(if length == Length::Verdict { MOST_FAULTS } else { usize::MAX });
        parts.extend(self.details());
        parts.push(self.machine.text());
        parts.extend(self.rows.load.text());
        if length == Length::Verdict {
            return parts.join("\n");
        }
        let summary = self.rows.summary(&self.reference, |part| !is_paper(part));
        if !summary.is_empty() {
            parts.push(format!(
                "\nratio: median of the time of a frame or query divided by that of {}",
                self.reference
            ));
            parts.push(summary);
        }
        parts.push(self.rows.all_tables(|part| length == Length::All || is_paper(part)));
        parts.retain(|part| !part.is_empty());
        parts.join("\n")
    }
}

fn is_paper(part: &str) -> bool {
    part.starts_with("paper-")
}
