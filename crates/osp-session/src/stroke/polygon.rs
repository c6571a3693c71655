use glam::Vec3;

use super::Drops;
use osp::{
    math::{COORDINATE_LIMIT_M, is_flat_and_convex},
    polygon::ConvexPolygon,
};

/// A polygon is degenerate (a needle or a point) if its area is below this fraction of its longest edge squared. A
/// larger fraction would drop thin ribbons.
const DEGENERATE_AREA_M2_PER_M2: f32 = 1.0e-6;

fn longest_edge_squared(polygon: &ConvexPolygon) -> f32 {
    let v = polygon.vertices();
    (0..v.len()).map(|i| v[i].distance_squared(v[(i + 1) % v.len()])).fold(0.0, f32::max)
}

/// Appends the polygon. A polygon that is degenerate or out of range is counted instead.
pub(crate) fn push_checked(polygon: ConvexPolygon, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
    if polygon.vertices().iter().any(|p| !(p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M)) {
        drops.out_of_range += 1;
    } else if polygon.area_m2() > DEGENERATE_AREA_M2_PER_M2 * longest_edge_squared(&polygon) {
        out.push(polygon);
    } else {
        drops.degenerate += 1;
    }
}

/// Appends a quad: one polygon if it is planar and convex, else two triangles along its shorter diagonal.
pub(crate) fn push_quad([a, b, c, d]: [Vec3; 4], out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
    if is_flat_and_convex([a, b, c, d]) {
        push_checked(ConvexPolygon::quad([a, b, c, d]), out, drops);
        return;
    }
    let halves = if a.distance_squared(c) <= b.distance_squared(d) {
        [ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(a, c, d)]
    } else {
        [ConvexPolygon::triangle(a, b, d), ConvexPolygon::triangle(b, c, d)]
    };
    let before = *drops;
    for half in halves {
        push_checked(half, out, drops);
    }
    // A quad without any polygon counts as one dropped polygon, not two.
    drops.degenerate = drops.degenerate.min(before.degenerate + 1);
    drops.out_of_range = drops.out_of_range.min(before.out_of_range + 1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quad_is_one_polygon_only_if_no_corner_of_it_turns_in() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        for inward in 0..4 {
            // One corner lies beyond the diagonal of its neighbours; an area of three eighths remains.
            let mut arrow = square;
            arrow[inward] = arrow[inward].lerp(arrow[(inward + 2) % 4], 0.625);
            let (mut out, mut drops) = (Vec::new(), Drops::default());
            push_quad(arrow, &mut out, &mut drops);
            assert_eq!((out.len(), drops), (2, Drops::default()), "corner {inward}");
            let area: f32 = out.iter().map(ConvexPolygon::area_m2).sum();
            assert!((area - 0.375).abs() < 1.0e-6, "corner {inward}: {area} square metres");
            out.clear();
            push_quad(square, &mut out, &mut drops);
            assert_eq!(out.len(), 1);
        }
    }
}
