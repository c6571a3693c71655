//! Clipping of convex polygons by planes, after I. E. Sutherland and G. W. Hodgman, "Reentrant Polygon Clipping", 1974.

use std::ops::{Add, Mul, Sub};

/// The side of a plane on which a corner reported by [`split_convex`] lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A corner of the polygon in front of the plane or on it.
    Front,
    /// A corner of the polygon behind the plane.
    Back,
    /// A new corner, at which an edge crosses the plane. It belongs to both parts.
    Crossing,
}

/// Visits the edges of a polygon in order. Stores the previous corner and its signed distance from a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edges<P> {
    from: P,
    distance: f64,
}

impl<P: Copy + Add<Output = P> + Sub<Output = P> + Mul<f64, Output = P>> Edges<P> {
    /// Begins at a polygon's last corner.
    pub(crate) fn after(last: P, distance: f64) -> Self {
        Self { from: last, distance }
    }

    /// The point at which the edge to the next corner crosses the plane, or `None`, and the side of the next corner.
    #[inline]
    pub(crate) fn next(&mut self, to: P, distance: f64) -> (Option<P>, Part) {
        let (from, a, b) = (self.from, self.distance, distance);
        let crossing = ((a < 0.0) != (b < 0.0)).then(|| from + (to - from) * (a / (a - b)));
        *self = Self { from: to, distance };
        (crossing, if b >= 0.0 { Part::Front } else { Part::Back })
    }
}

/// Divides a convex polygon by a plane. Reports the corners of both parts in order, at most two for each corner of the
/// polygon. `distance` is a corner's signed distance from the plane, in any unit, positive in front of the plane.
#[inline]
pub fn split_convex<P>(corners: &[P], distance: impl Fn(P) -> f64, mut report: impl FnMut(Part, P))
where
    P: Copy + Add<Output = P> + Sub<Output = P> + Mul<f64, Output = P>,
{
    let Some(&last) = corners.last() else { return };
    let mut edges = Edges::after(last, distance(last));
    for &to in corners {
        let (crossing, part) = edges.next(to, distance(to));
        if let Some(p) = crossing {
            report(Part::Crossing, p);
        }
        report(part, to);
    }
}

/// Clips a convex polygon by a plane. Reports the corners of the part in front of the plane, in order; see
/// [`split_convex`].
#[inline]
pub fn clip_convex<P>(corners: &[P], distance: impl Fn(P) -> f64, mut keep: impl FnMut(P))
where
    P: Copy + Add<Output = P> + Sub<Output = P> + Mul<f64, Output = P>,
{
    split_convex(corners, distance, |part, p| {
        if part != Part::Back {
            keep(p);
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use proptest::prelude::*;

    use super::*;

    fn area(corners: &[DVec2]) -> f64 {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(a, b)| 0.5 * a.perp_dot(*b)).sum()
    }

    proptest! {
        #[test]
        fn the_parts_lie_on_their_sides_and_make_up_the_whole(
            count in 3usize..12,
            turn in 0.0..6.3,
            at in -1.5..1.5,
        ) {
            let corner = |i: usize| DVec2::from_angle(i as f64 / count as f64 * std::f64::consts::TAU);
            let whole: Vec<DVec2> = (0..count).map(corner).collect();
            let normal = DVec2::from_angle(turn);
            let distance = |p: DVec2| normal.dot(p) - at;
            let (mut front, mut back) = (Vec::new(), Vec::new());
            split_convex(&whole, distance, |part, p| match part {
                Part::Front => front.push(p),
                Part::Back => back.push(p),
                Part::Crossing => {
                    front.push(p);
                    back.push(p);
                }
            });
            prop_assert!(front.iter().all(|&p| distance(p) >= -1.0e-12));
            prop_assert!(back.iter().all(|&p| distance(p) <= 1.0e-12));
            prop_assert!(front.len() + back.len() <= count + 4);
            prop_assert!((area(&front) + area(&back) - area(&whole)).abs() < 1.0e-12);
            let mut kept = Vec::new();
            clip_convex(&whole, distance, |p| kept.push(p));
            prop_assert_eq!(kept, front);
        }
    }

    #[test]
    fn a_corner_on_the_plane_is_in_front_and_nothing_is_added_there() {
        let triangle = [DVec2::ZERO, DVec2::X, DVec2::Y];
        let mut kept = Vec::new();
        clip_convex(&triangle, |p| p.x, |p| kept.push(p));
        assert_eq!(kept, triangle);
        clip_convex(&[], |p: DVec2| p.x, |_| panic!("nothing has no corners"));
    }
}
