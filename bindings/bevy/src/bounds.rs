//! Converts Bevy's volumes to osp's: a box in world space that is never smaller, and a frustum that is never narrower.
//!
//! Bevy tests an oriented box (and the sphere around it) against the planes, in `f32`. An entity whose box in the index
//! is behind one of these planes must fail that test, too. With exact numbers it fails, because the box contains the
//! oriented box. [`MARGIN`] and [`LEAST_MARGIN_M`] cover the rounding errors of both tests. Bevy's crates and osp have
//! different versions of glam, so numbers are passed as arrays.

use bevy_camera::primitives::{Aabb, Frustum, Sphere};
use bevy_math::{Vec3A, primitives::ViewFrustum};
use bevy_transform::components::GlobalTransform;
use osp::{
    glam::Vec3,
    math::{Aabb as WorldBox, Frustum as OspFrustum, Plane},
};

/// Fraction of a coordinate, an extent or a plane's distance by which a box is enlarged or a plane is moved outwards.
/// Each of the two tests rounds less than sixteen times. Each rounding is at most 2^-24 of a number not larger than the
/// coordinate, extent or distance.
const MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// Margin in metres that is added to each coordinate, extent and distance, for numbers so small that their products
/// underflow.
const LEAST_MARGIN_M: f32 = 1.0e-30;

/// Limit in metres of boxes and planes for the index. Beyond it, products of their numbers could overflow.
const FARTHEST_M: f32 = 1.0e15;

/// Largest difference from 1 of the squared length of a plane's normal for which the index tests the plane.
const UNIT_TOLERANCE: f32 = 1.0e-5;

/// Returns the box of an entity in world space. `None` without a finite box; Bevy's own test must then decide.
#[inline]
pub(crate) fn world_box(
    transform: &GlobalTransform,
    aabb: Option<&Aabb>,
    sphere: Option<&Sphere>,
) -> Option<WorldBox> {
    match (aabb, sphere) {
        (Some(aabb), _) => {
            let world_from_local = transform.affine();
            let half = aabb.half_extents.abs();
            let matrix = world_from_local.matrix3;
            let reach =
                matrix.x_axis.abs() * half.x + matrix.y_axis.abs() * half.y + matrix.z_axis.abs() * half.z;
            box_around(world_from_local.transform_point3a(aabb.center), reach)
        }
        // Bevy treats this component as a sphere in world space.
        (None, Some(sphere)) => box_around(sphere.center, Vec3A::splat(sphere.radius.abs())),
        (None, None) => None,
    }
}

#[inline]
fn box_around(center: Vec3A, reach: Vec3A) -> Option<WorldBox> {
    let reach = reach + (center.abs() + reach) * MARGIN + LEAST_MARGIN_M;
    let (min, max) = (center - reach, center + reach);
    // A NaN fails the comparisons.
    let is_near = min.cmpgt(Vec3A::splat(-FARTHEST_M)) & max.cmplt(Vec3A::splat(FARTHEST_M));
    is_near.all().then(|| WorldBox::new(Vec3::from(min.to_array()), Vec3::from(max.to_array())))
}

/// The planes by which Bevy culls for a camera on the CPU: all but the far plane.
pub(crate) const CAMERA_PLANES: [usize; 5] = [0, 1, 2, 3, ViewFrustum::NEAR_PLANE_IDX];

/// The planes by which Bevy culls for a cascade: all but the near plane.
#[cfg(feature = "light")]
pub(crate) const CASCADE_PLANES: [usize; 5] = [0, 1, 2, 3, ViewFrustum::FAR_PLANE_IDX];

/// The planes by which Bevy culls for a spot light.
#[cfg(feature = "light")]
pub(crate) const ALL_PLANES: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Returns a frustum with the sides of a cube slightly larger than a sphere. If the sphere is not finite, the frustum
/// contains everything.
#[cfg(feature = "light")]
pub(crate) fn cube_around(sphere: &Sphere) -> OspFrustum {
    let Some(cube) = box_around(sphere.center, Vec3A::splat(sphere.radius)) else {
        return OspFrustum::everything();
    };
    OspFrustum::new(std::array::from_fn(|i| {
        let normal = if i < 3 { Vec3::AXES[i] } else { -Vec3::AXES[i - 3] };
        Plane { normal, d: if i < 3 { -cube.min[i] } else { cube.max[i - 3] } }
    }))
}

/// Returns the frustum for the index, with the planes `used` of Bevy's frustum.
pub(crate) fn osp_frustum(frustum: &Frustum, used: &[usize]) -> OspFrustum {
    let mut planes = *OspFrustum::everything().planes();
    for (plane, number) in planes.iter_mut().zip(used) {
        let half_space = &frustum.half_spaces[*number];
        let (normal, d) = (half_space.normal(), half_space.d());
        let is_unit = (normal.length_squared() - 1.0).abs() < UNIT_TOLERANCE;
        // Otherwise the plane keeps its initial value, which excludes nothing.
        if is_unit && d.abs() < FARTHEST_M {
            let normal = Vec3::from(normal.to_array());
            *plane = Plane { normal, d: d + d.abs() * MARGIN + LEAST_MARGIN_M };
        }
    }
    OspFrustum::new(planes)
}

#[cfg(test)]
mod tests {
    use bevy_math::{Affine3A, Mat3, Vec3 as BevyVec3, Vec4, primitives::HalfSpace};
    use rand_pcg::{
        Pcg64Mcg,
        rand_core::{Rng, SeedableRng},
    };

    use super::*;

    fn unit(random: &mut Pcg64Mcg) -> f32 {
        random.next_u32() as f32 / u32::MAX as f32
    }

    fn signed(random: &mut Pcg64Mcg) -> f32 {
        unit(random) * 2.0 - 1.0
    }

    fn vector(random: &mut Pcg64Mcg) -> BevyVec3 {
        BevyVec3::new(signed(random), signed(random), signed(random))
    }

    /// Returns numbers over many orders of magnitude, sometimes zero.
    fn scale(random: &mut Pcg64Mcg) -> f32 {
        if random.next_u32().is_multiple_of(8) { 0.0 } else { 10f32.powf(signed(random) * 6.0) }
    }

    /// Everything that passes Bevy's own test is found. The planes nearly touch the boxes.
    #[test]
    fn what_bevy_sees_the_index_finds() {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let (mut seen, mut found, mut close) = (0, 0, 0);
        for _ in 0..200_000 {
            // Any matrix is possible: sheared, mirrored, or squeezed flat.
            let columns = [0; 3].map(|_| vector(&mut random) * scale(&mut random));
            let is_upright = random.next_u32().is_multiple_of(2);
            let matrix = if is_upright {
                // The box in the index is the same, so the two tests differ only by rounding.
                Mat3::from_diagonal(vector(&mut random) * scale(&mut random))
            } else {
                Mat3::from_cols(columns[0], columns[1], columns[2])
            };
            let place = vector(&mut random) * scale(&mut random);
            let transform = GlobalTransform::from(Affine3A::from_mat3_translation(matrix, place));
            let aabb = Aabb {
                center: (vector(&mut random) * scale(&mut random)).into(),
                half_extents: (vector(&mut random) * scale(&mut random)).into(),
            };
            let center = transform.affine().transform_point3a(aabb.center);
            let half_spaces = [0; 6].map(|_| {
                let normal = vector(&mut random).normalize_or(BevyVec3::X);
                let radius = aabb.relative_radius(&normal.into(), &transform.affine().matrix3);
                // The plane touches the box, either within rounding or far from it.
                let touching = -BevyVec3::from(center).dot(normal) - radius;
                let beside = if random.next_u32().is_multiple_of(8) { 1.0 } else { 1.0e-6 };
                let d = touching + (touching.abs() + radius) * (signed(&mut random) + 0.8) * beside;
                HalfSpace::new(Vec4::from((normal, d)))
            });
            let frustum = Frustum(ViewFrustum { half_spaces });
            let is_seen = frustum.intersects_obb(&aabb, &transform.affine(), true, false);
            let Some(bounds) = world_box(&transform, Some(&aabb), None) else { continue };
            let is_found = osp_frustum(&frustum, &CAMERA_PLANES).may_see(&bounds);
            assert!(is_found || !is_seen, "{transform:?} {aabb:?} {frustum:?}");
            seen += usize::from(is_seen);
            found += usize::from(is_found);
            close += usize::from(is_found && !is_seen);

            let sphere = Sphere { center, radius: aabb.half_extents.length() };
            let is_seen = frustum.intersects_sphere(&sphere, false);
            let Some(bounds) = world_box(&transform, None, Some(&sphere)) else { continue };
            assert!(
                osp_frustum(&frustum, &CAMERA_PLANES).may_see(&bounds) || !is_seen,
                "{sphere:?} {frustum:?}"
            );
        }
        // The test is meaningful: both results occur, and there are boxes for which the two tests differ.
        assert!(
            seen > 10_000 && close > 100 && found < 195_000,
            "{seen} seen, {found} found, {close} of them not seen"
        );
    }

    #[test]
    fn what_is_not_finite_has_no_box_and_a_broken_plane_culls_nothing() {
        let unit_box = Aabb { center: Vec3A::ZERO, half_extents: Vec3A::ONE };
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0e20] {
            let transform = GlobalTransform::from_xyz(0.0, broken, 0.0);
            assert_eq!(world_box(&transform, Some(&unit_box), None), None);
            let sphere = Sphere { center: Vec3A::ZERO, radius: broken };
            assert_eq!(world_box(&GlobalTransform::IDENTITY, None, Some(&sphere)), None);
            let half_spaces = [HalfSpace::new(Vec4::new(1.0, 0.0, 0.0, broken)); 6];
            let frustum = osp_frustum(&Frustum(ViewFrustum { half_spaces }), &CAMERA_PLANES);
            assert_eq!(frustum, OspFrustum::everything());
        }
        // If nobody has set the planes, Bevy's test decides.
        assert_eq!(osp_frustum(&Frustum::default(), &CAMERA_PLANES), OspFrustum::everything());
        assert_eq!(world_box(&GlobalTransform::IDENTITY, None, None), None);
    }
}
