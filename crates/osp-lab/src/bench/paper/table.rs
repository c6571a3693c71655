use super::{CubeRow, FlightRow, GrowingRow, PaperResult};
use crate::{
    bench::{
        Estimate,
        grid::{Grid, interval},
    },
    report::{short, thousands},
};

/// The tables of a session, each with its title.
pub(in crate::bench) fn tables(result: &PaperResult) -> [(String, Grid); 3] {
    let growing = format!(
        "{}: {} polygons, {} frames ({}, camera {}); the model grows (Figs. 19, 21 to 23)",
        result.recording,
        thousands(result.polygons),
        thousands(result.frames),
        result.pace,
        result.camera
    );
    let flight = format!(
        "{}: a flight through the finished model, camera {} (Fig. 20); {} occluders",
        result.recording, result.flight_camera, result.occluders
    );
    let cubes = format!("{}: depth and cube of the paper's tree (Fig. 2, step 1)", result.recording);
    [
        (growing, growing_grid(&result.growing)),
        (flight, flight_grid(&result.flight)),
        (cubes, cube_grid(&result.cubes)),
    ]
}

/// What has to be known to read the tables.
pub(in crate::bench) fn notes(result: &PaperResult) -> Vec<String> {
    let drawing = match &result.drawn_by {
        Some(who) => format!("Drawn by {who}: a frame is insertion, culling, sending and drawing."),
        None => {
            "Nothing was drawn (--draw): a frame is insertion and culling, which is no frame rate.".to_owned()
        }
    };
    vec![
        drawing,
        "Who is ahead can be compared with the paper; its frame rates cannot: they are those of its machine and renderer."
            .to_owned(),
        format!(
            "The paper's tree: {} levels over a cube of {} m. As in Fig. 6 osp-paper and octree-paper draw all polygons of a node \
             that the frustum cuts; osp and octree-rebuild draw those in view.",
            result.depth,
            short(f64::from(result.cube_m))
        ),
    ]
}

/// Frames a second, of a frame in which something is drawn.
pub(super) fn frames_a_second(frame_us: &Estimate, draw_us: Option<&Estimate>) -> Option<f64> {
    draw_us.filter(|_| frame_us.median > 0.0).map(|_| 1.0e6 / frame_us.median)
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), short)
}

fn growing_grid(rows: &[GrowingRow]) -> Grid {
    let head = vec![
        "part, tree",
        "insert\nµs",
        "cull\nµs",
        "draw\nµs",
        "frame p50\nµs",
        "p99\nµs",
        "frames\n/s",
        "planes\n/polygon",
        "drawn",
        "in view",
        "frames\nmeasured",
    ];
    let row = |row: &GrowingRow| {
        vec![
            format!("{}, {}", row.part, row.tree),
            short(row.insert_us.median),
            short(row.cull_us.median),
            or_dash(row.draw_us.as_ref().map(|us| us.median)),
            interval(&row.frame_us),
            short(row.frame_p99_us),
            or_dash(frames_a_second(&row.frame_us, row.draw_us.as_ref())),
            or_dash(row.planes_per_polygon),
            short(row.drawn),
            short(row.in_view),
            thousands(row.frames.len() as u64),
        ]
    };
    // Part by part, so that the trees stand side by side.
    let mut parts: Vec<&str> = Vec::new();
    for row in rows {
        if !parts.contains(&row.part) {
            parts.push(row.part);
        }
    }
    let rows = parts.iter().flat_map(|part| rows.iter().filter(move |row| row.part == *part)).map(row);
    Grid::new(head, rows.collect())
}

fn flight_grid(rows: &[FlightRow]) -> Grid {
    let head = vec![
        "way",
        "conservative",
        "cull\nµs",
        "draw\nµs",
        "frame\nµs",
        "frames\n/s",
        "drawn",
        "visible,\nculled",
        "slower than\nfrustum, %",
    ];
    let row = |row: &FlightRow| {
        vec![
            row.way.clone(),
            row.not_conservative.map_or("yes", |_| "NO").to_owned(),
            interval(&row.cull_us),
            or_dash(row.draw_us.as_ref().map(|us| us.median)),
            interval(&row.frame_us),
            or_dash(frames_a_second(&row.frame_us, row.draw_us.as_ref())),
            short(row.drawn),
            row.wrong.map_or("-".to_owned(), thousands),
            short(row.slower_percent),
        ]
    };
    Grid::new(head, rows.iter().map(row).collect()).least_first("frame\nµs")
}

fn cube_grid(rows: &[CubeRow]) -> Grid {
    let head = vec![
        "cube",
        "edge\nm",
        "depth",
        "nodes",
        "planes\n/polygon",
        "outside",
        "boxes tested\n/frame",
        "cull\nµs",
        "drawn",
        "in view",
        "memory\nMB",
    ];
    let row = |row: &CubeRow| {
        vec![
            format!("x {}", short(f64::from(row.cube))),
            short(f64::from(row.cube_m)),
            row.depth.to_string(),
            thousands(row.nodes),
            short(row.planes_per_polygon),
            thousands(row.outside),
            short(row.tests),
            short(row.cull_us.median),
            short(row.drawn),
            short(row.in_view),
            short(row.bytes as f64 / 1.0e6),
        ]
    };
    Grid::new(head, rows.iter().map(row).collect())
}
