//! The systems that replace Bevy's `check_dir_light_mesh_visibility` and `check_point_light_mesh_visibility`. They find
//! the entities that cast shadows into each shadow view of a light. A directional light has a view for each cascade, a
//! point light a view for each face of a cube, a spot light a single view.

use std::any::TypeId;

use bevy_camera::{
    Camera, RenderTarget, ShadowLodOrigin,
    primitives::{Aabb, CascadesFrusta, CubemapFrusta, Frustum, Sphere},
    visibility::{
        CascadesVisibleEntities, CubemapVisibleEntities, InheritedVisibility, NoCpuCulling, NoFrustumCulling,
        RenderLayers, SetViewVisibility, ViewVisibility, VisibilityRange, VisibleEntities,
        VisibleEntityRanges, VisibleMeshEntities,
    },
};
use bevy_ecs::{
    change_detection::{Res, ResMut},
    entity::{Entity, EntityHashSet},
    query::{Has, Or, QueryData, With, Without},
    system::{Local, ParamSet, Query},
};
use bevy_light::{
    DirectionalLight, NotShadowCaster, PointLight, SpotLight, cluster::ClusterVisibilityClass,
    get_shadow_lod_origin,
};
use bevy_mesh::Mesh3d;
use bevy_transform::components::GlobalTransform;
use bevy_utils::Parallel;
use osp::math::Frustum as OspFrustum;

use crate::{
    bounds::{ALL_PLANES, CASCADE_PLANES, cube_around, osp_frustum, world_box},
    check::Conditions,
    costs::Kind,
    culling::OspCulling,
    distinct::Distinct,
    settings::OspCullingSettings,
};

/// The components of an entity that the check needs, the same as in Bevy's systems.
#[derive(QueryData)]
#[query_data(mutable)]
pub(crate) struct Caster {
    entity: Entity,
    inherited_visibility: &'static InheritedVisibility,
    view_visibility: Option<&'static mut ViewVisibility>,
    layers: Option<&'static RenderLayers>,
    aabb: Option<&'static Aabb>,
    transform: Option<&'static GlobalTransform>,
    has_range: Has<VisibilityRange>,
    no_frustum_culling: Has<NoFrustumCulling>,
}

type IsCaster = (Without<NotShadowCaster>, Without<DirectionalLight>, Without<NoCpuCulling>, With<Mesh3d>);

/// Entities without a box in the index. Spheres do not count, because Bevy's light systems ignore them.
type IsUnbounded = Or<(Without<Aabb>, Without<GlobalTransform>, Without<ViewVisibility>)>;

/// All casters, and the casters without a box in the index.
type Casters<'w, 's> = ParamSet<
    'w,
    's,
    (Query<'static, 'static, Caster, IsCaster>, Query<'static, 'static, Caster, (IsCaster, IsUnbounded)>),
>;

/// For each thread, the entities that it has found for each view. The memory is reused.
type Queues = Parallel<Vec<Vec<Entity>>>;

/// The components of a directional light that the check needs.
type Sun = (
    &'static DirectionalLight,
    &'static CascadesFrusta,
    &'static mut CascadesVisibleEntities,
    Option<&'static RenderLayers>,
    &'static ViewVisibility,
);

/// The components of a point light that the check needs.
type Bulb = (
    &'static PointLight,
    &'static GlobalTransform,
    &'static CubemapFrusta,
    &'static mut CubemapVisibleEntities,
    Option<&'static RenderLayers>,
);

/// The components of a spot light that the check needs.
type Spot = (
    &'static SpotLight,
    &'static GlobalTransform,
    &'static Frustum,
    &'static mut VisibleMeshEntities,
    Option<&'static RenderLayers>,
);

/// Finds the entities that cast shadows into each cascade, with the results of Bevy's
/// `check_dir_light_mesh_visibility`. The index only chooses the entities to test; the test is Bevy's own.
pub(crate) fn check_cascades(
    settings: Res<'_, OspCullingSettings>,
    mut culling: ResMut<'_, OspCulling>,
    mut queues: Local<'_, Queues>,
    mut lights: Query<'_, '_, Sun, Without<SpotLight>>,
    mut casters: Casters<'_, '_>,
    ranges: Option<Res<'_, VisibleEntityRanges>>,
) {
    let ranges = ranges.as_deref();
    for (light, frusta, mut visible, layers, light_visibility) in &mut lights {
        if !light.shadow_maps_enabled || !light_visibility.get() {
            visible.entities.clear();
            continue;
        }
        visible.entities.retain(|view, _| frusta.frusta.contains_key(view));
        for (view, frusta) in &frusta.frusta {
            let lists = visible.entities.entry(*view).or_default();
            lists.resize(frusta.len(), VisibleMeshEntities::default());
            let mut lists = lists.iter_mut().collect::<Vec<_>>();
            let conditions = Conditions { view: Some(*view), layers: layers.unwrap_or_default(), ranges };
            let views = ShadowViews { conditions, frusta, range: None, cube: None };
            let mut by_pass = Vec::new();
            for (number, frustum) in frusta.iter().enumerate() {
                let found =
                    culling.candidates(&settings, Kind::Cascade, &osp_frustum(frustum, &CASCADE_PLANES));
                let Some(count) = found.map(Distinct::len) else {
                    by_pass.push(number);
                    continue;
                };
                views.fill(&[number], found, &mut casters, &mut queues, &mut lists);
                culling.end_views(Kind::Cascade, 1, Some(count));
            }
            if !by_pass.is_empty() {
                views.fill(&by_pass, None, &mut casters, &mut queues, &mut lists);
                culling.end_views(Kind::Cascade, by_pass.len(), None);
            }
        }
    }
}

/// Finds the entities that cast shadows for each point light and spot light in view, as Bevy's
/// `check_point_light_mesh_visibility` does. For point lights it also skips entities outside the range that Bevy's
/// inexact test of a sphere against a box keeps.
#[expect(clippy::too_many_arguments, reason = "each is a parameter of the system")]
pub(crate) fn check_lamps(
    settings: Res<'_, OspCullingSettings>,
    mut culling: ResMut<'_, OspCulling>,
    mut queues: Local<'_, Queues>,
    mut checked: Local<'_, EntityHashSet>,
    views: Query<'_, '_, &VisibleEntities>,
    mut bulbs: Query<'_, '_, Bulb>,
    mut spots: Query<'_, '_, Spot>,
    mut casters: Casters<'_, '_>,
    mut cameras: Query<'_, '_, (Entity, &RenderTarget), With<Camera>>,
    mut origins: Query<'_, '_, Entity, With<ShadowLodOrigin>>,
    mut lamps: Query<'_, '_, Entity, Or<(With<PointLight>, With<SpotLight>)>>,
    ranges: Option<Res<'_, VisibleEntityRanges>>,
) {
    checked.clear();
    let view = get_shadow_lod_origin(
        cameras.transmute_lens_filtered(),
        origins.transmute_lens_filtered(),
        lamps.transmute_lens_filtered(),
    );
    let ranges = ranges.as_deref();
    let mut fill = |views: ShadowViews<'_>, found: &OspFrustum, lists: &mut [&mut VisibleMeshEntities]| {
        let numbers = &[0, 1, 2, 3, 4, 5][..lists.len()];
        let found = culling.candidates(&settings, Kind::Lamp, found);
        let count = found.map(Distinct::len);
        views.fill(numbers, found, &mut casters, &mut queues, lists);
        culling.end_views(Kind::Lamp, numbers.len(), count);
    };
    let range =
        |transform: &GlobalTransform, radius| Sphere { center: transform.translation().into(), radius };
    for visible in &views {
        for light in visible.get(TypeId::of::<ClusterVisibilityClass>()) {
            if !checked.insert(*light) {
                continue;
            }
            if let Ok((light, transform, frusta, mut visible, layers)) = bulbs.get_mut(*light)
                && light.shadow_maps_enabled
            {
                let range = range(transform, light.range);
                let cube = cube_around(&range);
                let conditions = Conditions { view, layers: layers.unwrap_or_default(), ranges };
                let frusta = &frusta.frusta;
                let views = ShadowViews { conditions, frusta, range: Some(range), cube: Some(cube) };
                fill(views, &cube, &mut visible.iter_mut().collect::<Vec<_>>());
            }
            if let Ok((light, transform, frustum, mut visible, layers)) = spots.get_mut(*light)
                && light.shadow_maps_enabled
            {
                let range = Some(range(transform, light.range));
                let conditions = Conditions { view, layers: layers.unwrap_or_default(), ranges };
                let views =
                    ShadowViews { conditions, frusta: std::slice::from_ref(frustum), range, cube: None };
                fill(views, &osp_frustum(frustum, &ALL_PLANES), &mut [&mut *visible]);
            }
        }
    }
}

/// The shadow views of one light, for one camera if it has cascades.
struct ShadowViews<'a> {
    conditions: Conditions<'a>,
    frusta: &'a [Frustum],
    /// The range of a point light or spot light.
    range: Option<Sphere>,
    /// The cube around the range of a point light.
    cube: Option<OspFrustum>,
}

impl ShadowViews<'_> {
    /// Fills the lists of the views with these numbers: from the entities that the index has found, or else from all.
    fn fill(
        &self,
        numbers: &[usize],
        found: Option<Distinct<'_>>,
        casters: &mut Casters<'_, '_>,
        queues: &mut Queues,
        lists: &mut [&mut VisibleMeshEntities],
    ) {
        if let Some(found) = found {
            found.for_each(&mut casters.p0(), queues, touch, |caster, queue| {
                if is_bounded(&caster) {
                    self.check(caster, numbers, queue);
                }
            });
            let queue = &mut *queues.borrow_local_mut();
            casters.p1().iter_mut().for_each(|caster| self.check(caster, numbers, queue));
        } else {
            let queue = || queues.borrow_local_mut();
            casters
                .p0()
                .par_iter_mut()
                .for_each_init(queue, |queue, caster| self.check(caster, numbers, queue));
        }
        for (at, number) in numbers.iter().enumerate() {
            let list = &mut lists[*number];
            list.entities.clear();
            queues
                .iter_mut()
                .filter_map(|queue| queue.get_mut(at))
                .for_each(|found| list.entities.append(found));
            list.shrink();
            list.entities.sort_unstable();
        }
    }

    /// Records an entity for each view into which it casts shadows.
    fn check(&self, mut caster: CasterItem<'_, '_>, numbers: &[usize], queue: &mut Vec<Vec<Entity>>) {
        if !self.admits(&caster) {
            return;
        }
        queue.resize_with(queue.len().max(numbers.len()), Vec::new);
        let mut is_seen = false;
        for (number, list) in numbers.iter().zip(queue) {
            if self.reaches(&caster, &self.frusta[*number]) {
                list.push(caster.entity);
                is_seen = true;
            }
        }
        if let Some(visibility) = caster.view_visibility.as_mut().filter(|_| is_seen) {
            visibility.set_visible();
        }
    }

    /// Whether an entity casts shadows for this light, in any of the views.
    fn admits(&self, caster: &CasterItem<'_, '_>) -> bool {
        if !self.conditions.admit(caster.entity, caster.inherited_visibility, caster.layers, caster.has_range)
        {
            return false;
        }
        let Some(range) = &self.range else { return true };
        // Bevy's system for these lights skips entities without `ViewVisibility`.
        if caster.view_visibility.is_none() {
            return false;
        }
        let (Some(aabb), Some(transform)) = (caster.aabb, caster.transform) else { return true };
        let is_in_cube = |cube: &OspFrustum| {
            world_box(transform, Some(aabb), None).is_none_or(|bounds| cube.may_see(&bounds))
        };
        caster.no_frustum_culling
            || range.intersects_obb(aabb, &transform.affine()) && self.cube.as_ref().is_none_or(is_in_cube)
    }

    /// Whether the box of an entity reaches into a view. The near plane of a cascade culls nothing, because an entity
    /// in front of it casts shadows, too.
    fn reaches(&self, caster: &CasterItem<'_, '_>, frustum: &Frustum) -> bool {
        let (Some(aabb), Some(transform)) = (caster.aabb, caster.transform) else { return true };
        caster.no_frustum_culling
            || frustum.intersects_obb(aabb, &transform.affine(), self.range.is_some(), true)
    }
}

/// Reads a part of each component that the check of an entity will read, so that its cache line is loaded.
fn touch(caster: &CasterItem<'_, '_>) -> u32 {
    u32::from(caster.inherited_visibility.get())
        ^ caster.aabb.map_or(0, |aabb| aabb.center.x.to_bits())
        ^ caster.transform.map_or(0, |transform| transform.affine().translation.x.to_bits())
}

/// Whether the index has the box of an entity that it has found.
fn is_bounded(caster: &CasterItem<'_, '_>) -> bool {
    caster.aabb.is_some() && caster.transform.is_some()
}
