use super::{
    BenchReport, Flight, GrowthRow, SessionResult, SessionRow, ViewsRow,
    grid::{Grid, RATIO, REFERENCE, interval},
    moving,
    paper::{notes, tables},
    rays::show,
};
use crate::report::{one_line, short, thousands};

pub(super) fn session_grid(session: &SessionResult) -> Grid {
    let mut head = vec![
        "index",
        "insert\nns/polygon",
        "insert p99\nµs",
        "cull\nµs",
        "frame p50\nµs",
        "p99\nµs",
        REFERENCE,
        RATIO,
        "nodes\n/frame",
        "boxes\n/frame",
        "memory\nB/polygon",
        "frames\nmeasured",
    ];
    let has_views = session.rig.is_some();
    if has_views {
        head.extend([
            "views\n(mean)",
            "all views\nµs (mean)",
            "views x one\nµs (mean)",
            "all against\nviews x one",
        ]);
    }
    let views = |row: &SessionRow| match &row.views {
        Some(ViewsRow { views, against_one_view: of }) => {
            [*views, of.all_views_us, of.views_times_one_us, of.ratio].map(short).to_vec()
        }
        None if has_views => vec!["-".to_owned(); 4],
        None => Vec::new(),
    };
    let rows = session
        .rows
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.index.clone(),
                short(row.insert_ns_per_polygon.median),
                short(row.insert_us[1]),
                short(row.cull_us.median),
                short(row.frame_us.median),
                short(row.frame_high_us[0]),
                short(row.reference_us.median),
                interval(&row.ratio),
                short(row.nodes),
                short(row.boxes),
                short(row.bytes_per_polygon),
                thousands(row.frames_measured as u64),
            ];
            cells.extend(views(row));
            cells
        })
        .collect();
    Grid::new(head, rows).least_first(RATIO)
}

/// Head of the column with the reference's time divided by that of the best of the others.
const AGAINST: &str = "against\nit";

/// Of each session the reference's frame beside that of the index that takes the least time for the same frames.
pub(super) fn best_grid(sessions: &[SessionResult], reference: &str) -> Grid {
    let head = vec!["session", "polygons", "frame p50\nµs", "fastest\nother", "frame p50\nµs", AGAINST];
    let rows = sessions.iter().filter_map(|session| {
        let own = session.rows.iter().find(|row| row.index == reference)?.frame_us.median;
        let others = session.rows.iter().filter(|row| row.index != reference);
        let best = others.min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
        Some(vec![
            one_line(&session.recording).into_owned(),
            thousands(session.polygons),
            short(own),
            best.index.clone(),
            short(best.frame_us.median),
            // Frame by frame: a slow structure may have been measured in fewer frames.
            if best.ratio.median > 0.0 { short(1.0 / best.ratio.median) } else { "-".to_owned() },
        ])
    });
    Grid::new(head, rows.collect()).least_first(AGAINST)
}

pub(super) fn growth_grid<'a>(rows: impl IntoIterator<Item = &'a GrowthRow>) -> Grid {
    let head = vec![
        "index",
        "polygons",
        "fill\nns/polygon",
        "frame p50\nµs",
        "p99\nµs",
        REFERENCE,
        RATIO,
        "still\nµs",
        REFERENCE,
        RATIO,
        "all in view\nµs",
        REFERENCE,
        RATIO,
        "memory\nB/polygon",
    ];
    let rows = rows
        .into_iter()
        .map(|row| {
            vec![
                row.index.clone(),
                thousands(u64::from(row.polygons)),
                short(row.fill_ns_per_polygon),
                short(row.frame_us.median),
                short(row.frame_high_us[0]),
                short(row.reference_us.median),
                interval(&row.ratio),
                short(row.still_us.median),
                short(row.still_reference_us.median),
                interval(&row.still_ratio),
                short(row.still_all_us.median),
                short(row.still_all_reference_us.median),
                interval(&row.still_all_ratio),
                short(row.bytes_per_polygon),
            ]
        })
        .collect();
    Grid::new(head, rows).least_first(RATIO)
}

pub(super) fn flight_grid(flights: &[Flight]) -> Grid {
    let head = vec![
        "recording",
        "camera",
        "polygons",
        "in view\n(mean)",
        "drawn\n(mean)",
        "frustum\nµs",
        "and occlusion\nµs",
        "break-even\nns/polygon",
    ];
    let rows = flights
        .iter()
        .map(|flight| {
            vec![
                one_line(&flight.recording).into_owned(),
                flight.camera.clone(),
                thousands(flight.polygons),
                short(flight.in_view),
                short(flight.drawn),
                interval(&flight.frustum_us),
                interval(&flight.both_us),
                flight.break_even_ns_per_polygon.map_or("never".to_owned(), short),
            ]
        })
        .collect();
    Grid::new(head, rows)
}

impl BenchReport {
    /// The report as tables of text.
    pub fn to_text(&self) -> String {
        let mut parts = vec![self.machine.text()];
        for session in &self.sessions {
            parts.push(format!(
                "\n{}: {} polygons, {} frames ({}, camera {}); insertion and culling, no drawing; ratio: a frame against \
                 the same frame of {}",
                one_line(&session.recording),
                thousands(session.polygons),
                thousands(session.frames),
                session.pace,
                session.camera,
                self.reference
            ));
            parts.push(session_grid(session).text());
            if let Some(rig) = &session.rig {
                parts.push(
                    "Each frame has all views; views x one: the same frames with one view, each in turn, times their number; \
                     both without their slowest hundredth."
                        .to_owned(),
                );
                parts.extend(rig.blind(session.frames));
            }
            if !session.indexes_agree {
                parts.push("NOT ALL INDEXES SAW THE SAME POLYGONS.".to_owned());
            }
        }
        let best = best_grid(&self.sessions, &self.reference);
        if best.rows.len() > 1 {
            parts.push(format!(
                "\nAll sessions: {} against the fastest of the others, frame by frame, median; below 1, {} is faster",
                self.reference, self.reference
            ));
            parts.push(best.text());
        }
        if !self.growth.is_empty() {
            parts.push(format!(
                "\nGrowth: a synthetic session of loose strokes. frame: inserts a batch and culls from inside; still: \
                 inserts nothing; all in view: the same from outside; ratios against {}",
                self.reference
            ));
            parts.push(growth_grid(&self.growth).text());
            for skipped in &self.skipped {
                parts.push(format!(
                    "{} was left out at {} polygons: filling it and drawing three frames takes about {} s.",
                    skipped.index,
                    thousands(u64::from(skipped.polygons)),
                    short(skipped.expected_secs)
                ));
            }
        }
        if let Some(flight) = self.flights.first() {
            parts.push(format!(
                "\nFlight through the finished model, {} with {} occlusion; break-even: what drawing a polygon has to \
                 cost for occlusion culling to pay",
                flight.index, flight.occlusion
            ));
            parts.push(flight_grid(&self.flights).text());
        }
        for paper in &self.paper {
            parts.push("\nThe paper, as it is printed".to_owned());
            parts.extend(notes(paper));
            for (title, grid) in tables(paper) {
                parts.push(format!("\n{}", one_line(&title)));
                parts.push(grid.text());
            }
        }
        for result in &self.rays {
            parts.push(format!("\n{}; {}", show::heading(result), show::legend(&self.reference)));
            parts.push(show::times(result).text());
            parts.push(format!("\n{}", show::WALKS));
            parts.push(show::walks(result).text());
            if !result.moved.is_empty() {
                parts.push(format!("\n{}", show::MOVED));
                parts.push(show::moved(result).text());
            }
            parts.extend(show::remarks(result, &self.reference));
        }
        for result in &self.moving {
            parts.push(format!("\n{}", moving::show::heading(result, &self.reference)));
            for (about, grid) in moving::show::tables(result) {
                parts.push(format!("\n{about}"));
                parts.push(grid.text());
            }
            parts.extend(moving::show::remarks(result, &self.reference));
        }
        parts.join("\n")
    }
}
