//! The system that replaces Bevy's `check_dir_light_mesh_visibility`: the entities that cast shadows into each cascade
//! of a directional light.

use bevy_camera::{
    primitives::{Aabb, CascadesFrusta, Frustum},
    visibility::{
        CascadesVisibleEntities, InheritedVisibility, NoCpuCulling, NoFrustumCulling, RenderLayers,
        SetViewVisibility, ViewVisibility, VisibilityRange, VisibleEntityRanges, VisibleMeshEntities,
    },
};
use bevy_ecs::{
    change_detection::{Res, ResMut},
    entity::Entity,
    query::{Has, Or, QueryData, With, Without},
    system::{Commands, Local, Query},
    world::World,
};
use bevy_light::{DirectionalLight, NotShadowCaster, SpotLight};
use bevy_mesh::Mesh3d;
use bevy_transform::components::GlobalTransform;
use bevy_utils::Parallel;

use crate::{bounds::CASCADE_PLANES, check::Conditions, culling::OspCulling, settings::OspCullingSettings};

/// The components of an entity that the check needs, the same as in Bevy's system.
#[derive(QueryData)]
pub(crate) struct Caster {
    entity: Entity,
    inherited_visibility: &'static InheritedVisibility,
    layers: Option<&'static RenderLayers>,
    aabb: Option<&'static Aabb>,
    transform: Option<&'static GlobalTransform>,
    has_range: Has<VisibilityRange>,
    no_frustum_culling: Has<NoFrustumCulling>,
}

type IsCaster = (Without<NotShadowCaster>, Without<DirectionalLight>, Without<NoCpuCulling>, With<Mesh3d>);

/// Entities that are not in the index, or only by a sphere, which Bevy's light systems do not use.
type IsUnbounded = Or<(Without<Aabb>, Without<GlobalTransform>, Without<ViewVisibility>)>;

/// The components of a light that the check needs.
type LightData = (
    &'static DirectionalLight,
    &'static CascadesFrusta,
    &'static mut CascadesVisibleEntities,
    Option<&'static RenderLayers>,
    &'static ViewVisibility,
);

/// Buffers whose memory is used again.
#[derive(Default)]
pub(crate) struct Scratch {
    /// The entities that a thread has found for one cascade by the index.
    of_cascade: Parallel<Vec<Entity>>,
    /// The entities that a thread has found by a plain pass, for each cascade of that pass.
    of_pass: Parallel<Vec<Vec<Entity>>>,
}

/// Finds the entities that cast shadows into each cascade, with the results of Bevy's
/// `check_dir_light_mesh_visibility`. The index only chooses the entities to test; the test is Bevy's own.
#[expect(clippy::too_many_arguments, reason = "each is a parameter of the system")]
pub(crate) fn check_cascades(
    mut commands: Commands<'_, '_>,
    settings: Res<'_, OspCullingSettings>,
    mut culling: ResMut<'_, OspCulling>,
    mut scratch: Local<'_, Scratch>,
    mut lights: Query<'_, '_, LightData, Without<SpotLight>>,
    mut casters: Query<'_, '_, Caster, IsCaster>,
    unbounded: Query<'_, '_, Caster, (IsCaster, IsUnbounded)>,
    ranges: Option<Res<'_, VisibleEntityRanges>>,
) {
    let ranges = ranges.as_deref();
    let Scratch { of_cascade, of_pass } = &mut *scratch;
    let mut seen = Vec::new();
    for (light, frusta, mut visible, layers, light_visibility) in &mut lights {
        if !light.shadow_maps_enabled || !light_visibility.get() {
            visible.entities.clear();
            continue;
        }
        visible.entities.retain(|view, _| frusta.frusta.contains_key(view));
        for (view, frusta) in &frusta.frusta {
            let lists = visible.entities.entry(*view).or_default();
            lists.resize(frusta.len(), VisibleMeshEntities::default());
            lists.iter_mut().for_each(|list| list.entities.clear());
            let conditions = Conditions { view: *view, layers: layers.unwrap_or_default(), ranges };
            let mut by_pass = Vec::new();
            for (number, frustum) in frusta.iter().enumerate() {
                let Some(candidates) = culling.candidates(&settings, frustum, &CASCADE_PLANES) else {
                    by_pass.push(number);
                    continue;
                };
                candidates.for_each(&mut casters, of_cascade, touch, |caster, list| {
                    if has_box(&caster) && casts(&conditions, &caster) && reaches(&caster, frustum) {
                        list.push(caster.entity);
                    }
                });
                culling.counts_mut().cascades_by_index += 1;
                let list = &mut lists[number].entities;
                of_cascade.iter_mut().for_each(|found| list.append(found));
                let others =
                    unbounded.iter().filter(|caster| casts(&conditions, caster) && reaches(caster, frustum));
                list.extend(others.map(|caster| caster.entity));
            }
            if !by_pass.is_empty() {
                pass(&conditions, frusta, &by_pass, &casters, of_pass, lists);
                culling.counts_mut().cascades_by_pass += by_pass.len();
            }
            for list in lists {
                list.shrink();
                list.entities.sort_unstable();
                seen.extend_from_slice(&list.entities);
            }
        }
    }
    if !seen.is_empty() {
        // A command sets the visibility later, as in Bevy: so the system of point lights, which sets it, too, can run at the
        // same time.
        commands.queue(move |world: &mut World| {
            let mut query = world.query::<&mut ViewVisibility>();
            let mut seen = query.iter_many_mut(world, &seen);
            while let Some(mut visibility) = seen.fetch_next() {
                visibility.set_visible();
            }
        });
    }
}

/// Tests all entities against the cascades with these numbers.
fn pass(
    conditions: &Conditions<'_>,
    frusta: &[Frustum],
    numbers: &[usize],
    casters: &Query<'_, '_, Caster, IsCaster>,
    queues: &mut Parallel<Vec<Vec<Entity>>>,
    lists: &mut [VisibleMeshEntities],
) {
    let queue = || {
        let mut queue = queues.borrow_local_mut();
        let lists = queue.len().max(numbers.len());
        queue.resize_with(lists, Vec::new);
        queue
    };
    casters.par_iter().for_each_init(queue, |queue, caster| {
        if !casts(conditions, &caster) {
            return;
        }
        for (number, list) in numbers.iter().zip(queue.iter_mut()) {
            if reaches(&caster, &frusta[*number]) {
                list.push(caster.entity);
            }
        }
    });
    for queue in queues.iter_mut() {
        for (number, found) in numbers.iter().zip(queue.iter_mut()) {
            lists[*number].entities.append(found);
        }
    }
}

/// Reads a little of each component of an entity that the check will read.
fn touch(caster: &CasterItem<'_, '_>) -> u32 {
    u32::from(caster.inherited_visibility.get())
        ^ caster.aabb.map_or(0, |aabb| aabb.center.x.to_bits())
        ^ caster.transform.map_or(0, |transform| transform.affine().translation.x.to_bits())
}

fn has_box(caster: &CasterItem<'_, '_>) -> bool {
    caster.aabb.is_some() && caster.transform.is_some()
}

/// Whether an entity casts shadows for the view of these conditions, wherever it is.
fn casts(conditions: &Conditions<'_>, caster: &CasterItem<'_, '_>) -> bool {
    conditions.admit(caster.entity, caster.inherited_visibility, caster.layers, caster.has_range)
}

/// Whether the box of an entity reaches into a cascade. The near plane culls nothing, because a thing in front of it
/// casts shadows, too.
fn reaches(caster: &CasterItem<'_, '_>, frustum: &Frustum) -> bool {
    let (Some(aabb), Some(transform)) = (caster.aabb, caster.transform) else { return true };
    caster.no_frustum_culling || frustum.intersects_obb(aabb, &transform.affine(), false, true)
}
