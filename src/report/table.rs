use comfy_table::{Cell, CellAlignment, Table, TableComponent, presets};

use super::ReplayReport;

/// The table of a replay: one line for each index.
pub fn replay_table(report: &ReplayReport) -> String {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_HORIZONTAL_ONLY);
    table.remove_style(TableComponent::HorizontalLines);
    table.remove_style(TableComponent::MiddleIntersections);
    table.set_header([
        "index",
        "insert\nns/polygon",
        "cull\nµs",
        "frame p50\nµs",
        "p95\nµs",
        "p99\nµs",
        "max\nµs",
        "visible\n(mean)",
        "culled\n(mean)",
        "memory\nKiB",
        "frames\nmeasured",
    ]);
    for run in &report.runs {
        let numbers = [
            short(run.insert_ns_per_polygon()),
            short(run.cull_us()),
            short(run.frame_us(0.5)),
            short(run.frame_us(0.95)),
            short(run.frame_us(0.99)),
            short(run.frame_us(1.0)),
            short(run.visible_mean()),
            short(run.culled_mean()),
            thousands((run.bytes / 1024) as u64),
            thousands(run.measured_frames()),
        ];
        let cells = numbers.into_iter().map(|n| Cell::new(n).set_alignment(CellAlignment::Right));
        table.add_row(std::iter::once(Cell::new(&run.index)).chain(cells));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// Three significant digits, thousands set apart.
fn short(x: f64) -> String {
    match x {
        x if x >= 100.0 => thousands(x.round() as u64),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}

/// A whole number, thousands set apart by commas.
pub(crate) fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
