//! Planes in `f32` that cut off nothing of what they are meant to hold, whatever the box test rounds.
//!
//! **The bound.** The test of a box ([`crate::math`]) computes `s = ((n.x*x + n.y*y) + n.z*z) + d` at the box's corner
//! that lies farthest along `n`. Let `p` be a point of the box that must not be lost. Each step of the sum is monotone, so
//! `s` is no less than what it would be at any `f32` point of the box; take `q`, `p` with each coordinate rounded, which
//! is one, since the box's corners are. With `u = 2^-24`:
//! * `q` for `p` costs at most `u |n_i p_i|` on each axis;
//! * two products and two sums are rounded: at most `3 u |n_i q_i|` on each axis, and less than the smallest normal number
//!   where something underflows;
//! * the last sum costs nothing, because only its sign is looked at, which rounding never changes.
//!
//! So `s >= 0` if `n.p + d >= 4 u (|n_x p_x| + |n_y p_y| + |n_z p_z|)`, but for terms in `u^2`. The left side is linear in
//! `p` and the right one convex: it holds in all of a frustum if it holds at its eight corners. So `d` is chosen. Far
//! corners want a large `d`, near ones would get more of it than they need; so the normal is first turned outwards by as
//! much as the bound grows with depth.

use glam::{DVec3, DVec4};

use super::Plane;

/// Half a unit in the last place of 1, `u`.
const UNIT: f64 = f32::EPSILON as f64 * 0.5;

/// What the box test may be wrong by, in `u` times the sum of its terms' sizes: four, and a little for squares of `u`.
const ROUNDED: f64 = 4.001 * UNIT;

/// How much a normal is turned, in `u` times the growth of the terms' sizes with depth: what [`ROUNDED`] and the rounding
/// of the normal itself may come to. Smaller: planes lie farther out near the eye. Larger: farther out in the distance.
const TURNED: f64 = 6.0 * UNIT;

/// A plane that has everything on its inner side.
pub(super) const EVERYTHING: Plane = Plane { normal: glam::Vec3::ZERO, d: 0.0 };

/// What a frustum has to hold: the hull of its corners, exactly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    /// Homogeneous: divided by `w`, or a direction where `w` is 0. In the same order as those of `far`.
    pub(crate) near: [DVec4; 4],
    pub(crate) far: [DVec4; 4],
    /// A function `xyz . p + w` that grows with the distance from the eye, or is the same everywhere.
    pub(crate) depth: DVec4,
}

impl Corners {
    /// The plane `side.xyz . p + side.w = 0`, whose inner side holds the corners but for rounding, moved outwards until no
    /// box test can exclude a box that shares a point with their hull. [`EVERYTHING`] if it is no plane, or not finite.
    pub(crate) fn plane(&self, side: DVec4) -> Plane {
        let Some(unit) = side.truncate().try_normalize() else { return EVERYTHING };
        let growth = (0..4).map(|i| (unit * self.ray(i)).abs().element_sum()).fold(0.0, f64::max);
        let turned = unit + self.depth.truncate() * (growth * TURNED);
        let normal = turned.normalize_or_zero().as_vec3();
        let exact = normal.as_dvec3();
        let mut least = f64::NEG_INFINITY;
        for corner in self.near.iter().chain(&self.far) {
            let terms = exact * corner.truncate();
            let missing = terms.abs().element_sum() * ROUNDED - terms.element_sum();
            if corner.w > 0.0 && !missing.is_nan() {
                least = least.max(missing / corner.w);
            } else if missing > 0.0 || missing.is_nan() {
                return EVERYTHING; // It cuts the hull far out, or nobody knows.
            }
        }
        let d = round_up(least + f64::from(f32::MIN_POSITIVE));
        if normal.is_finite() && d.is_finite() { Plane { normal, d } } else { EVERYTHING }
    }

    /// How a point moves on the line from a near to a far corner while the depth grows by one; nowhere if it does not grow.
    fn ray(&self, i: usize) -> DVec3 {
        let (near, far) = (self.near[i], self.far[i]);
        let deeper = self.depth.dot(far) * near.w - self.depth.dot(near) * far.w;
        let ray = (far * near.w - near * far.w).truncate() / deeper;
        if ray.is_finite() { ray } else { DVec3::ZERO }
    }
}

/// The least `f32` that is no less.
pub(super) fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}
