use comfy_table::{Cell, CellAlignment};

use super::Estimate;
use crate::report::{columns_table, short};

/// The heads of columns with the reference's figure for the same frames or questions, which stand before its ratio. The
/// page alone has them.
pub(super) const REFERENCE: &str = "reference\nµs";
pub(super) const REFERENCE_RAYS: &str = "reference\nMRays/s";
const ON_THE_PAGE_ALONE: [&str; 2] = [REFERENCE, REFERENCE_RAYS];
/// The head of a column of ratios.
pub(super) const RATIO: &str = "ratio\n(95 %)";

/// A table before it is drawn, as text or as HTML.
pub(super) struct Grid {
    pub(super) head: Vec<&'static str>,
    pub(super) rows: Vec<Vec<String>>,
    /// Head of the column by which the page has the best row first: the first column of this name. Less is better.
    pub(super) best: Option<&'static str>,
}

impl Grid {
    pub(super) fn new(head: Vec<&'static str>, rows: Vec<Vec<String>>) -> Self {
        Self { head, rows, best: None }
    }

    /// With the row first, on the page, that has least in this column.
    pub(super) fn least_first(self, head: &'static str) -> Self {
        Self { best: Some(head), ..self }
    }

    pub(super) fn text(&self) -> String {
        let mut table = columns_table();
        let shown = |at: &usize| !ON_THE_PAGE_ALONE.contains(&self.head[*at]);
        let columns: Vec<usize> = (0..self.head.len()).filter(shown).collect();
        table.set_header(columns.iter().map(|&at| self.head[at]));
        for row in &self.rows {
            table.add_row(columns.iter().map(|&at| Cell::new(&row[at])));
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    }
}

/// `1.23 (1.20..1.30)`.
pub(super) fn interval(estimate: &Estimate) -> String {
    match estimate.values {
        0 => "-".to_owned(),
        1 => short(estimate.median),
        _ => format!("{} ({}..{})", short(estimate.median), short(estimate.low), short(estimate.high)),
    }
}
