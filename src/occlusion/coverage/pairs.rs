//! Joins neighbouring triangles to quads, so that the same surface has half as many facets.
//!
//! A quad has the outline of its two triangles, so it has the same degree at each point. The proof in [`super`] holds for
//! the quad even if the triangles are not in one plane.

use super::{
    super::raster::Raster,
    facet::{Facet, SHARED, turn},
    facets::{Facets, Seen},
    surfaces::Surfaces,
    table::NONE,
};

/// Triangles are joined only if the quad's bound keeps at least this share of their reciprocal depth. Two
/// triangles in one plane lose nothing. Any share is safe, as the quad's plane lies behind both.
const LEAST_LEFT: f64 = 0.995;

/// A side that two triangles share: its number in the first triangle, the second triangle, and its number in the second
/// triangle.
#[derive(Clone, Copy)]
struct Pair {
    side: usize,
    mate: usize,
    mate_side: usize,
}

impl Facets {
    /// Joins triangles in pairs, each along its longest side that allows it.
    pub(super) fn join_triangles(&mut self, surfaces: &Surfaces, raster: &Raster) {
        for i in 0..self.taken {
            if self.facets[i].is_triangle() {
                let mut best = (0, None);
                for side in 0..3 {
                    let length = self.facets[i].length_squared(side);
                    if length > best.0
                        && let Some(pair) = self.pair(i, side)
                    {
                        best = (length, Some(pair));
                    }
                }
                if let Some(pair) = best.1 {
                    self.join(i, pair, surfaces, raster);
                }
            }
        }
    }

    /// The neighbour at a side, if the two triangles together have a convex outline.
    fn pair(&self, i: usize, side: usize) -> Option<Pair> {
        let own = &self.facets[i];
        let mate = own.mates[side];
        let other = self.facets.get(mate as usize).filter(|other| other.is_triangle())?;
        let mates = &other.mates[..3];
        let mate_side = mates.iter().position(|&mate| mate as usize == i)?;
        let is_once = mates.iter().filter(|&&mate| mate as usize == i).count() == 1;
        let at = |facet: &Facet, corner: usize| facet.corner(corner % 3).map(i64::from);
        let (from, to) = (at(own, side), at(own, side + 1));
        let (apex, other_apex) = (at(own, side + 2), at(other, mate_side + 2));
        let is_convex = turn(other_apex, to, apex) >= 0 && turn(apex, from, other_apex) >= 0;
        (is_once && is_convex).then_some(Pair { side, mate: mate as usize, mate_side })
    }

    /// Replaces the first triangle of a pair by a quad, unless the quad's depth would be too imprecise.
    fn join(&mut self, i: usize, pair: Pair, surfaces: &Surfaces, raster: &Raster) {
        let Pair { side, mate, mate_side } = pair;
        let (own, other) = (self.facets[i], self.facets[mate]);
        let mut quad = own;
        if own.has_plane || other.has_plane {
            // The plane of one is pushed back to the corner of the other.
            let (plane_of, beyond) = if own.has_plane {
                (own, self.start_of(&other, mate_side + 2, surfaces))
            } else {
                (other, self.start_of(&own, side + 2, surfaces))
            };
            let left = plane_of.depth_ratio(beyond, raster);
            if left < LEAST_LEFT {
                return;
            }
            quad.plane = plane_of.plane.map(|v| v * left);
            quad.has_plane = true;
        }
        quad.end = own.end.min(other.end);
        let parts = [(&own, side + 1), (&own, side + 2), (&other, mate_side + 1), (&other, mate_side + 2)];
        for (k, (facet, corner)) in parts.into_iter().enumerate() {
            quad.edges[k] = facet.edges[corner % 3];
            quad.mates[k] = facet.mates[corner % 3];
        }
        quad.set_corners(parts.iter().map(|(facet, corner)| facet.corner(corner % 3)));
        quad.len = 4;
        self.facets[i] = quad;
        self.facets[mate].len = 0;
        // Pixels that the quad hides count for both triangles.
        self.facets[mate].half = i as u32;
        for k in [mate_side + 1, mate_side + 2] {
            if let Some(next) = self.facets.get_mut(other.mates[k % 3] as usize) {
                next.mates
                    .iter_mut()
                    .filter(|other| **other as usize == mate)
                    .for_each(|other| *other = i as u32);
            }
        }
    }

    /// The corner at which a side of a triangle begins, counterclockwise in the picture.
    fn start_of(&self, facet: &Facet, side: usize, surfaces: &Surfaces) -> &Seen {
        let corner = surfaces.directed(facet.edges[side % 3])[usize::from(facet.is_turned)];
        &self.seen[self.seen_of[corner as usize] as usize]
    }
}

impl Facet {
    /// Whether the facet is a whole triangle that the near plane has not cut.
    fn is_triangle(&self) -> bool {
        self.len == 3 && self.half == NONE && self.edges[..3].iter().all(|&edge| edge < SHARED)
    }

    fn length_squared(&self, side: usize) -> i64 {
        let [a, b] = [side, (side + 1) % 3].map(|corner| self.corner(corner).map(i64::from));
        (a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2)
    }

    /// Divides a corner's reciprocal depth by the plane's at the corner's pixel. The ratio is at most 1. The slack of
    /// [`Facet::depths`] exceeds the rounding error.
    fn depth_ratio(&self, seen: &Seen, raster: &Raster) -> f64 {
        let at = raster.flat_in_pixels(seen.eye.x / seen.eye.z, seen.eye.y / seen.eye.z);
        let [base, by_x, by_y] = self.plane;
        let plane = base + by_x * at.x + by_y * at.y;
        if plane > 0.0 { (seen.nearness / plane).min(1.0) } else { 0.0 }
    }
}
