//! Convex cones with their tip in the eye, given by the directions of their edges: clipping and measuring.

use glam::DVec3;

use crate::math::{Part, split_convex};

/// A range of an array of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: u32,
    pub(super) len: u32,
}

impl Span {
    pub(super) fn range(self) -> std::ops::Range<usize> {
        let start = self.start as usize;
        start..start + self.len as usize
    }
}

/// Smallest and largest distance of some directions from a plane through the eye.
#[inline]
pub(super) fn reach(normal: DVec3, directions: &[DVec3]) -> (f64, f64) {
    directions.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
        let d = normal.dot(*p);
        (low.min(d), high.max(d))
    })
}

/// Appends the part of a cone in front of a plane through the eye (`normal . x >= 0`) to the end of `points`.
/// New edges get unit length. Fewer than three directions mean that nothing is left.
pub(super) fn clip(points: &mut Vec<DVec3>, cone: Span, normal: DVec3) -> Span {
    let (start, most) = (points.len(), 2 * cone.len as usize);
    points.resize(start + most, DVec3::ZERO);
    let (old, new) = points.split_at_mut(start);
    let mut count = 0;
    split_convex(
        &old[cone.range()],
        |p| normal.dot(p),
        |part, p| {
            if part != Part::Back {
                new[count] = if part == Part::Crossing { p.normalize_or_zero() } else { p };
                count += 1;
            }
        },
    );
    points.truncate(start + count);
    Span { start: start as u32, len: count as u32 }
}

/// Splits a cone by a plane through the eye into the part in front of it and the part behind it: two calls of [`clip`]
/// in one.
pub(super) fn split(points: &mut Vec<DVec3>, cone: Span, normal: DVec3) -> (Span, Span) {
    let (start, most) = (points.len(), 2 * cone.len as usize);
    points.resize(start + 2 * most, DVec3::ZERO);
    let (old, new) = points.split_at_mut(start);
    let (front, back) = new.split_at_mut(most);
    let (mut fronts, mut backs) = (0, 0);
    split_convex(
        &old[cone.range()],
        |p| normal.dot(p),
        |part, p| {
            let p = if part == Part::Crossing { p.normalize_or_zero() } else { p };
            if part != Part::Back {
                front[fronts] = p;
                fronts += 1;
            }
            if part != Part::Front {
                back[backs] = p;
                backs += 1;
            }
        },
    );
    new.copy_within(most..most + backs, fronts);
    points.truncate(start + fronts + backs);
    let front = Span { start: start as u32, len: fronts as u32 };
    (front, Span { start: front.start + front.len, len: backs as u32 })
}

/// Whether a narrow cone of unit directions has about this solid angle, steradians, or more.
pub(super) fn has_area(directions: &[DVec3], least_sr: f64) -> bool {
    let [first, rest @ ..] = directions else { return false };
    let twice =
        rest.windows(2).map(|w| (w[0] - *first).cross(w[1] - *first)).fold(DVec3::ZERO, |sum, v| sum + v);
    twice.length_squared() >= 4.0 * least_sr * least_sr
}
