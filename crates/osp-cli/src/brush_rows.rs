//! The table of brushes of `osp info`.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use super::output::{self, one_line};
use osp_lab::report::thousands;
use osp_session::{
    brush::{self, Brush, Draw, Family, Lighting},
    recording::{Event, StrokeId, Tool},
    scene::Scene,
};

/// Largest number of rows for unknown brushes. The last row also counts all further ones.
const MOST_UNKNOWN: usize = 1000;

/// The strokes without a known brush, by their tool or unknown brush. A scene does not store this information.
#[derive(Default)]
pub(super) struct Plain {
    rows: Vec<(String, String)>,
    row_by_name: HashMap<String, usize>,
    row_of: HashMap<StrokeId, usize>,
}

/// Counts for one brush: strokes that are not erased, their points, and their polygons with an area.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct BrushRow {
    brush: String,
    drawn_as: String,
    /// 0 in the row of finished polygons, which belong to no drawn stroke.
    pub(super) strokes: u64,
    /// Number of these strokes that are not drawn, because their layer is hidden.
    hidden_strokes: u64,
    points: u64,
    polygons: u64,
}

impl Plain {
    pub(super) fn note(&mut self, event: &Event) {
        let Event::Begin { stroke, tool, paint, .. } = event else { return };
        let (name, drawn_as) = match paint {
            Some(paint) if brush::find(&paint.brush).is_some() => return,
            Some(paint) => (paint.brush.as_str(), "unknown: drawn as a plain ribbon".to_owned()),
            None => (plain_name(*tool), format!("{}, plain", plain_name(*tool))),
        };
        // A brush may have the same name as a tool.
        let key = format!("{name}\n{}", paint.is_some());
        let row = match self.row_by_name.get(&key) {
            Some(&row) => row,
            None if self.rows.len() >= MOST_UNKNOWN => self.rows.len() - 1,
            None => {
                let name = if paint.is_some() { name.to_owned() } else { "(none)".to_owned() };
                self.rows.push((name, drawn_as));
                self.row_by_name.insert(key, self.rows.len() - 1);
                self.rows.len() - 1
            }
        };
        self.row_of.entry(*stroke).or_insert(row);
    }

    /// Returns the rows of a model, sorted by descending number of strokes.
    pub(super) fn rows(&self, scene: &Scene) -> Vec<BrushRow> {
        let mut rows: BTreeMap<(String, String), BrushRow> = BTreeMap::new();
        for stroke in scene.strokes().iter() {
            if stroke.is_taken_away() {
                continue;
            }
            let unpainted =
                || stroke.id().and_then(|id| self.row_of.get(&id)).map(|&row| self.rows[row].clone());
            let drawn = stroke.brush().map(|brush| (brush.name.clone(), drawn_as(brush))).or_else(unpainted);
            let is_stroke = drawn.is_some();
            let finished = || ("(none)".to_owned(), "finished polygons".to_owned());
            let row = rows.entry(drawn.unwrap_or_else(finished)).or_default();
            row.strokes += u64::from(is_stroke);
            row.hidden_strokes += u64::from(is_stroke && stroke.is_hidden());
            row.points += u64::from(stroke.point_count());
            row.polygons += stroke.polygon_ids().filter(|&id| scene.has_area(id)).count() as u64;
        }
        let named = |((brush, drawn_as), row)| BrushRow { brush, drawn_as, ..row };
        let mut rows: Vec<BrushRow> = rows.into_iter().map(named).collect();
        rows.sort_by_key(|row| std::cmp::Reverse(row.strokes));
        rows
    }
}

fn plain_name(tool: Tool) -> &'static str {
    match tool {
        Tool::Ribbon => "ribbon",
        Tool::Wall => "wall",
        Tool::Tube => "tube",
    }
}

/// Describes the shape, blending and lighting of a brush in words.
fn drawn_as(brush: &Brush) -> String {
    let form = match brush.family {
        Family::QuadStrip(_) => "ribbon",
        Family::Welded { .. } => "ribbon of shared edges",
        Family::Tube { .. } => "tube",
        Family::Hull { .. } => "convex hull",
        Family::WindowedHull => "chain of hulls",
        Family::Particles => "particles",
        Family::Spray { .. } => "spray",
        Family::BoxSection => "square tube",
        Family::ThickRibbon => "thick ribbon",
        Family::Slices => "slices",
    };
    let mixing = match brush.draw {
        Draw::Opaque => "opaque",
        Draw::Cutout => "cut-out",
        Draw::Additive => "additive",
        Draw::Blended => "blended",
    };
    let light = match brush.lighting {
        Lighting::Unlit => "unlit",
        Lighting::Lambert => "matte",
        Lighting::Specular { .. } => "glossy",
    };
    format!("{form}, {mixing}, {light}")
}

pub(super) fn table(rows: &[BrushRow]) -> String {
    let cells = rows.iter().map(|row| {
        let hidden = match row.hidden_strokes {
            0 => String::new(),
            hidden if hidden == row.strokes => "; hidden".to_owned(),
            hidden => format!("; {} of them hidden", thousands(hidden)),
        };
        let [strokes, points, polygons] = [row.strokes, row.points, row.polygons].map(thousands);
        let name = one_line(&row.brush).into_owned();
        vec![name, strokes, points, polygons, format!("{}{hidden}", row.drawn_as)]
    });
    output::table(&["brush", "strokes", "points", "polygons", "drawn as"], cells)
}
