use bevy_camera::{Camera, Projection, visibility::RenderLayers};
use bevy_ecs::{
    entity::Entity,
    system::{Query, SystemParam},
};
use bevy_math::Vec3;
use bevy_transform::components::GlobalTransform;
use osp::math::{Aabb, Sphere};

use crate::occlusion::{Occluders, Shadows, window};

/// A system parameter that tests whether boxes and spheres are hidden from a camera. They need not belong to an entity:
/// for example, they may surround sounds, characters or triggers.
#[derive(SystemParam)]
pub struct OspHidden<'w, 's> {
    cameras: Query<
        'w,
        's,
        (&'static Camera, &'static Projection, &'static GlobalTransform, Option<&'static RenderLayers>),
    >,
    occluders: Occluders<'w, 's>,
}

impl std::fmt::Debug for OspHidden<'_, '_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OspHidden").finish_non_exhaustive()
    }
}

impl OspHidden<'_, '_> {
    /// The occluders that a camera sees now. `None` if the entity is no camera, or if nothing can be hidden from it:
    /// with a parallel projection, a scaled transform, an oblique near plane, or a sub-view. O(occluders).
    pub fn from_camera(&self, camera: Entity) -> Option<CameraOccluders> {
        let (camera, projection, transform, layers) = self.cameras.get(camera).ok()?;
        let window = window(camera, projection, transform)?;
        let mut shadows = Shadows::default();
        let has_occluders = shadows.build(&window, layers.unwrap_or_default(), &self.occluders);
        Some(CameraOccluders { shadows: has_occluders.then_some(shadows) })
    }
}

/// The occluders that a camera saw when [`OspHidden::from_camera`] was called.
#[derive(Debug)]
pub struct CameraOccluders {
    /// The shadows of the occluders; `None` if no occluder is in view.
    shadows: Option<Shadows>,
}

impl CameraOccluders {
    /// Whether the occluders certainly hide all of a box in view, world space, metres. `false` means that the box may
    /// be visible, or lies out of view. A box that is not finite is never hidden. O(log occluders).
    pub fn hides_box(&self, min: Vec3, max: Vec3) -> bool {
        let [min, max] = [min, max].map(|corner| corner.to_array().into());
        let bounds = Aabb::new(min, max);
        bounds.is_valid() && self.shadows.as_ref().is_some_and(|shadows| shadows.hides(&bounds))
    }

    /// Does the test of [`CameraOccluders::hides_box`] for a sphere. A sphere that is not finite or has a negative
    /// radius is never hidden.
    pub fn hides_sphere(&self, center: Vec3, radius_m: f32) -> bool {
        let is_valid = center.is_finite() && radius_m.is_finite() && radius_m >= 0.0;
        let sphere = Sphere { center: center.to_array().into(), radius_m };
        is_valid && self.shadows.as_ref().is_some_and(|shadows| shadows.hides_sphere(&sphere))
    }
}
