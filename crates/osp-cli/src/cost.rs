//! The parts of a sketch that cost most to draw, for `osp info --cost`.

use std::{cmp::Reverse, collections::BTreeMap};

use glam::{DQuat, DVec3, Vec3};
use serde::Serialize;

use super::output::{one_line, table};
use osp::{math::clip_convex, view::View};
use osp_lab::report::thousands;
use osp_session::{
    brush::Draw,
    scene::{Scene, Stroke},
};

/// Length of the list of expensive strokes.
const MOST_STROKES: usize = 10;

/// Counts of the polygons that a headset draws: all visible ones with an area.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Cost {
    triangles: u64,
    vertices: u64,
    budget_triangles: u64,
    /// Number of blended triangles, which belong to brushes that add light, or to transparent paint.
    blended_triangles: u64,
    /// Average number of blended polygons that cover a pixel of the artist's view. The headset shades each of them,
    /// because blended polygons do not hide polygons.
    blended_layers: f64,
    brushes: Vec<BrushCost>,
    /// The strokes with the most triangles.
    most_expensive_strokes: Vec<StrokeCost>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct BrushCost {
    brush: String,
    strokes: u64,
    polygons: u64,
    triangles: u64,
    vertices: u64,
    is_blended: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct StrokeCost {
    /// The stroke's number. `None` for polygons that belong to no stroke.
    stroke: Option<u32>,
    brush: String,
    triangles: u64,
    /// The stroke's share of all triangles, from 0 to 1.
    share: f64,
}

impl Cost {
    /// Computes the cost of a model in its artist's `view`.
    pub(super) fn of(scene: &Scene, view: &View, budget_triangles: u64) -> Self {
        let window = Window::of(view);
        let up = osp::math::rotate(view.world_from_view, Vec3::Y);
        let mut brushes = BTreeMap::<(String, bool), BrushCost>::new();
        let mut strokes = Vec::new();
        let mut blended_layers = 0.0;
        for stroke in scene.strokes().iter().filter(|stroke| stroke.is_visible()) {
            let brush = stroke.brush().map_or("(none)", |brush| &brush.name);
            let is_blended = is_blended(stroke);
            let row = brushes.entry((brush.to_owned(), is_blended)).or_default();
            row.strokes += 1;
            let mut triangles = 0;
            for id in stroke.polygon_ids().filter(|&id| scene.has_area(id)) {
                let polygon = scene.polygon_from(id, view.eye_in_world, up);
                let corners = polygon.vertices();
                row.polygons += 1;
                row.vertices += corners.len() as u64;
                triangles += corners.len() as u64 - 2;
                if is_blended {
                    blended_layers += window.part_covered_by(corners);
                }
            }
            row.triangles += triangles;
            strokes.push((triangles, stroke.id().map(|id| id.0), brush));
        }
        let named = |((brush, is_blended), row)| BrushCost { brush, is_blended, ..row };
        let mut brushes: Vec<BrushCost> = brushes.into_iter().map(named).collect();
        brushes.sort_by_key(|row| Reverse(row.triangles));
        let triangles = brushes.iter().map(|row| row.triangles).sum();
        strokes.sort_by_key(|&(triangles, ..)| Reverse(triangles));
        let most_expensive =
            strokes.into_iter().take(MOST_STROKES).map(|(of_stroke, stroke, brush)| StrokeCost {
                stroke,
                brush: brush.to_owned(),
                triangles: of_stroke,
                share: part(of_stroke, triangles),
            });
        Self {
            triangles,
            vertices: brushes.iter().map(|row| row.vertices).sum(),
            budget_triangles,
            blended_triangles: brushes.iter().filter(|row| row.is_blended).map(|row| row.triangles).sum(),
            blended_layers,
            most_expensive_strokes: most_expensive.collect(),
            brushes,
        }
    }

    pub(super) fn lines(&self) -> Vec<String> {
        let percent = |part: f64| format!("{:.1} %", 100.0 * part);
        let of_budget = part(self.triangles, self.budget_triangles);
        let verdict = match self.triangles.saturating_sub(self.budget_triangles) {
            0 => "within it".to_owned(),
            over => format!("{} over it", thousands(over)),
        };
        let mut lines = vec![
            format!(
                "  {:<11} {} triangles, {} vertices; {} of the budget of {} triangles, {verdict}",
                "cost",
                thousands(self.triangles),
                thousands(self.vertices),
                percent(of_budget),
                thousands(self.budget_triangles),
            ),
            format!(
                "  {:<11} {} triangles; {:.2} layers over each pixel of the artist's view, on average",
                "blended",
                thousands(self.blended_triangles),
                self.blended_layers,
            ),
        ];
        let rows = self.brushes.iter().map(|row| {
            let blended = if row.is_blended { "blended" } else { "" };
            let counts = [row.strokes, row.polygons, row.triangles, row.vertices].map(thousands);
            let share = percent(part(row.triangles, self.triangles));
            let [strokes, polygons, triangles, vertices] = counts;
            vec![
                one_line(&row.brush).into_owned(),
                strokes,
                polygons,
                triangles,
                vertices,
                share,
                blended.to_owned(),
            ]
        });
        lines.push(table(&["brush", "strokes", "polygons", "triangles", "vertices", "share", ""], rows));
        if !self.most_expensive_strokes.is_empty() {
            let rows = self.most_expensive_strokes.iter().map(|row| {
                let stroke = row.stroke.map_or("(none)".to_owned(), |stroke| stroke.to_string());
                let brush = one_line(&row.brush).into_owned();
                vec![stroke, thousands(row.triangles), percent(row.share), brush]
            });
            lines.push(table(&["expensive stroke", "triangles", "share", "brush"], rows));
        }
        lines
    }
}

fn part(of: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { of as f64 / whole as f64 }
}

/// Whether the stroke is blended, so that polygons behind it are visible.
fn is_blended(stroke: &Stroke) -> bool {
    match stroke.brush().map(|brush| brush.draw) {
        Some(draw) => matches!(draw, Draw::Additive | Draw::Blended),
        None => stroke.color().3 < 1.0,
    }
}

/// The image plane of a view.
struct Window {
    eye: DVec3,
    view_from_world: DQuat,
    left: f64,
    right: f64,
    bottom: f64,
    top: f64,
    near_m: f64,
}

impl Window {
    fn of(view: &View) -> Self {
        let osp::view::Projection { left, right, bottom, top, near_m, .. } = view.projection;
        let [left, right, bottom, top, near_m] = [left, right, bottom, top, near_m].map(f64::from);
        let view_from_world = view.world_from_view.as_dquat().conjugate();
        Self { eye: view.eye_in_world.as_dvec3(), view_from_world, left, right, bottom, top, near_m }
    }

    /// Returns the share of the image, from 0 to 1, that a convex polygon covers. Ignores other polygons in front of
    /// it.
    fn part_covered_by(&self, corners: &[Vec3]) -> f64 {
        let in_view = corners.iter().map(|p| self.view_from_world * (p.as_dvec3() - self.eye));
        let mut polygon: Vec<DVec3> = in_view.collect();
        let borders: [&dyn Fn(DVec3) -> f64; 5] = [
            &|p| -p.z - self.near_m,
            &|p| p.x + self.left * p.z,
            &|p| -self.right * p.z - p.x,
            &|p| p.y + self.bottom * p.z,
            &|p| -self.top * p.z - p.y,
        ];
        for border in borders {
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            clip_convex(&polygon, border, |p| kept.push(p));
            polygon = kept;
        }
        let flat: Vec<_> = polygon.iter().map(|p| p.truncate() / -p.z).collect();
        let next = flat.iter().cycle().skip(1);
        let area = flat.iter().zip(next).map(|(a, b)| 0.5 * a.perp_dot(*b)).sum::<f64>().abs();
        let covered = area / ((self.right - self.left) * (self.top - self.bottom));
        // The area of a polygon at infinity is not finite. It counts as 0.
        if covered.is_finite() { covered.min(1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::view::Projection;

    #[test]
    fn a_polygon_covers_its_part_of_the_window() {
        let view = View::look_at(Vec3::Z * 2.0, Vec3::ZERO, Projection::symmetric(90.0, 1.0, 0.1, 100.0));
        let window = Window::of(&view);
        let square = |half: f32, z: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| Vec3::new(x * half, y * half, z))
        };
        for (half, z, expected) in [(1.0, 0.0, 0.25), (2.0, 0.0, 1.0), (9.0, 0.0, 1.0), (1.0, 3.0, 0.0)] {
            let covered = window.part_covered_by(&square(half, z));
            assert!((covered - expected).abs() < 1.0e-6, "{half} at {z}: {covered}");
        }
        // Half of the floor is behind the eye, and half of the rest is beside the window.
        let floor =
            [(-9.0, 9.0), (0.0, 9.0), (0.0, -1.0e6), (-9.0, -1.0e6)].map(|(x, z)| Vec3::new(x, -0.5, z));
        let covered = window.part_covered_by(&floor);
        assert!(covered > 0.2 && covered < 0.2501, "the lower left quarter, nearly: {covered}");
        assert_eq!(window.part_covered_by(&square(f32::INFINITY, 0.0)), 0.0);
    }
}
