use glam::{DVec3, Vec2, Vec3};

use super::{
    Drops, Pieces, Sample, StrokeSettings,
    convex_hull::ConvexHull,
    frame,
    knots::{Knots, Spacing, Step},
};
use crate::{
    brush::{Brush, Surface},
    recording::NormalRule,
};
use osp::{math::COORDINATE_LIMIT_M, polygon::ConvexPolygon};

/// A point that lies outside the hull by at most this distance is ignored; metres at scale 1.
pub(super) const TOLERANCE_M: f64 = 1.0e-6;

/// Builds the convex hull of the first sample and of half balls around the further samples. A half ball points in the
/// direction of travel.
#[derive(Clone, Debug)]
pub struct HullBuilder {
    brush: &'static Brush,
    width_m: f32,
    is_faceted: bool,
    has_begun: bool,
    knots: Knots,
    /// The direction of the width at the last kept sample.
    side: Option<Vec3>,
    /// Hull of the kept samples.
    hull: ConvexHull,
    /// Whether a provisional end is drawn. `hull` does not contain this end.
    is_end_drawn: bool,
}

impl HullBuilder {
    pub fn new(settings: &StrokeSettings, brush: &'static Brush, is_faceted: bool) -> Self {
        let spacing = Spacing { length_m: brush.min_length_m, part_of_size: 0.0 };
        Self {
            brush,
            width_m: settings.width_m,
            is_faceted,
            has_begun: false,
            knots: Knots::new(settings, brush, spacing),
            side: None,
            hull: ConvexHull::new(TOLERANCE_M * f64::from(settings.scale)),
            is_end_drawn: false,
        }
    }

    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let is_first = !std::mem::replace(&mut self.has_begun, true);
        let Some(step) = self.knots.push(sample, drops) else {
            if is_first {
                insert(&mut self.hull, &[sample.position.as_dvec3()], drops);
            }
            return;
        };
        let points = self.half_ball(&step);
        if step.is_kept {
            let is_changed = insert(&mut self.hull, &points, drops);
            if is_changed || self.is_end_drawn {
                self.draw(&self.hull, out);
            }
            self.is_end_drawn = false;
        } else if points.iter().any(|&point| self.hull.has_outside(point)) {
            let mut with_end = self.hull.clone();
            insert(&mut with_end, &points, drops);
            self.draw(&with_end, out);
            self.is_end_drawn = true;
        } else if std::mem::take(&mut self.is_end_drawn) {
            self.draw(&self.hull, out);
        }
    }

    pub fn finish(&mut self, out: &Pieces, drops: &mut Drops) {
        let has_moved = self.side.is_some();
        drops.degenerate += u64::from(has_moved && out.is_empty());
    }

    /// Points of a half ball around the sample: the tip, and two rings of four points.
    fn half_ball(&mut self, step: &Step) -> [DVec3; 9] {
        let (sample, travel) = (step.to.sample, step.travel);
        let middle = sample.position.as_dvec3();
        if travel == Vec3::ZERO {
            return [middle; 9];
        }
        let side = frame::side(NormalRule::Travel, &sample, travel, self.side);
        if step.is_kept || self.side.is_none() {
            self.side = Some(side);
        }
        let radius_m = 0.5 * f64::from(self.width_m) * f64::from(self.brush.size(sample.pressure));
        let [tip, side] = [travel, side].map(|v| v.as_dvec3().normalize_or_zero() * radius_m);
        let up = tip.cross(side) / radius_m.max(f64::MIN_POSITIVE);
        let mut points = [middle + tip; 9];
        for (i, outwards) in [side, up, -side, -up].into_iter().enumerate() {
            points[1 + i] = middle + (tip + outwards) * std::f64::consts::FRAC_1_SQRT_2;
            points[5 + i] = middle + outwards;
        }
        points
    }

    /// Replaces all polygons by those of a hull.
    fn draw(&self, hull: &ConvexHull, out: &mut Pieces) {
        out.truncate(0);
        draw_hull(hull, self.is_faceted, out);
    }
}

/// Appends the triangles of a hull. Triangles without area in `f32` are skipped; this leaves no visible hole.
pub(super) fn draw_hull(hull: &ConvexHull, is_faceted: bool, out: &mut Pieces) {
    let mut nothing = Drops::default();
    if is_faceted {
        for corners in hull.triangles() {
            let [a, b, c] = corners.map(|corner| corner.as_vec3());
            out.push(ConvexPolygon::triangle(a, b, c), Surface::PLAIN, &mut nothing);
        }
        return;
    }
    for (corners, normals) in hull.triangles().zip(hull.smooth_normals()) {
        let [a, b, c] = corners.map(|corner| corner.as_vec3());
        let [n, o, p] = normals.map(|normal| normal.normalize_or_zero().as_vec3());
        let surface = Surface::smooth([n, o, p, p], [Vec2::ZERO; 4], [1.0; 4]);
        out.push(ConvexPolygon::triangle(a, b, c), surface, &mut nothing);
    }
}

/// Adds the points that are in range to a hull, and counts the others. Returns whether the hull has changed.
pub(super) fn insert(hull: &mut ConvexHull, points: &[DVec3], drops: &mut Drops) -> bool {
    let mut is_changed = false;
    for &point in points {
        // A NaN fails the first comparison, too.
        if point.abs().max_element() <= f64::from(COORDINATE_LIMIT_M) && point.is_finite() {
            is_changed |= hull.insert(point);
        } else {
            drops.out_of_range += 1;
        }
    }
    is_changed
}
