use glam::{Affine3A, DAffine3, DMat3, DVec3};

use crate::math::Aabb;

/// A space that polygons are fixed in and that moves as a whole, such as a dragged group, or a node of a scene graph. The
/// caller chooses the number; small numbers without gaps cost least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SpaceId(pub u32);

/// The transform of a space to the world, with bounds of its rounding error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpacePlace {
    /// From the space to the world: rotation, scale, translation.
    pub world_from_space: DAffine3,
    /// Largest rounding error of the drawn position of a corner at the origin of the space, metres.
    pub rounding_m: f64,
    /// Further error per metre from the space's origin.
    pub rounding_per_m: f64,
}

/// Relative error of a corner that one matrix in `f32` transforms to the world: a few roundings.
pub const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

impl From<Affine3A> for SpacePlace {
    /// The transform for corners that are computed by this matrix in `f32`.
    fn from(world_from_space: Affine3A) -> Self {
        let matrix = world_from_space.matrix3;
        let [x, y, z] =
            [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| glam::Vec3::from(axis).as_dvec3());
        let origin = glam::Vec3::from(world_from_space.translation).as_dvec3();
        let longest = x.length() + y.length() + z.length();
        Self {
            world_from_space: DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: origin },
            rounding_m: ROUNDING * origin.length(),
            rounding_per_m: ROUNDING * longest,
        }
    }
}

impl SpacePlace {
    /// Upper bound of the numbers in the transform of the space's origin, metres.
    pub(crate) fn reach_m(&self) -> DVec3 {
        self.world_from_space.translation.abs().max(DVec3::splat(self.rounding_m / ROUNDING))
    }

    /// Largest rounding error of the world position of a point in a box of the space, metres.
    pub(crate) fn rounding_of(&self, in_space: &Aabb) -> f64 {
        let reach = in_space.min.abs().max(in_space.max.abs()).as_dvec3().length();
        self.rounding_m + self.rounding_per_m * reach
    }

    /// A box in the world that contains a box of the space, including all rounding.
    pub fn world_box(&self, in_space: &Aabb) -> Aabb {
        if in_space.is_empty() {
            return Aabb::EMPTY;
        }
        let (low, high) = (in_space.min.as_dvec3(), in_space.max.as_dvec3());
        let center = self.world_from_space.transform_point3((low + high) * 0.5);
        let half = abs(&self.world_from_space.matrix3) * ((high - low) * 0.5);
        let half = half + 2.0 * self.rounding_of(in_space);
        outwards(center, half)
    }

    /// A box in the space that contains a box of the world; unbounded if the space is scaled to a point or a plane.
    pub(crate) fn box_in_space(&self, world: &Aabb) -> Aabb {
        let space_from_world = self.world_from_space.inverse();
        let (low, high) = (world.min.as_dvec3(), world.max.as_dvec3());
        let center = space_from_world.transform_point3((low + high) * 0.5);
        let half = abs(&space_from_world.matrix3) * ((high - low) * 0.5);
        let half = half * (1.0 + ROUNDING) + center.abs() * ROUNDING;
        match center.is_finite() && half.is_finite() {
            true => outwards(center, half),
            false => Aabb { min: glam::Vec3::MIN, max: glam::Vec3::MAX },
        }
    }
}

/// The matrix of the absolute values.
pub(crate) fn abs(matrix: &DMat3) -> DMat3 {
    DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
}

/// The box with this centre and half size, rounded outwards to `f32`. Infinite numbers become the largest finite ones.
fn outwards(center: DVec3, half: DVec3) -> Aabb {
    let least = |v: DVec3| glam::Vec3::from(v.as_vec3().to_array().map(f32::next_down));
    let most = |v: DVec3| glam::Vec3::from(v.as_vec3().to_array().map(f32::next_up));
    Aabb { min: least(center - half).max(glam::Vec3::MIN), max: most(center + half).min(glam::Vec3::MAX) }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};

    use super::*;

    #[test]
    fn boxes_hold_what_they_held_in_the_other_space() {
        let bounds = Aabb { min: Vec3::new(-1.0, 2.0, 3.0), max: Vec3::new(0.5, 2.25, 7.0) };
        let turn = Quat::from_xyzw(0.1, -0.3, 0.5, 0.8).normalize();
        let to =
            Affine3A::from_scale_rotation_translation(Vec3::splat(3.0), turn, Vec3::new(1.0e4, 2.0, -7.0));
        let place = SpacePlace::from(to);
        let world = place.world_box(&bounds);
        let corners = (0..8).map(|i| {
            let at = |bit: usize| if i >> bit & 1 == 1 { bounds.max[bit] } else { bounds.min[bit] };
            to.transform_point3(Vec3::new(at(0), at(1), at(2)))
        });
        let tight = Aabb::from_points(&corners.collect::<Vec<_>>());
        assert!(world.min.cmple(tight.min).all() && world.max.cmpge(tight.max).all(), "{world:?} {tight:?}");
        assert!((world.extent() - tight.extent()).abs().max_element() < 0.2, "{world:?} {tight:?}");
        let back = place.box_in_space(&tight);
        assert!(back.min.cmple(bounds.min).all() && back.max.cmpge(bounds.max).all(), "{back:?}");
        assert!(place.world_box(&Aabb::EMPTY).is_empty());
        let shrunk = SpacePlace::from(Affine3A::from_scale(Vec3::ZERO));
        assert_eq!(shrunk.box_in_space(&bounds).min, Vec3::MIN);
    }
}
