//! Convex cones with their apex at the eye, stored as the directions of their edges. They are clipped and measured
//! here.

use glam::DVec3;

use crate::math::{Edges, Part};

/// A range of an array of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// Index of the first direction.
    pub start: u32,
    /// Number of directions.
    pub len: u32,
}

impl Span {
    /// The same range as an index of a slice.
    pub fn range(self) -> std::ops::Range<usize> {
        let start = self.start as usize;
        start..start + self.len as usize
    }
}

/// Smallest and largest distance of some directions from a plane through the eye.
#[inline]
pub fn reach(normal: DVec3, directions: &[DVec3]) -> (f64, f64) {
    directions.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
        let d = normal.dot(*p);
        (low.min(d), high.max(d))
    })
}

/// Appends the part of a cone in front of a plane through the eye (`normal . x >= 0`) to the end of `points`. New edges get
/// unit length. A span of fewer than three directions is an empty part.
pub fn clip(points: &mut Vec<DVec3>, cone: Span, normal: DVec3) -> Span {
    let start = points.len() as u32;
    let range = cone.range();
    let last = points[range.end - 1];
    let mut edges = Edges::after(last, normal.dot(last));
    for i in range {
        let to = points[i];
        let (crossing, part) = edges.next(to, normal.dot(to));
        if let Some(p) = crossing {
            points.push(p.normalize_or_zero());
        }
        if part == Part::Front {
            points.push(to);
        }
    }
    Span { start, len: points.len() as u32 - start }
}

/// Splits a cone by a plane through the eye into the part in front of the plane and the part behind it. The result is that
/// of two calls of [`clip`].
pub(super) fn split(points: &mut Vec<DVec3>, cone: Span, normal: DVec3) -> (Span, Span) {
    // Most cones have four to eight edges; a rare large one takes the slower path.
    const ROOM: usize = 16;
    if cone.len as usize + 2 > ROOM {
        return (clip(points, cone, normal), clip(points, cone, -normal));
    }
    let (mut behind, mut count) = ([DVec3::ZERO; ROOM], 0);
    let mut keep_behind = |p| {
        if count < ROOM {
            behind[count] = p;
            count += 1;
        }
    };
    let start = points.len() as u32;
    let range = cone.range();
    let last = points[range.end - 1];
    let mut edges = Edges::after(last, normal.dot(last));
    for i in range {
        let to = points[i];
        let (crossing, part) = edges.next(to, normal.dot(to));
        if let Some(p) = crossing {
            let p = p.normalize_or_zero();
            points.push(p);
            keep_behind(p);
        }
        if part == Part::Front {
            points.push(to);
        } else {
            keep_behind(to);
        }
    }
    let front = Span { start, len: points.len() as u32 - start };
    points.extend_from_slice(&behind[..count]);
    (front, Span { start: start + front.len, len: count as u32 })
}

/// Whether a narrow cone of unit directions has a solid angle of about `least_sr` steradians or more.
pub fn has_area(directions: &[DVec3], least_sr: f64) -> bool {
    let [first, rest @ ..] = directions else { return false };
    let twice =
        rest.windows(2).map(|w| (w[0] - *first).cross(w[1] - *first)).fold(DVec3::ZERO, |sum, v| sum + v);
    twice.length_squared() >= 4.0 * least_sr * least_sr
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_of_any_number_of_edges_is_split_as_by_two_cuts() {
        for count in 3..40_u32 {
            let edge = |i: u32| {
                let (y, x) = libm::sincos(f64::from(i) / f64::from(count) * std::f64::consts::TAU);
                DVec3::new(x, y, 2.0).normalize()
            };
            for turn in 0..10 {
                let normal = edge(turn) * 0.1 + DVec3::new(0.9, f64::from(turn) * 0.3, -0.2);
                let mut points: Vec<DVec3> = (0..count).map(edge).collect();
                let cone = Span { start: 0, len: count };
                let (front, behind) = split(&mut points, cone, normal);
                let cuts = [clip(&mut points, cone, normal), clip(&mut points, cone, -normal)];
                for (part, cut) in [front, behind].into_iter().zip(cuts) {
                    assert!(part.len >= 3, "{count} edges, {turn}");
                    let apart = points[part.range()].iter().zip(&points[cut.range()]);
                    assert_eq!(part.len, cut.len);
                    assert!(
                        apart.into_iter().all(|(a, b)| a.distance(*b) < 1.0e-12),
                        "{count} edges, {turn}"
                    );
                }
            }
        }
    }
}
