//! Conservative planes in `f32`: no rounding of the box test can put a point of the frustum behind them.
//!
//! **The bound.** The test of a box ([`crate::math`]) computes `s = ((n.x*x + n.y*y) + n.z*z) + d` at the corner of the box
//! that lies farthest along `n`. Let `p` be a point of the box that must not be lost. Let `q` be `p` with each coordinate
//! rounded along `n`. The coordinates of `q` are `f32`, and `q` lies in the box, because the corners of the box are `f32`,
//! too. Each step of the sum is monotone, so `s` is not less than the sum at `q`, and `n.q >= n.p`. With `u = 2^-24`, at
//! `q`
//! * a product and two sums are rounded for each axis: by at most `3 u |n_i q_i|`, and by less than the smallest normal
//!   number if something underflows;
//! * the last sum adds no error, because only its sign is used, which rounding never changes.
//!
//! So `s >= 0` if `n.p + d >= 3 u (|n_x p_x| + |n_y p_y| + |n_z p_z|)`, except for terms in `u^2`. The left side is linear
//! in `p` and the right side convex. So this holds in all of a frustum if it holds at the frustum's eight corners. The
//! corners determine `d`. Far corners need a larger `d` than near ones. Therefore the normal is first turned outwards by as
//! much as the bound grows with depth.
//!
//! **Overflow.** Let `M` be the largest `f32`. No product exceeds `M`, because `n` is a unit vector. If `n.x*x + n.y*y`
//! is below `-M`, then `|n.x| + |n.y| > 1`, so `|n.z|` is at most the root of a half. If `p` lies inside in spite of that,
//! `d` is at least `M (1 - |n.z|)`. So no sum overflows at a `p` inside if `d` is at most [`MOST_DISTANCE`].

use glam::{DVec3, DVec4, Vec3};

use super::{Aabb, Plane};

/// Half a unit in the last place of 1, `u`.
const UNIT: f64 = f32::EPSILON as f64 * 0.5;

/// Largest error of the box test, in `u` times the sum of the sizes of its terms: three, and a little for squares of `u`. A
/// longer proof shows that slightly more than half of this is enough: rounding the plane's distance up compensates for the
/// rounding of the final sum.
const ROUNDED: f64 = 3.001 * UNIT;

/// Outward turn of a normal for each unit by which the sum of the terms' sizes grows with depth. It is `5 u`: three for
/// [`ROUNDED`], one for the rounding of the normal, one as a reserve. With a smaller turn, planes lie farther out near
/// the eye; with a larger one, far from the eye.
const TURNED: f64 = 5.0 * UNIT;

/// Largest distance of a plane from the origin. The sums of a test of a farther plane may overflow.
const MOST_DISTANCE: f32 = 0.25 * f32::MAX;

/// A plane with all points on its inner side.
pub(crate) const EVERYTHING: Plane = Plane { normal: Vec3::ZERO, d: 0.0 };

/// The exact frustum, which all planes must contain: the hull of eight corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    /// A point near the eye, world space, metres. The corners and the depth are relative to it, so that they are exact far
    /// from the world's origin, too.
    pub(crate) origin: DVec3,
    /// Homogeneous coordinates: the point `xyz / w`, or the direction `xyz` if `w` is 0. `far[i]` is the far end of the
    /// edge that begins at `near[i]`.
    pub(crate) near: [DVec4; 4],
    pub(crate) far: [DVec4; 4],
    /// A function `xyz . p + w` that grows with the distance from the eye, or is constant.
    pub(crate) depth: DVec4,
}

impl Corners {
    /// A plane with the normal `side`, so far outwards that every box that touches the corners' hull passes a box test.
    /// Returns [`EVERYTHING`] if the normal is zero, the plane cuts the hull at infinity, or its numbers are too large.
    pub(crate) fn plane(&self, side: DVec3) -> Plane {
        let Some(unit) = side.try_normalize() else { return EVERYTHING };
        let growth = (0..4).map(|i| (unit * self.ray(i)).abs().element_sum()).fold(0.0, f64::max);
        let turned = unit + self.depth.truncate() * (growth * TURNED);
        let normal = turned.normalize_or_zero().as_vec3();
        let exact = normal.as_dvec3();
        let mut least = f64::NEG_INFINITY;
        for corner in self.near.iter().chain(&self.far) {
            let terms = exact * (corner.truncate() + self.origin * corner.w);
            let missing = terms.abs().element_sum() * ROUNDED - terms.element_sum();
            if corner.w > 0.0 && !missing.is_nan() {
                least = least.max(missing / corner.w);
            } else if missing > 0.0 || missing.is_nan() {
                return EVERYTHING; // The plane cuts the hull far out, or a number is NaN.
            }
        }
        plane_at(normal, least)
    }

    /// Movement of a point from a near to a far corner while the depth grows by one; zero if the depth does not grow.
    fn ray(&self, i: usize) -> DVec3 {
        let (near, far) = (self.near[i], self.far[i]);
        let deeper = self.depth.dot(far) * near.w - self.depth.dot(near) * far.w;
        let ray = (far * near.w - near * far.w).truncate() / deeper;
        if ray.is_finite() { ray } else { DVec3::ZERO }
    }
}

/// The plane `side.xyz . p + side.w = 0` with a unit normal, moved outwards so far that every box within `bounds` that
/// touches its inner side passes a box test.
pub(super) fn plane_within(side: DVec4, bounds: &Aabb) -> Plane {
    let (unit, normal) = (side.truncate(), side.truncate().as_vec3());
    let exact = normal.as_dvec3();
    let far = bounds.min.abs().max(bounds.max.abs()).as_dvec3();
    let turned = (unit - exact).abs().dot(far);
    plane_at(normal, side.w + exact.abs().dot(far) * ROUNDED + turned + side.w.abs() * SIDE_ERROR)
}

/// Largest error of the distance of a plane in `f64`, relative to this distance.
const SIDE_ERROR: f64 = 16.0 * f64::EPSILON;

/// The plane at a distance of at least `least` from the origin; [`EVERYTHING`] if it is too far away.
fn plane_at(normal: Vec3, least: f64) -> Plane {
    let d = round_up(least + f64::from(f32::MIN_POSITIVE));
    if normal.is_finite() && d.abs() <= MOST_DISTANCE { Plane { normal, d } } else { EVERYTHING }
}

/// The least `f32` that is not less than `v`.
pub(super) fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DQuat};

    use super::*;
    use crate::math::Frustum;

    /// A plane of a hull that is one point.
    fn plane_through(p: Vec3, normal: DVec3) -> Plane {
        let corner = p.as_dvec3().extend(1.0);
        let corners = Corners { origin: DVec3::ZERO, near: [corner; 4], far: [corner; 4], depth: DVec4::W };
        corners.plane(normal)
    }

    /// A step of Knuth's linear congruential generator, as a number from -1 to 1.
    fn next(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// The hull is one point, so its distance from the plane is the margin alone.
    #[test]
    fn a_plane_through_a_point_excludes_no_box_around_it() {
        let mut state = 1;
        let mut nearest = f64::INFINITY;
        for i in 0..2_000_000 {
            let mut vector = |scale: f64| DVec3::from_array([(); 3].map(|()| next(&mut state) * scale));
            let scale = [1.0, 1.0, 1.0e3, 1.0e6, 1.0e12, 1.0e-38, 1.0e-43][i % 7];
            let (mut p, mut normal) = (vector(scale).as_vec3(), vector(1.0));
            if i % 7 == 0 {
                // The products are just above a half, and their sum is 1 except for a few last bits. No sum is rounded by
                // more, and no plane's distance by less.
                normal = DVec3::new(1.0, 1.0, 0.0) + normal * DVec3::new(1.0e-3, 1.0e-3, 1.0e-3);
                let n = normal.normalize().as_vec3().as_dvec3();
                let (x, z) = (std::f32::consts::FRAC_1_SQRT_2 + 1.0e-3 * p.x, p.z * 1.0e-3);
                let sum = 1.0 + next(&mut state).abs() * 4.0 * UNIT;
                p = Vec3::new(x, ((sum - n.x * f64::from(x) - n.z * f64::from(z)) / n.y) as f32, z);
            }
            let plane = plane_through(p, normal);
            let bounds = Aabb::new(p, p);
            assert!(Frustum::new([plane; 6]).may_see(&bounds), "{p} {plane:?}");
            // The part of the margin that was used.
            let terms = (plane.normal.as_dvec3() * p.as_dvec3()).abs().element_sum();
            if scale >= 1.0 {
                nearest = nearest.min(f64::from(plane.signed_distance(p)) / (terms * ROUNDED));
            }
        }
        assert!(nearest < 0.34, "a smaller margin would do: {nearest} is left of it");
    }

    /// If the terms cancel, the plane lies near the origin. Rounding its distance from the origin up then moves it by almost
    /// nothing, so the rounding of `may_see` uses half of the margin.
    #[test]
    fn where_terms_cancel_a_plane_needs_half_of_its_margin() {
        let mut state = 3;
        let mut nearest = f64::INFINITY;
        for _ in 0..100_000 {
            let mut any = || next(&mut state);
            let normal = DVec3::new(1.0 + 0.2 * any(), 0.5 + 0.2 * any(), 1.0 + 0.2 * any());
            let n = normal.normalize().as_vec3().as_dvec3();
            // The first product, the sum with the second and the third product are each rounded down by nearly `u`.
            let terms = [1.0 + 0.97 * UNIT, 0.97 * UNIT, -1.0 - 1.03 * UNIT];
            let p = Vec3::from_array([0, 1, 2].map(|axis| (terms[axis] / n[axis]) as f32));
            let plane = plane_through(p, normal);
            assert!(Frustum::new([plane; 6]).may_see(&Aabb::new(p, p)), "{p} {plane:?}");
            let sizes = (plane.normal.as_dvec3() * p.as_dvec3()).abs().element_sum();
            nearest = nearest.min(f64::from(plane.signed_distance(p)) / (sizes * ROUNDED));
        }
        assert!(nearest < 0.53, "a smaller margin would do: {nearest} is left of it");
    }

    /// Points of the clip space of a matrix in `f64`, in the smallest boxes around them. If the eye is far away, the same
    /// matrix in `f32` has another view.
    #[test]
    fn the_frustum_of_a_double_matrix_holds_what_the_matrix_shows() {
        let mut state = 2;
        let mut lost_in_single = 0;
        for i in 0..3000 {
            let mut vector = |scale: f64| DVec3::from_array([(); 3].map(|()| next(&mut state) * scale));
            let (turn, eye) = (vector(3.0), vector(10.0_f64.powi(i % 7)));
            let turn = DQuat::from_euler(glam::EulerRot::YXZ, turn.x, turn.y, turn.z);
            let view_from_world = DMat4::from_rotation_translation(turn, eye).inverse();
            let (near, far, lowest) = (0.1, 50.0, [0.0, -1.0][i as usize % 2]);
            // Depth from `lowest` to 1.
            let slope = (far - lowest * near) / (near - far);
            let clip_from_view = DMat4::from_cols(
                DVec4::X,
                DVec4::Y * 1.7,
                DVec4::new(0.0, 0.0, slope, -1.0),
                DVec4::new(0.0, 0.0, near * (slope - lowest), 0.0),
            );
            let clip_from_world = clip_from_view * view_from_world;
            let frustum = Frustum::from_double_matrix(&clip_from_world, lowest);
            let single = Frustum::from_double_matrix(&clip_from_world.as_mat4().as_dmat4(), lowest);
            let world_from_clip = clip_from_world.inverse();
            for side in 0..40 {
                let mut clip = vector(1.0);
                // The points lie on the sides, moved inwards by the possible error of `f64`.
                clip[side % 2] = clip[side % 2].signum() * (1.0 - 1.0e-9);
                clip.z = 1.0 - (1.0 - lowest) * clip.z.abs();
                let p = world_from_clip.project_point3(clip);
                let up = |p: DVec3| Vec3::new(round_up(p.x), round_up(p.y), round_up(p.z));
                let bounds = Aabb::new(-up(-p), up(p));
                assert!(frustum.may_see(&bounds), "{eye} {clip}");
                lost_in_single += u32::from(!single.may_see(&bounds));
            }
        }
        assert!(lost_in_single > 0, "the matrix in single precision would do");
    }

    #[test]
    fn numbers_are_rounded_up() {
        for (v, rounded) in [
            (1.0, 1.0),
            (1.0 + 1.0e-12, 1.0 + f32::EPSILON),
            (-1.0 - 1.0e-12, -1.0),
            (0.1, 0.1),
            (-0.1, (-0.1f32).next_up()),
            (1.0e-60, f32::from_bits(1)),
            (1.0e60, f32::INFINITY),
            (-1.0e60, f32::MIN),
        ] {
            assert_eq!(round_up(v), rounded, "{v}");
        }
    }
}
