use glam::{Vec2, Vec3};

use crate::brush::{self, Brush, Surface};
use osp::polygon::ConvexPolygon;

/// The part of a cut-out polygon, in its plane, whose texture is opaque at every mip level: a strip between two lines
/// along the stroke. `None` if no such strip exists.
pub(super) fn solid_part(
    polygon: &ConvexPolygon,
    surface: &Surface,
    brush: &'static Brush,
) -> Option<ConvexPolygon> {
    let vertices = polygon.vertices();
    let alpha = surface.alpha_bytes();
    if surface.is_facing() || (0..vertices.len()).any(|i| alpha[i] < u8::MAX) {
        return None;
    }
    let uv = |i: usize| surface.uv(i);
    let range = |of: fn(Vec2) -> f32| {
        let values = (0..vertices.len()).map(|i| of(uv(i)));
        values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let (solid_low, solid_high) = brush::solid_across(brush, range(|uv| uv.x), range(|uv| uv.y))?;
    // Lines of constant `v` bend at the diagonal of a quad, so the strip is reduced by a small margin.
    let margin = 0.02 * (solid_high - solid_low);
    let (low, high) = (solid_low + margin, solid_high - margin);
    let at = |i: usize, k: usize, v: f32| {
        let (from, to) = (uv(i).y, uv(k).y);
        vertices[i].lerp(vertices[k], ((v - from) / (to - from)).clamp(0.0, 1.0))
    };
    let is_near = |i: usize, k: usize| (uv(i).y - uv(k).y).abs() < 1.0e-3;
    let part = match vertices.len() {
        3 => {
            // Two corners lie on one side of the stroke, the third on the other.
            let apex = (0..3).find(|&i| is_near((i + 1) % 3, (i + 2) % 3) && !is_near(i, (i + 1) % 3))?;
            let (a, b) = ((apex + 1) % 3, (apex + 2) % 3);
            ConvexPolygon::quad([at(apex, a, low), at(apex, b, low), at(apex, b, high), at(apex, a, high)])
        }
        4 => {
            // One side of the stroke joins corners `a` and `b`, the other `c` and `d`.
            let first = (0..2).find(|&i| is_near(i, i + 1) && is_near((i + 2) % 4, (i + 3) % 4))?;
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| (first + i) % 4);
            if is_near(a, d) {
                return None;
            }
            let corners = [at(a, d, low), at(b, c, low), at(b, c, high), at(a, d, high)];
            let is_solid = |p: Vec3| (solid_low..=solid_high).contains(&v_at(vertices, surface, p));
            if !corners.into_iter().chain(crossings(&corners, [vertices[0], vertices[2]])).all(is_solid) {
                return None;
            }
            ConvexPolygon::quad(corners)
        }
        _ => return None,
    };
    (part.area_vector() != Vec3::ZERO).then_some(part)
}

/// The texture coordinate across the stroke at a point of a quad, which is drawn as triangles 0 1 2 and 0 2 3.
fn v_at(vertices: &[Vec3], surface: &Surface, p: Vec3) -> f32 {
    let normal = (vertices[2] - vertices[0]).cross(vertices[3] - vertices[1]);
    let across = normal.cross(vertices[2] - vertices[0]);
    let is_first = across.dot(p - vertices[0]) * across.dot(vertices[1] - vertices[0]) >= 0.0;
    let places = if is_first { [0, 1, 2] } else { [0, 2, 3] };
    let [a, b, c] = places.map(|i| vertices[i]);
    let whole = (b - a).cross(c - a).dot(normal);
    let of_b = (p - a).cross(c - a).dot(normal) / whole;
    let of_c = (b - a).cross(p - a).dot(normal) / whole;
    let [va, vb, vc] = places.map(|i| surface.uv(i).y);
    va + (vb - va) * of_b + (vc - va) * of_c
}

/// Points at which the edges of a polygon cross a line segment in its plane.
fn crossings(corners: &[Vec3; 4], [from, to]: [Vec3; 2]) -> impl Iterator<Item = Vec3> {
    let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
    let across = normal.cross(to - from);
    let corners = *corners;
    (0..4).filter_map(move |i| {
        let (p, q) = (corners[i], corners[(i + 1) % 4]);
        let (a, b) = (across.dot(p - from), across.dot(q - from));
        ((a < 0.0) != (b < 0.0)).then(|| p.lerp(q, a / (a - b)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::{Pcg64, rand_core::Rng};

    fn marker() -> &'static Brush {
        brush::find("Marker").expect("a brush of the table")
    }

    fn band(from: f32, to: f32, alpha: [f32; 4]) -> Surface {
        Surface::flat([(from, 0.0), (from, 1.0), (to, 1.0), (to, 0.0)].map(Vec2::from), alpha)
    }

    #[test]
    fn the_middle_of_a_marker_hides_and_its_rim_does_not() {
        let quad = [Vec3::ZERO, Vec3::Y, Vec3::X + Vec3::Y, Vec3::X];
        let surface = band(0.1, 0.3, [1.0; 4]);
        let part = solid_part(&ConvexPolygon::quad(quad), &surface, marker()).expect("a solid middle");
        let ys = part.vertices().iter().map(|p| p.y);
        let (low, high) = ys.fold((1.0f32, 0.0f32), |(low, high), y| (low.min(y), high.max(y)));
        assert!(low > 0.01 && low < 0.2 && high > 0.8 && high < 0.99, "{low} to {high}");
        assert!(part.area_m2() > 0.6 && part.vertices().iter().all(|p| (0.0..=1.0).contains(&p.x)));
        // A quad with a faded end is not solid.
        let faded = band(0.1, 0.3, [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(solid_part(&ConvexPolygon::quad(quad), &faded, marker()), None);
        // One half of a quad that is not planar.
        let half = ConvexPolygon::triangle(quad[0], quad[1], quad[2]);
        let part = solid_part(&half, &surface.with_corners([0, 1, 2, 2]), marker()).expect("a solid middle");
        let normal = half.area_vector();
        for i in 0..3 {
            let (from, to) = (half.vertices()[i], half.vertices()[(i + 1) % 3]);
            let is_inside = |p: &Vec3| (to - from).cross(*p - from).dot(normal) >= -1.0e-6;
            assert!(part.vertices().iter().all(is_inside), "{part:?}");
        }
    }

    #[test]
    fn a_part_of_any_quad_is_solid_all_over() {
        let mut random = Pcg64::new(5, 1);
        let mut number = || random.next_u32() as f32 / u32::MAX as f32;
        let mut found = 0;
        for _ in 0..2000 {
            let quad = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(x, y): (f32, f32)| {
                Vec3::new(x + 0.3 * (0.5 - x) * number(), y + 0.3 * (0.5 - y) * number(), 0.0)
            });
            let u = number();
            let surface = band(u, u + 0.2, [1.0; 4]);
            let Some(part) = solid_part(&ConvexPolygon::quad(quad), &surface, marker()) else { continue };
            found += 1;
            let (low, high) = brush::solid_across(marker(), (u, u + 0.2), (0.0, 1.0)).expect("solid");
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| part.vertices()[i]);
            for _ in 0..20 {
                let (s, t) = (number(), number());
                let v = v_at(&quad, &surface, a.lerp(b, s).lerp(d.lerp(c, s), t));
                assert!((low - 1.0e-4..=high + 1.0e-4).contains(&v), "{v} not in {low} to {high}");
            }
        }
        assert!(found > 200, "{found}");
    }
}
