//! The charts of the report: what their lines are, with the sentences that are computed from them.

mod data;
mod flight;
mod growth;
mod session;
mod svg;

use super::estimate::quantile;
use crate::report::LineStyle;

pub(super) use data::DataSheet;
pub(super) use flight::flight_charts;
pub(super) use growth::growth_charts;
pub(super) use session::session_charts;

/// Points of a line at most: values are gathered into this many groups, of which the median is drawn.
const GROUPS: usize = 240;
/// The same for a line that is not seen before somebody asks for it.
const GROUPS_OF_EXTRA: usize = 120;

pub(super) type Points = Vec<(f64, f64)>;

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
    /// Whether the line is not seen before somebody asks for it.
    is_extra: bool,
}

impl Line {
    /// The line of a structure.
    pub(super) fn of_structure(name: &str, points: Points) -> Self {
        Self::new(name, LineStyle::of_structure(name), points)
    }

    pub(super) fn new(name: &str, style: LineStyle, points: Points) -> Self {
        Self { name: name.to_owned(), style, points, thin: Vec::new(), is_extra: false }
    }
}

/// The middle of neighbouring values, with the slowest beside it.
pub(super) fn grouped(values: &[(f64, f64)]) -> (Points, Points) {
    grouped_into(values, GROUPS)
}

fn grouped_into(values: &[(f64, f64)], groups: usize) -> (Points, Points) {
    let group = |chunk: &[(f64, f64)]| {
        let mut sorted: Vec<f64> = chunk.iter().map(|&(_, y)| y).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let x = chunk[chunk.len() / 2].0;
        ((x, quantile(&sorted, 0.5)), (x, quantile(&sorted, 1.0)))
    };
    values.chunks(values.len().div_ceil(groups).max(1)).map(group).unzip()
}

impl Chart {
    pub(super) fn is_empty(&self) -> bool {
        self.lines.iter().all(|line| line.points.is_empty())
    }

    /// The lines that have points, those first that are seen from the start.
    pub(super) fn legend(&self) -> impl Iterator<Item = LegendEntry<'_>> {
        self.lines.iter().filter(|line| !line.points.is_empty()).map(|line| LegendEntry {
            name: &line.name,
            style: line.style,
            is_extra: line.is_extra,
        })
    }

    /// The lines that are seen from the start.
    fn drawn(&self) -> impl DoubleEndedIterator<Item = &Line> {
        self.lines.iter().filter(|line| !line.is_extra)
    }
}

/// A line's name and look.
pub(super) struct LegendEntry<'a> {
    pub(super) name: &'a str,
    pub(super) style: LineStyle,
    pub(super) is_extra: bool,
}

impl Axis {
    fn name(self) -> &'static str {
        match self {
            Self::Linear(name) | Self::Log(name) => name,
        }
    }
}
