use comfy_table::{Cell, CellAlignment, ColumnConstraint};

use super::{
    DrawnWhileCulling, ReplayReport, RunReport, columns_table,
    numbers::{short, thousands},
    views_table::views_table,
};

/// A terminal narrower than this gets the most important columns alone.
const WIDE: u16 = 100;
/// The others.
const IN_WIDE_TABLES: [&str; 9] = [
    "p95\nµs",
    "visible\n(mean)",
    "culled\n(mean)",
    "memory\nKiB",
    "frames\nmeasured",
    "groups\ntested",
    "depth\npass",
    "colour\npass",
    "used\n%",
];

/// The table of a replay: one line for each index. On a rig a second table has the counts of each screen and eye. `columns`:
/// how many letters fit into a line, if that is known.
pub fn replay_table(report: &ReplayReport, columns: Option<u16>) -> String {
    let mut table = columns_table();
    let polygon_ns = report.runs.iter().find_map(|run| run.occlusion.as_ref()).map(|o| o.polygon_ns);
    let mut header = [
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
    ]
    .map(str::to_owned)
    .to_vec();
    if let Some(polygon_ns) = polygon_ns {
        let drawn = format!("with drawing\n({polygon_ns} ns) µs");
        header.splice(1..1, ["occlusion".to_owned()]);
        header.extend([
            "occluded\n(mean)".to_owned(),
            "occlusion\nµs".to_owned(),
            "used\n%".to_owned(),
            drawn,
        ]);
    }
    let has_draw = report.runs.iter().any(|run| run.draw.is_some());
    if has_draw {
        header.extend(["draw p50\nµs".to_owned(), "p99\nµs".to_owned()]);
    }
    let while_drawing = |run: &RunReport| run.draw.as_ref().is_some_and(|draw| draw.has_culling());
    let has_culling = report.runs.iter().any(while_drawing);
    if has_culling {
        let names =
            ["groups\ntested", "depth\npass", "colour\npass", "GPU: depth\nµs", "test\nµs", "colours\nµs"];
        header.extend(names.map(str::to_owned));
    }
    let is_left_out = |name: &String| {
        columns.is_some_and(|columns| columns < WIDE) && IN_WIDE_TABLES.contains(&name.as_str())
    };
    let left_out: Vec<bool> = header.iter().map(is_left_out).collect();
    table.set_header(header);
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
        let mut numbers = numbers.to_vec();
        let mut names = vec![run.index.as_str()];
        if let Some(occlusion) = &run.occlusion {
            names.push(occlusion.method);
            numbers.extend([
                short(run.occluded_mean()),
                short(run.occlusion_total_us()),
                short(run.occlusion_used_percent()),
                short(run.drawn_frame_us(0.5, occlusion.polygon_ns)),
            ]);
        }
        if let Some(draw) = &run.draw {
            numbers.extend([short(draw.draw_us(0.5)), short(draw.draw_us(0.99))]);
            if draw.has_culling() {
                let mean = |of: fn(&DrawnWhileCulling) -> u64| short(draw.culling_mean(of));
                numbers.extend([
                    mean(|drawn| drawn.groups_tested),
                    mean(|drawn| drawn.first_pass),
                    mean(|drawn| drawn.second_pass),
                ]);
                numbers.extend(draw.gpu_us().unwrap_or_default().map(short));
            } else if has_culling {
                numbers.extend([const { String::new() }; 6]);
            }
        }
        let cells = numbers.into_iter().map(|n| Cell::new(n).set_alignment(CellAlignment::Right));
        table.add_row(names.into_iter().map(Cell::new).chain(cells));
    }
    for column in table.column_iter_mut().skip(1 + usize::from(polygon_ns.is_some())) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    for (column, _) in table.column_iter_mut().zip(&left_out).filter(|(_, is_left_out)| **is_left_out) {
        column.set_constraint(ColumnConstraint::Hidden);
    }
    match &report.rig {
        Some(rig) => format!("{table}\n{}", views_table(rig, &report.runs)),
        None => table.to_string(),
    }
}
