//! Finds the entities that have changed since the last frame, by Bevy's change ticks, table by table, and by its
//! messages about removed components.

use std::ops::ControlFlow;

use bevy_camera::{
    primitives::{Aabb, Sphere},
    visibility::{NoCpuCulling, NoFrustumCulling, ViewVisibility},
};
use bevy_ecs::{
    change_detection::{Ref, Tick},
    component::Component,
    entity::Entity,
    lifecycle::RemovedComponents,
    query::{Added, With, Without},
    system::{Query, SystemParam},
};
use bevy_transform::components::GlobalTransform;
use osp::math::Aabb as WorldBox;

use crate::{bounds::world_box, entities::Bounds};

/// Number of rows of a table whose ticks are compared at once, without a branch.
const ROWS: usize = 64;

/// The components of an entity that are tracked. Bevy stores all of these components in tables.
type Followed = (
    Entity,
    Ref<'static, GlobalTransform>,
    Option<Ref<'static, Aabb>>,
    Option<Ref<'static, Sphere>>,
    Option<Ref<'static, NoFrustumCulling>>,
    Ref<'static, ViewVisibility>,
);

/// The queries by which the system tracks the entities.
#[derive(SystemParam)]
pub(crate) struct Changes<'w, 's> {
    entities: Query<'w, 's, Followed, Without<NoCpuCulling>>,
    left_out: Query<'w, 's, Entity, (Added<NoCpuCulling>, With<ViewVisibility>)>,
    no_transform: RemovedComponents<'w, 's, GlobalTransform>,
    no_aabb: RemovedComponents<'w, 's, Aabb>,
    no_sphere: RemovedComponents<'w, 's, Sphere>,
    culled_again: RemovedComponents<'w, 's, NoFrustumCulling>,
    taken_in: RemovedComponents<'w, 's, NoCpuCulling>,
}

/// The content of one message or tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// The entity is new or has changed.
    Changed {
        entity: Entity,
        /// Whether the entity has a box or a sphere, and no component that forbids culling by it.
        has_bounds: bool,
    },
    /// The entity is no longer tracked.
    Gone(Entity),
}

impl Changes<'_, '_> {
    /// Returns the number of entities whose visibility is checked.
    pub(crate) fn count(&self) -> usize {
        self.entities.iter().len()
    }

    /// Whether messages were dropped before they were read, because the system did not run for some frames.
    pub(crate) fn has_missed(&self) -> bool {
        missed(&self.no_transform)
            || missed(&self.no_aabb)
            || missed(&self.no_sphere)
            || missed(&self.culled_again)
            || missed(&self.taken_in)
    }

    /// Skips the messages up to now.
    pub(crate) fn skip_messages(&mut self) {
        self.no_transform.clear();
        self.no_aabb.clear();
        self.no_sphere.clear();
        self.culled_again.clear();
        self.taken_in.clear();
    }

    /// Passes all changes since the last run of the system to `take`, until it returns `Break`. An entity may appear
    /// several times.
    pub(crate) fn follow(&mut self, mut take: impl FnMut(Received) -> ControlFlow<()>) -> ControlFlow<()> {
        for entity in self.no_transform.read() {
            take(Received::Gone(entity))?;
        }
        for entity in &self.left_out {
            take(Received::Gone(entity))?;
        }
        let altered = self.no_aabb.read().chain(self.no_sphere.read());
        for entity in altered.chain(self.culled_again.read()).chain(self.taken_in.read()) {
            // A removed entity is not in the query.
            if let Ok((_, _, aabb, sphere, no_culling, _)) = self.entities.get(entity) {
                let has_bounds = no_culling.is_none() && (aabb.is_some() || sphere.is_some());
                take(Received::Changed { entity, has_bounds })?;
            }
        }
        self.for_each_changed(|entity, has_bounds| take(Received::Changed { entity, has_bounds }))
    }

    /// Whether more than `most` entities have changed since the last run of the system.
    pub(crate) fn are_more_changed_than(&self, most: usize) -> bool {
        let mut changed = 0;
        let count = |_, _| {
            changed += 1;
            if changed > most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        self.for_each_changed(count).is_break()
    }

    /// Passes to `take` each entity that is new or has changed since the last run of the system, and whether it has
    /// bounds.
    fn for_each_changed(&self, mut take: impl FnMut(Entity, bool) -> ControlFlow<()>) -> ControlFlow<()> {
        let tables = self.entities.contiguous_iter().expect("Bevy keeps these components in tables");
        for (entities, transforms, aabbs, spheres, no_culling, view_visibilities) in tables {
            let (last_run, this_run) = (transforms.last_run_tick(), transforms.this_run_tick());
            let has_bounds = no_culling.is_none() && (aabbs.is_some() || spheres.is_some());
            let columns = [
                Some(transforms.changed_ticks_slice()),
                aabbs.map(|aabbs| aabbs.changed_ticks_slice()),
                spheres.map(|spheres| spheres.changed_ticks_slice()),
                no_culling.map(|no_culling| no_culling.added_ticks_slice()),
                // Bevy adds this component after all others that the query requires.
                Some(view_visibilities.added_ticks_slice()),
            ];
            let is_newer = |tick: &Tick| tick.is_newer_than(last_run, this_run);
            for start in (0..entities.len()).step_by(ROWS) {
                let rows = start..entities.len().min(start + ROWS);
                let is_any_newer =
                    |ticks: &[Tick]| ticks.iter().fold(false, |any, tick| any | is_newer(tick));
                if !columns.iter().flatten().any(|column| is_any_newer(&column[rows.clone()])) {
                    continue;
                }
                for row in rows {
                    if columns.iter().flatten().any(|column| is_newer(&column[row])) {
                        take(entities[row], has_bounds)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Passes to `take` every entity, whether it has bounds, and its transform.
    pub(crate) fn for_each(&self, mut take: impl FnMut(Entity, bool, &GlobalTransform)) {
        for (entity, transform, aabb, sphere, no_culling, _) in &self.entities {
            let has_bounds = no_culling.is_none() && (aabb.is_some() || sphere.is_some());
            take(entity, has_bounds, &transform);
        }
    }

    /// Returns the bounds of an entity.
    pub(crate) fn bounds(&self, entity: Entity) -> Bounds {
        match self.entities.get(entity) {
            Ok((_, transform, aabb, sphere, None, _)) => {
                let bounds: Option<WorldBox> = world_box(&transform, aabb.as_deref(), sphere.as_deref());
                bounds.map_or(Bounds::Unknown, Bounds::Box)
            }
            Ok(_) => Bounds::Unknown,
            Err(_) => Bounds::Gone,
        }
    }
}

fn missed<T: Component>(removed: &RemovedComponents<'_, '_, T>) -> bool {
    removed.messages().is_some_and(|messages| removed.reader().missed_messages(messages) > 0)
}
