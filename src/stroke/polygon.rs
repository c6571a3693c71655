use glam::Vec3;

use super::Drops;
use crate::{
    math::{COORDINATE_LIMIT_M, DEGENERATE_AREA_M2_PER_M2, is_flat_and_convex},
    polygon::ConvexPolygon,
};

impl ConvexPolygon {
    fn longest_edge_squared(&self) -> f32 {
        let v = self.vertices();
        (0..v.len()).map(|i| v[i].distance_squared(v[(i + 1) % v.len()])).fold(0.0, f32::max)
    }

    /// Appends the polygon unless it is degenerate or out of range, which is counted.
    pub(crate) fn push_checked(self, out: &mut Vec<Self>, drops: &mut Drops) {
        if self.vertices().iter().any(|p| !(p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M)) {
            drops.out_of_range += 1;
        } else if self.area_m2() > DEGENERATE_AREA_M2_PER_M2 * self.longest_edge_squared() {
            out.push(self);
        } else {
            drops.degenerate += 1;
        }
    }

    /// Appends a quad as one polygon if it is flat and convex, as two triangles along its shorter diagonal if not.
    pub(crate) fn push_quad([a, b, c, d]: [Vec3; 4], out: &mut Vec<Self>, drops: &mut Drops) {
        if is_flat_and_convex([a, b, c, d]) {
            Self::quad([a, b, c, d]).push_checked(out, drops);
            return;
        }
        let halves = if a.distance_squared(c) <= b.distance_squared(d) {
            [Self::triangle(a, b, c), Self::triangle(a, c, d)]
        } else {
            [Self::triangle(a, b, d), Self::triangle(b, c, d)]
        };
        let before = *drops;
        for half in halves {
            half.push_checked(out, drops);
        }
        // A quad of which nothing is left is one polygon dropped, not two.
        drops.degenerate = drops.degenerate.min(before.degenerate + 1);
        drops.out_of_range = drops.out_of_range.min(before.out_of_range + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quad_is_one_polygon_only_if_no_corner_of_it_turns_in() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        for inward in 0..4 {
            // The corner is drawn beyond the diagonal of its neighbours: what is left is three eighths.
            let mut arrow = square;
            arrow[inward] = arrow[inward].lerp(arrow[(inward + 2) % 4], 0.625);
            let (mut out, mut drops) = (Vec::new(), Drops::default());
            ConvexPolygon::push_quad(arrow, &mut out, &mut drops);
            assert_eq!((out.len(), drops), (2, Drops::default()), "corner {inward}");
            let area: f32 = out.iter().map(ConvexPolygon::area_m2).sum();
            assert!((area - 0.375).abs() < 1.0e-6, "corner {inward}: {area} square metres");
            out.clear();
            ConvexPolygon::push_quad(square, &mut out, &mut drops);
            assert_eq!(out.len(), 1);
        }
    }
}
