//! The system that replaces Bevy's `check_visibility_cpu_culling`.

use bevy_camera::{
    Camera, Projection,
    primitives::{Aabb, Frustum, Sphere},
    visibility::{
        InheritedVisibility, NoCpuCulling, NoFrustumCulling, RenderLayers, SetViewVisibility, ViewVisibility,
        VisibilityClass, VisibilityRange, VisibleEntities, VisibleEntityRanges,
    },
};
use bevy_ecs::{
    change_detection::{Res, ResMut},
    entity::Entity,
    query::{Has, QueryData, Without},
    system::{Local, ParamSet, Query},
};
use bevy_transform::components::GlobalTransform;
use bevy_utils::{Parallel, TypeIdMap};

use crate::{
    Occluder,
    bounds::{CAMERA_PLANES, osp_frustum, world_box},
    changes::Changes,
    costs::Kind,
    culling::OspCulling,
    distinct::Distinct,
    occlusion::{Occluders, Shadows, window},
    settings::OspCullingSettings,
};

/// The components of an entity that the check needs, the same as in Bevy's system.
#[derive(QueryData)]
#[query_data(mutable)]
pub(crate) struct Checked {
    entity: Entity,
    inherited_visibility: &'static InheritedVisibility,
    view_visibility: &'static mut ViewVisibility,
    class: Option<&'static VisibilityClass>,
    layers: Option<&'static RenderLayers>,
    aabb: Option<&'static Aabb>,
    sphere: Option<&'static Sphere>,
    transform: &'static GlobalTransform,
    no_frustum_culling: Has<NoFrustumCulling>,
    has_range: Has<VisibilityRange>,
    is_occluder: Has<Occluder>,
}

/// The components of a view that the check reads: the components that Bevy's system reads, and projection and transform
/// for occlusion culling.
type ViewData = (
    Entity,
    &'static mut VisibleEntities,
    &'static Frustum,
    Option<&'static RenderLayers>,
    &'static Camera,
    Has<NoCpuCulling>,
    Option<(&'static Projection, &'static GlobalTransform)>,
);

/// The entities that a thread has found, by visibility class.
type Queue = TypeIdMap<Vec<Entity>>;

/// Reused buffers.
#[derive(Default)]
pub(crate) struct Scratch {
    queues: Parallel<Queue>,
    shadows: Shadows,
}

/// Finds the entities that each view sees, and sets the `ViewVisibility` of the entities and the `VisibleEntities` of
/// the views. The results are those of Bevy's `check_visibility_cpu_culling`, without the entities that an `Occluder`
/// hides. The index only chooses the entities to test; the test is Bevy's own.
pub(crate) fn check_visibility(
    settings: Res<'_, OspCullingSettings>,
    mut culling: ResMut<'_, OspCulling>,
    mut scratch: Local<'_, Scratch>,
    mut views: Query<'_, '_, ViewData>,
    mut entities: ParamSet<'_, '_, (Changes<'_, '_>, Query<'_, '_, Checked, Without<NoCpuCulling>>)>,
    ranges: Option<Res<'_, VisibleEntityRanges>>,
    occluders: Occluders<'_, '_>,
) {
    let Scratch { queues, shadows } = &mut *scratch;
    culling.follow(&settings, &mut entities.p0());
    let ranges = ranges.as_deref();
    let mut entities = entities.p1();

    for (view, mut visible, frustum, layers, camera, no_cpu_culling, place) in &mut views {
        if !camera.is_active {
            continue;
        }
        let layers = layers.unwrap_or_default();
        let place = place.filter(|_| !no_cpu_culling && !occluders.is_empty());
        let window = place.and_then(|(projection, transform)| window(camera, projection, transform));
        let has_shadows = window.is_some_and(|window| shadows.build(&window, layers, &occluders));
        let test = ViewTest {
            conditions: Conditions { view: Some(view), layers, ranges },
            frustum: (!no_cpu_culling).then_some(frustum),
            shadows: has_shadows.then_some(&*shadows),
        };
        let candidates = if no_cpu_culling {
            None
        } else {
            culling.candidates(&settings, Kind::Camera, &osp_frustum(frustum, &CAMERA_PLANES))
        };
        let found = candidates.map(Distinct::len);
        match candidates {
            Some(candidates) => {
                candidates.for_each(&mut entities, queues, touch, |item, queue| test.check(item, queue));
            }
            None => {
                let queue = || queues.borrow_local_mut();
                entities.par_iter_mut().for_each_init(queue, |queue, item| test.check(item, queue));
            }
        }
        gather(queues, &mut visible);
        culling.end_views(Kind::Camera, 1, found);
        culling.counts_mut().occluded += shadows.take_occluded();
    }
}

/// Reads a part of each component that the check of an entity will read, so that its cache line is loaded.
#[inline]
fn touch(item: &CheckedItem<'_, '_>) -> u32 {
    u32::from(item.inherited_visibility.get())
        ^ u32::from(item.view_visibility.get())
        ^ item.transform.affine().translation.x.to_bits()
        ^ item.aabb.map_or(0, |aabb| aabb.center.x.to_bits())
        ^ item.class.map_or(0, |class| class.len() as u32)
}

/// The conditions of a view, or of a light for a view, that do not depend on an entity's box.
pub(crate) struct Conditions<'a> {
    /// The view whose distance to an entity decides whether the entity is in its range. Without a view, every entity
    /// with a range is out of range.
    pub(crate) view: Option<Entity>,
    pub(crate) layers: &'a RenderLayers,
    pub(crate) ranges: Option<&'a VisibleEntityRanges>,
}

impl Conditions<'_> {
    /// Whether an entity fulfils the conditions of Bevy's systems: inherited visibility, layers, and the range of
    /// distances.
    #[inline]
    pub(crate) fn admit(
        &self,
        entity: Entity,
        inherited: &InheritedVisibility,
        layers: Option<&RenderLayers>,
        has_range: bool,
    ) -> bool {
        let is_out_of_range = |ranges: &VisibleEntityRanges| {
            self.view.is_none_or(|view| !ranges.entity_is_in_range_of_view(entity, view))
        };
        inherited.get()
            && self.layers.intersects(layers.unwrap_or_default())
            && !(has_range && self.ranges.is_some_and(is_out_of_range))
    }
}

/// The data of one view that entities are tested against.
struct ViewTest<'a> {
    conditions: Conditions<'a>,
    /// `None` if the view sees everything.
    frustum: Option<&'a Frustum>,
    /// The shadows of the view's occluders.
    shadows: Option<&'a Shadows>,
}

impl ViewTest<'_> {
    /// Records an entity if the view sees it.
    #[inline]
    fn check(&self, mut item: CheckedItem<'_, '_>, queue: &mut Queue) {
        if !self.sees(&item) || self.hides(&item) {
            return;
        }
        item.view_visibility.set_visible();
        // An entity without a class, such as a gizmo, is visible, but in no list.
        for class in item.class.into_iter().flat_map(|class| class.iter()) {
            queue.entry(*class).or_default().push(item.entity);
        }
    }

    /// Whether the view sees an entity, by the conditions of Bevy's system and with Bevy's own tests of volumes.
    #[inline]
    fn sees(&self, item: &CheckedItem<'_, '_>) -> bool {
        if !self.conditions.admit(item.entity, item.inherited_visibility, item.layers, item.has_range) {
            return false;
        }
        let Some(frustum) = self.frustum.filter(|_| !item.no_frustum_culling) else { return true };
        if let Some(aabb) = item.aabb {
            let world_from_local = item.transform.affine();
            let sphere = Sphere {
                center: world_from_local.transform_point3a(aabb.center),
                radius: item.transform.radius_vec3a(aabb.half_extents),
            };
            frustum.intersects_sphere(&sphere, false)
                && frustum.intersects_obb(aabb, &world_from_local, true, false)
        } else {
            item.sphere.is_none_or(|sphere| frustum.intersects_sphere(sphere, false))
        }
    }

    /// Whether occluders completely hide an entity that is in view.
    #[inline]
    fn hides(&self, item: &CheckedItem<'_, '_>) -> bool {
        let Some(shadows) = self.shadows else { return false };
        if item.no_frustum_culling || item.is_occluder || item.aabb.is_none() {
            return false;
        }
        world_box(item.transform, item.aabb, None).is_some_and(|bounds| shadows.hide(&bounds))
    }
}

/// Moves the results of the threads into the lists of a view, sorted.
fn gather(queues: &mut Parallel<Queue>, visible: &mut VisibleEntities) {
    visible.clear_all();
    for queue in queues.iter_mut() {
        for (class, entities) in queue {
            visible.get_mut(*class).append(entities);
        }
    }
    // Later systems in the frame compare the lists with those of the previous frame, and require sorted lists.
    for entities in visible.entities.values_mut() {
        entities.sort_unstable();
    }
}
