use serde::Serialize;

use super::{Flight, GrowthRow, Machine, MovingResult, PaperResult, RaysResult, SessionResult, Skipped};

/// Everything that a run of `osp bench` found.
#[derive(Clone, Debug, Serialize)]
pub struct BenchReport {
    /// Where it was measured.
    pub machine: Machine,
    /// The arguments that repeat it.
    pub command: String,
    /// The index that the others are compared with.
    pub reference: String,
    /// The sessions.
    pub sessions: Vec<SessionResult>,
    /// Sizes and indexes of the synthetic session.
    pub growth: Vec<GrowthRow>,
    /// The sizes that were left out, by index.
    pub skipped: Vec<Skipped>,
    /// Flights through the finished sessions.
    pub flights: Vec<Flight>,
    /// The experiments of the paper.
    pub paper: Vec<PaperResult>,
    /// Rays, ranges and neighbours in the finished sessions and in the synthetic one.
    pub rays: Vec<RaysResult>,
    /// Polygons and groups that move, at the sizes of the synthetic session.
    pub moving: Vec<MovingResult>,
}

impl BenchReport {
    /// The report as one JSON object on one line.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_else(|e| format!("{{\"error\":{:?}}}", e.to_string()))
    }
}
