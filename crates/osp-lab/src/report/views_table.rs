use comfy_table::CellAlignment;

use super::{RigReport, RunReport, columns_table, one_line, short};

/// The table of the views: a line for each run, with the polygons in view and drawn of each screen and eye.
pub(super) fn views_table(rig: &RigReport, runs: &[RunReport]) -> String {
    let mut table = columns_table();
    let names = rig.views.iter().map(|view| one_line(&view.name()).replacen(", ", "\n", 1));
    let mut header = vec![format!("in view / drawn\n(means)")];
    header.extend(names);
    header.extend(["all views\nµs", "views x one\nµs", "ratio"].map(str::to_owned));
    table.set_header(header);
    for run in runs {
        let mut row = vec![run.name()];
        row.extend((0..rig.views.len()).map(|number| match run.view_means(number) {
            Some(means) => format!("{} / {}", short(means.in_view), short(means.drawn)),
            None => "no view".to_owned(),
        }));
        match run.against_one_view() {
            Some(of) => row.extend([of.all_views_us, of.views_times_one_us, of.ratio].map(short)),
            None => row.extend(["-"; 3].map(str::to_owned)),
        }
        table.add_row(row);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}
