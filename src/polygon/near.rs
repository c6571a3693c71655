//! The distance of a polygon from a point, and the intersection of a polygon with a box. Both are computed in `f64`, so
//! that they find no polygon that a box test in `f32` misses.

use glam::{DVec3, Vec3};

use super::ConvexPolygon;
use crate::math::Aabb;

impl ConvexPolygon {
    /// The triangles of the polygon, as in [`ConvexPolygon::meet`].
    fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let corners = self.vertices();
        (2..corners.len()).map(move |i| [corners[0], corners[i - 1], corners[i]].map(Vec3::as_dvec3))
    }

    /// The distance of a point from the polygon, metres; 0 for a point of the polygon.
    pub fn distance_m(&self, point: Vec3) -> f32 {
        let point = point.as_dvec3();
        let squared = self.triangles().map(|triangle| distance_squared(triangle, point));
        squared.fold(f64::INFINITY, f64::min).sqrt() as f32
    }

    /// Whether the polygon shares a point with a box; touching counts.
    pub fn touches(&self, bounds: &Aabb) -> bool {
        self.triangles().any(|triangle| is_in_box(triangle, bounds))
    }
}

/// The squared distance of a point from a triangle. The triangle may be a line or a point.
fn distance_squared([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let normal = (b - a).cross(c - a);
    let is_beside = |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && is_beside(a, b) && is_beside(b, c) && is_beside(c, a) {
        let along = (point - a).dot(normal);
        return along * along / normal.length_squared();
    }
    [(a, b), (b, c), (c, a)]
        .map(|(from, to)| {
            let edge = to - from;
            let length_squared = edge.length_squared();
            let t = if length_squared > 0.0 { (point - from).dot(edge) / length_squared } else { 0.0 };
            point.distance_squared(from + edge * t.clamp(0.0, 1.0))
        })
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// Whether a part of a triangle is left after clipping by the six faces of a box (Ivan Sutherland and Gary Hodgman,
/// "Reentrant Polygon Clipping", 1974).
fn is_in_box(triangle: [DVec3; 3], bounds: &Aabb) -> bool {
    let mut outline = triangle.to_vec();
    let mut cut = Vec::with_capacity(9);
    for axis in 0..3 {
        let faces = [(1.0, f64::from(bounds.min[axis])), (-1.0, f64::from(bounds.max[axis]))];
        for (sign, face) in faces {
            let inside_m = |p: DVec3| sign * (p[axis] - face);
            cut.clear();
            for (i, &to) in outline.iter().enumerate() {
                let from = outline[(i + outline.len() - 1) % outline.len()];
                let (before, here) = (inside_m(from), inside_m(to));
                if (before < 0.0 && here > 0.0) || (before > 0.0 && here < 0.0) {
                    let mut crossing = from + (to - from) * (before / (before - here));
                    crossing[axis] = face;
                    cut.push(crossing);
                }
                if here >= 0.0 {
                    cut.push(to);
                }
            }
            std::mem::swap(&mut outline, &mut cut);
        }
    }
    !outline.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_near_the_inside_an_edge_or_a_corner() {
        let square = ConvexPolygon::quad([Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        for (point, expected) in [
            (Vec3::new(0.25, 0.75, -2.0), 2.0),
            (Vec3::new(0.5, 0.5, 0.0), 0.0),
            (Vec3::new(4.0, 0.5, 4.0), 5.0),
            (Vec3::new(-3.0, -4.0, 0.0), 5.0),
        ] {
            assert!((square.distance_m(point) - expected).abs() < 1.0e-6, "{point}");
        }
        let line = ConvexPolygon::triangle(Vec3::ZERO, Vec3::X, Vec3::X * 2.0);
        assert_eq!(line.distance_m(Vec3::new(1.5, 3.0, 0.0)), 3.0);
        let dot = ConvexPolygon::triangle(Vec3::ONE, Vec3::ONE, Vec3::ONE);
        assert_eq!(dot.distance_m(Vec3::new(1.0, 1.0, 3.0)), 2.0);
    }

    #[test]
    fn a_polygon_whose_box_touches_need_not_touch() {
        let slanted = ConvexPolygon::triangle(Vec3::ZERO, Vec3::X, Vec3::Y);
        let corner = Aabb::new(Vec3::new(0.6, 0.6, -1.0), Vec3::ONE);
        assert!(slanted.bounds().intersects(&corner) && !slanted.touches(&corner));
        // The polygon meets a box just at a corner, at an edge and at a face. A box in its middle contains none of its
        // corners.
        assert!(slanted.touches(&Aabb::new(Vec3::new(0.5, 0.5, 0.0), Vec3::ONE)));
        assert!(slanted.touches(&Aabb::new(Vec3::new(1.0, -1.0, 0.0), Vec3::new(2.0, 0.0, 0.0))));
        assert!(slanted.touches(&Aabb::cube(Vec3::new(0.3, 0.3, 0.0), 0.1)));
        assert!(slanted.touches(&Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY)));
        assert!(!slanted.touches(&Aabb::cube(Vec3::new(0.3, 0.3, 1.0), 0.1)));
        assert!(!slanted.touches(&Aabb::EMPTY));
    }
}
