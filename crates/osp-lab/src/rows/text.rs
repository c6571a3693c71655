//! Rows as text: summaries, or all tables.

use comfy_table::{Cell, CellAlignment, TableComponent as Of};

use super::{
    Rows,
    table::{Cells, RIVAL, Summary, Table, is_of},
};
use crate::report::{columns_table, one_line};

/// Number of structures in a summary, besides the reference and the paper's rival.
const SHOWN: usize = 4;

/// The table as text. If a line would exceed this number of characters, columns on the right are missing, and a line
/// after the table names them.
fn drawn(cells: &Cells, letters: Option<u16>) -> String {
    let width = |column: usize| {
        let texts = [&cells.head[column]].into_iter().chain(cells.rows.iter().map(|row| &row[column]));
        // A space on either side, and one between two columns.
        3 + texts.flat_map(|text| text.lines()).map(|line| one_line(line).chars().count()).max().unwrap_or(0)
    };
    let mut room = letters.map_or(usize::MAX, usize::from);
    let fits = |column: &usize| {
        let rest = room.checked_sub(width(*column));
        room = rest.unwrap_or(room);
        // The first column is always kept, because it names the rows.
        rest.is_some() || *column == 0
    };
    let shown = (0..cells.head.len()).take_while(fits).count();
    let mut table = columns_table();
    for border in [Of::TopBorder, Of::TopBorderIntersections, Of::TopLeftCorner, Of::TopRightCorner] {
        table.remove_style(border);
    }
    for border in
        [Of::BottomBorder, Of::BottomBorderIntersections, Of::BottomLeftCorner, Of::BottomRightCorner]
    {
        table.remove_style(border);
    }
    table.set_header(&cells.head[..shown]);
    for row in &cells.rows {
        table.add_row(row[..shown].iter().map(|cell| Cell::new(one_line(cell))));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let missing: Vec<String> = cells.head[shown..]
        .iter()
        .map(|head| head.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    if missing.is_empty() {
        return table.to_string();
    }
    format!("{table}\nToo wide for the terminal: {}; --json has all columns.", missing.join(", "))
}

impl Rows {
    /// A table for each chosen part: median, 99th percentile and ratio to `reference` of the best structures. Parts
    /// without ratios to the reference are skipped.
    pub fn summary(&self, reference: &str, is_chosen: impl Fn(&str) -> bool) -> String {
        let tables = self.tables();
        let part = |part: &super::Part| {
            let of: Vec<&Table<'_>> = tables.iter().filter(|table| is_of(table.part, part.part)).collect();
            let mut summary = Summary::of(&of)?;
            let count = summary.cells.rows.len();
            let mut place = 0;
            summary.cells.rows.retain(|row| {
                place += 1;
                place <= SHOWN || row[0] == reference || row[0] == RIVAL
            });
            let over = match summary.recordings {
                1 => of[0].recording.to_owned(),
                count => format!("geometric means over {count} recordings"),
            };
            let left_out = count - summary.cells.rows.len();
            let left_out = if left_out > 0 { format!("; {left_out} more with --all") } else { String::new() };
            let times_of = match summary.times_of.as_str() {
                "" => String::new(),
                task => format!("; times: {task}"),
            };
            let title = format!("{}; {}{times_of}{left_out}", part.title, one_line(&over));
            Some(format!("\n{title}\n{}", drawn(&summary.cells, None)))
        };
        self.parts.iter().filter(|part| is_chosen(part.part)).filter_map(part).collect::<Vec<_>>().join("\n")
    }

    /// Every table of the chosen parts.
    pub fn all_tables(&self, is_chosen: impl Fn(&str) -> bool) -> String {
        let tables = self.tables();
        let mut lines = Vec::new();
        for part in self.parts.iter().filter(|part| is_chosen(part.part)) {
            lines.push(format!("\n{}", part.title));
            lines.extend(part.notes.iter().map(|note| one_line(note).into_owned()));
            for table in tables.iter().filter(|table| is_of(table.part, part.part)) {
                let (about, cells) = (table.about(), table.cells());
                let about = if about.is_empty() { about } else { format!(": {about}") };
                lines.push(format!("\n{}, {}{about}", table.part, one_line(table.recording)));
                lines.extend((!cells.rows.is_empty()).then(|| drawn(&cells, None)));
            }
        }
        lines.join("\n")
    }

    pub fn bare_tables(&self, letters: Option<u16>) -> String {
        self.tables().iter().map(|table| drawn(&table.cells(), letters)).collect::<Vec<_>>().join("\n\n")
    }
}
