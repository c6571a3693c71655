use glam::{Affine3A, DMat3, DVec3, Vec3};

use crate::math::Aabb;

/// The box around a box that was brought into another space; holds every point of it, whatever is rounded.
pub(super) fn box_in(to_from_space: &Affine3A, bounds: &Aabb) -> Aabb {
    if bounds.is_empty() {
        return Aabb::EMPTY;
    }
    let exactly = |v: glam::Vec3A| Vec3::from(v).as_dvec3();
    let matrix = to_from_space.matrix3;
    let matrix = DMat3::from_cols(exactly(matrix.x_axis), exactly(matrix.y_axis), exactly(matrix.z_axis));
    let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let origin = exactly(to_from_space.translation);
    let (mut min, mut max, mut reach) = (origin, origin, origin.abs());
    for axis in 0..3 {
        let (a, b) = (matrix.col(axis) * low[axis], matrix.col(axis) * high[axis]);
        (min, max, reach) = (min + a.min(b), max + a.max(b), reach + a.abs().max(b.abs()));
    }
    // What others transform in `f32` may lie a few steps of the largest number that goes in beside the exact place.
    let margin = reach * (8.0 * f64::from(f32::EPSILON));
    let outwards = |v: DVec3, step: fn(f32) -> f32| Vec3::from(v.as_vec3().to_array().map(step));
    Aabb { min: outwards(min - margin, f32::next_down), max: outwards(max + margin, f32::next_up) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn every_corner_is_in_the_box_of_the_other_space() {
        let bounds = Aabb { min: Vec3::new(-1.0, 2.0, 3.0), max: Vec3::new(0.5, 2.25, 7.0) };
        let turn = Quat::from_xyzw(0.1, -0.3, 0.5, 0.8).normalize();
        let to =
            Affine3A::from_scale_rotation_translation(Vec3::splat(3.0), turn, Vec3::new(1.0e4, 2.0, -7.0));
        let around = box_in(&to, &bounds);
        let corners = (0..8).map(|i| {
            let at = |bit: usize| if i >> bit & 1 == 1 { bounds.max[bit] } else { bounds.min[bit] };
            to.transform_point3(Vec3::new(at(0), at(1), at(2)))
        });
        let tight = Aabb::from_points(&corners.collect::<Vec<_>>());
        assert!(
            around.min.cmple(tight.min).all() && around.max.cmpge(tight.max).all(),
            "{around:?} {tight:?}"
        );
        assert!((around.extent() - tight.extent()).abs().max_element() < 0.05);
        assert!(box_in(&to, &Aabb::EMPTY).is_empty());
    }
}
