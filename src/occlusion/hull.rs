//! A convex polygon inside the picture of a patch of polygons.
//!
//! # Why it is inside
//! The polygons of a patch share edges bit for bit. Their outlines, taken the same way round, add up to one closed line,
//! the patch's border, because shared edges cancel. The border's winding number around a point x of the picture is the sum
//! over the polygons. If this sum is not zero, at least one polygon covers x. (The proof does not name the polygon.
//! Polygons need not be flat, need not turn one side towards the eye, and may overlap.)
//!
//! The border is cut into a few pieces. Take a piece from p to q, and a line parallel to p q. Let x be on one side of the
//! line and all of the piece on the other. For x the piece is then the same as the straight segment p q. If x is to the
//! left of every such segment, the polygon of segments winds around x at least once. So does the border. Therefore the area
//! to the left of all these parallels is covered, and convex.

use glam::DVec2;

use super::shadow_volume::MAX_SIDES;
use crate::math::clip_convex;

/// Largest number of pieces of the border.
const MAX_PIECES: usize = 8;

/// The border is cut at a bulge if the bulge's triangle has at least this fraction of the patch's area.
const WORTH_A_PIECE: f64 = 0.02;

/// A corner of the result is cut off if its triangle has less than this fraction of the result's area. Each corner would
/// add a shadow plane.
const WORTH_A_CORNER: f64 = 0.01;

/// All half-planes are moved inwards by this fraction of the patch's size, a hundred thousand times the rounding of the
/// crossing of two lines. (The rounding of the picture itself, some 20 times 1.1e-16 at tangents up to 10, does not shrink
/// with the patch. [`super::QUERY_SLACK`] covers it.)
const INWARDS: f64 = 1.0e-10;

/// Largest number of corners during the construction: a rectangle cut by every piece.
const MAX_CORNERS: usize = 4 + MAX_PIECES;

/// A convex polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hull {
    len: usize,
    corners: [DVec2; MAX_CORNERS],
}

/// A piece of the border, from one corner to another.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    from: usize,
    /// The last corner. The number continues beyond the list if the piece crosses the beginning of the list.
    to: usize,
    /// The corner that bulges out farthest, and twice the area of its triangle.
    bulge: (usize, f64),
}

impl Hull {
    const EMPTY: Self = Self { len: 0, corners: [DVec2::ZERO; MAX_CORNERS] };

    /// The corners, counterclockwise; none for an empty hull.
    pub(super) fn corners(&self) -> &[DVec2] {
        &self.corners[..self.len]
    }

    pub(super) fn area(&self) -> f64 {
        area(self.corners())
    }

    /// The convex polygon inside a patch with this border. The border has to turn counterclockwise.
    pub(super) fn inside(border: &[DVec2]) -> Self {
        let low = border.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
        let high = border.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
        let size = (high - low).max_element();
        let total = area(border);
        let is_usable = border.len() >= 3 && size.is_finite() && total > 0.0;
        if !is_usable {
            return Self::EMPTY;
        }
        let mut hull = Self::EMPTY;
        hull.len = 4;
        hull.corners[..4].copy_from_slice(&[low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)]);
        let (pieces, count) = cut_into_pieces(border, total);
        for piece in &pieces[..count] {
            hull.keep_inside_piece(border, piece, INWARDS * size);
        }
        hull.drop_small_corners();
        hull
    }

    /// Keeps the part of the hull that a piece of the border does not cross. The patch lies to the left of the piece.
    fn keep_inside_piece(&mut self, border: &[DVec2], piece: &Piece, inwards: f64) {
        let at = |i: usize| border[i % border.len()];
        let (p, q) = (at(piece.from), at(piece.to));
        let along = (q - p).normalize_or_zero();
        if along == DVec2::ZERO {
            // A piece that returns to its beginning has no side.
            self.len = 0;
            return;
        }
        let reaches_in = (piece.from..=piece.to).map(|i| along.perp_dot(at(i) - p)).fold(0.0, f64::max);
        self.keep_left_of(p, along, reaches_in + inwards);
    }

    /// Keeps the part of the hull that lies at least `inwards` to the left of a line.
    fn keep_left_of(&mut self, p: DVec2, along: DVec2, inwards: f64) {
        let side = |x: DVec2| along.perp_dot(x - p) - inwards;
        let mut kept = Self::EMPTY;
        let mut is_too_long = false;
        clip_convex(self.corners(), side, |x| {
            is_too_long |= kept.len == MAX_CORNERS;
            if !is_too_long {
                kept.corners[kept.len] = x;
                kept.len += 1;
            }
        });
        *self = if is_too_long || kept.len < 3 { Self::EMPTY } else { kept };
    }

    /// Removes corners with small triangles. This is safe, because a convex polygon without one of its corners is smaller.
    fn drop_small_corners(&mut self) {
        let mut whole = self.area();
        while self.len > 3 {
            let cost = |i: usize| {
                let [a, b, c] = [self.len - 1, 0, 1].map(|k| self.corners[(i + k) % self.len]);
                0.5 * (b - a).perp_dot(c - b).abs()
            };
            let (mut cheapest, mut least) = (0, f64::INFINITY);
            for i in 0..self.len {
                if cost(i) < least {
                    (cheapest, least) = (i, cost(i));
                }
            }
            if least > WORTH_A_CORNER * whole && self.len <= MAX_SIDES {
                return;
            }
            whole -= least;
            self.corners.copy_within(cheapest + 1..self.len, cheapest);
            self.len -= 1;
        }
    }
}

/// Cuts a border where it bulges out farthest, beginning with two corners far from each other.
fn cut_into_pieces(border: &[DVec2], total: f64) -> ([Piece; MAX_PIECES], usize) {
    let n = border.len();
    let farthest_from = |p: DVec2| {
        let (mut best, mut most) = (0, -1.0);
        for (i, q) in border.iter().enumerate() {
            let distance = p.distance_squared(*q);
            if distance > most {
                (best, most) = (i, distance);
            }
        }
        best
    };
    let first = farthest_from(border[0]);
    let second = farthest_from(border[first]);
    let (low, high) = (first.min(second), first.max(second));
    let mut pieces = [Piece::default(); MAX_PIECES];
    pieces[0] = piece(border, low, high);
    pieces[1] = piece(border, high, low + n);
    let mut count = 2;
    while count < MAX_PIECES {
        let (mut widest, mut most) = (0, 2.0 * WORTH_A_PIECE * total);
        for (k, piece) in pieces[..count].iter().enumerate() {
            if piece.bulge.1 > most {
                (widest, most) = (k, piece.bulge.1);
            }
        }
        if most <= 2.0 * WORTH_A_PIECE * total {
            break;
        }
        let Piece { from, to, bulge: (corner, _) } = pieces[widest];
        pieces[widest] = piece(border, from, corner);
        pieces[count] = piece(border, corner, to);
        count += 1;
    }
    (pieces, count)
}

fn piece(border: &[DVec2], from: usize, to: usize) -> Piece {
    let at = |i: usize| border[if i < border.len() { i } else { i - border.len() }];
    let (p, q) = (at(from), at(to));
    let mut bulge = (from, 0.0);
    for i in from + 1..to {
        let cut_off = (at(i) - p).perp_dot(q - p);
        if cut_off > bulge.1 {
            bulge = (i, cut_off);
        }
    }
    Piece { from, to, bulge }
}

/// Area of a polygon, positive if it turns counter-clockwise.
pub(super) fn area(corners: &[DVec2]) -> f64 {
    let Some(&tip) = corners.first() else { return 0.0 };
    0.5 * corners.windows(2).map(|w| (w[0] - tip).perp_dot(w[1] - tip)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of quads: its border, and the quads.
    fn strip(n: usize, mut at: impl FnMut(f64) -> [DVec2; 2]) -> (Vec<DVec2>, Vec<[DVec2; 4]>) {
        let rungs: Vec<[DVec2; 2]> = (0..=n).map(|i| at(i as f64 / n as f64)).collect();
        let right = rungs.iter().map(|r| r[1]);
        let left = rungs.iter().rev().map(|r| r[0]);
        let quads = rungs.windows(2).map(|w| [w[0][0], w[0][1], w[1][1], w[1][0]]).collect();
        (right.chain(left).collect(), quads)
    }

    fn covers(quads: &[[DVec2; 4]], x: DVec2) -> bool {
        quads.iter().any(|quad| {
            [[0, 1, 2], [0, 2, 3]].iter().any(|t| {
                let [a, b, c] = t.map(|k| quad[k]);
                let s = [(b - a).perp_dot(x - a), (c - b).perp_dot(x - b), (a - c).perp_dot(x - c)];
                s.iter().all(|s| *s >= -1.0e-12) || s.iter().all(|s| *s <= 1.0e-12)
            })
        })
    }

    #[test]
    fn a_straight_strip_is_found_whole() {
        let (border, _) = strip(8, |t| [DVec2::new(t * 4.0, 1.0), DVec2::new(t * 4.0, 0.0)]);
        let hull = Hull::inside(&border);
        assert_eq!(hull.corners().len(), 4);
        assert!((hull.area() - 4.0).abs() < 1.0e-6, "{}", hull.area());
    }

    #[test]
    fn a_round_patch_is_found_nearly_whole() {
        let border: Vec<DVec2> =
            (0..40).map(|i| DVec2::from_angle(f64::from(i) * 0.157_079_632_679)).collect();
        let hull = Hull::inside(&border);
        assert!(hull.area() > 0.85 * area(&border), "{} of {}", hull.area(), area(&border));
    }

    #[test]
    fn a_bent_strip_is_found_in_part_and_never_more() {
        for bend in [0.05, 0.3, 0.8, 1.5, 3.0] {
            let (border, quads) = strip(12, |t| {
                let ray = DVec2::from_angle(-bend * t).perp();
                [ray * 2.2, ray * 1.8]
            });
            let hull = Hull::inside(&border);
            assert!(bend > 1.0 || hull.area() > 0.0, "{bend}");
            for i in 0..hull.corners().len() {
                let (a, b) = (hull.corners()[i], hull.corners()[(i + 1) % hull.corners().len()]);
                for t in [0.0, 0.3, 0.5, 0.9] {
                    assert!(covers(&quads, a.lerp(b, t)), "{bend}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn random_strips_cover_what_is_said_to_be_inside() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut found = 0;
        for _ in 0..3000 {
            let n = 2 + (random().abs() * 20.0) as usize;
            let wild = 0.05 + random().abs() * 2.0;
            let (border, quads) = strip(n, |t| {
                let x = t * n as f64 * 0.5;
                let jitter = DVec2::new(random(), random()) * wild;
                [DVec2::new(x, 1.0) + jitter, DVec2::new(x, 0.0) + DVec2::new(random(), random()) * wild]
            });
            let hull = Hull::inside(&border);
            found += usize::from(hull.area() > 0.1);
            let corners = hull.corners();
            for i in 0..corners.len() {
                for k in 0..corners.len() {
                    let x = corners[i].lerp(corners[k], random() + 0.5);
                    assert!(covers(&quads, x), "{x} {border:?}");
                }
            }
        }
        assert!(found > 500, "{found}");
    }

    /// Rounding moves a corner by 1e-16 of the patch's size. The hull keeps away from the border by more than that, but not
    /// much.
    #[test]
    fn a_hull_keeps_a_little_away_from_the_border() {
        for turn in 0..50 {
            let (x, size) = (DVec2::from_angle(f64::from(turn)), 3.0);
            let border = [DVec2::ZERO, x, x + x.perp(), x.perp()].map(|p| p * size);
            let hull = Hull::inside(&border);
            assert_eq!(hull.corners().len(), 4);
            for i in 0..4 {
                let (p, along) = (border[i], (border[(i + 1) % 4] - border[i]).normalize());
                let clear =
                    hull.corners().iter().map(|c| along.perp_dot(*c - p)).fold(f64::INFINITY, f64::min);
                assert!(clear > 0.5 * INWARDS * size && clear < 3.0 * INWARDS * size, "{turn}: {clear}");
            }
        }
    }

    #[test]
    fn degenerate_borders_have_nothing_inside() {
        let p = DVec2::new(1.0, 2.0);
        assert_eq!(Hull::inside(&[]).corners().len(), 0);
        assert_eq!(Hull::inside(&[p]).corners().len(), 0);
        assert_eq!(Hull::inside(&[p, p, p, p]).corners().len(), 0);
        let nan = DVec2::splat(f64::NAN);
        assert_eq!(Hull::inside(&[p, nan, nan, p]).area(), 0.0);
    }
}
