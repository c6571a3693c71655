//! The authors of a session, for `osp info`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::output::one_line;
use osp_lab::report::thousands;
use osp_session::recording::{Author, Event};

/// Largest number of authors that the text lists.
const MOST_LISTED: usize = 50;

#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct AuthorRow {
    author: u32,
    name: Option<String>,
    color: Option<(f32, f32, f32)>,
    strokes: u64,
    edits: u64,
    joined_secs: f64,
    /// `None` if the author is still present when the recording ends.
    left_secs: Option<f64>,
    present_secs: f64,
}

/// Counts the actions of each author.
#[derive(Debug, Default)]
pub(super) struct AuthorRows {
    rows: BTreeMap<Author, AuthorRow>,
    last_secs: f64,
    has_joined: bool,
}

impl AuthorRows {
    pub(super) fn note(&mut self, event: &Event) {
        self.last_secs = event.time_secs();
        let Some(author) = event.author() else { return };
        let row = self.rows.entry(author).or_insert_with(|| AuthorRow {
            author: author.0,
            joined_secs: event.time_secs(),
            ..AuthorRow::default()
        });
        match event {
            Event::Join { name, color, .. } => {
                self.has_joined = true;
                (row.name, row.color) = (Some(name.clone()), *color);
            }
            Event::Leave { t, .. } => row.left_secs = Some(*t),
            Event::Begin { .. } | Event::Polygon { stroke: None, .. } => row.strokes += 1,
            Event::Erase { .. }
            | Event::Undo { .. }
            | Event::Redo { .. }
            | Event::Move { .. }
            | Event::Group { .. }
            | Event::Place { .. }
            | Event::Assign { .. } => row.edits += 1,
            _ => {}
        }
    }

    /// Returns the rows, sorted by author number. Without a join event there are no rows.
    pub(super) fn finish(self) -> Vec<AuthorRow> {
        let last_secs = self.last_secs;
        let rows = self.rows.into_values().filter(|_| self.has_joined).map(|mut row| {
            row.present_secs = (row.left_secs.unwrap_or(last_secs) - row.joined_secs).max(0.0);
            row
        });
        rows.collect()
    }
}

pub(super) fn lines(rows: &[AuthorRow]) -> Vec<String> {
    let mut lines = Vec::new();
    for (row, number) in rows.iter().take(MOST_LISTED).zip(0..) {
        let title = if number == 0 { "authors" } else { "" };
        let name = match row.name.as_deref() {
            None => "(before anybody joined)".to_owned(),
            Some("") => "(no name)".to_owned(),
            Some(name) => one_line(name).into_owned(),
        };
        let end = match row.left_secs {
            Some(left) => format!("left at {left:.1} s"),
            None => "present to the end".to_owned(),
        };
        lines.push(format!(
            "  {title:<11} {} {name}: {} strokes, {} edits; {:.1} s, joined at {:.1} s, {end}",
            row.author,
            thousands(row.strokes),
            thousands(row.edits),
            row.present_secs,
            row.joined_secs,
        ));
    }
    if rows.len() > MOST_LISTED {
        lines.push(format!("  {:<11} … ({} in all)", "", thousands(rows.len() as u64)));
    }
    lines
}
