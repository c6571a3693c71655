//! The resource of the plugin: the choice between the two methods, and the entities that the index finds for a view.

use std::ops::ControlFlow;

use bevy_ecs::{entity::Entity, resource::Resource};
use osp::{
    glam::Vec3,
    math::{Aabb as WorldBox, Frustum},
    polygon::VisibleBlocks,
};

use crate::{
    changes::{Changes, Received},
    costs::{Kind, Meter},
    distinct::Distinct,
    entities::Entities,
    settings::OspCullingSettings,
};

/// Number of frames to wait before the changes are examined again, after the plugin has dropped an index or has decided
/// against an index. Each failed attempt doubles the number.
const LEAST_WAIT_FRAMES: u32 = 16;

/// Largest number of frames to wait.
const MOST_WAIT_FRAMES: u32 = 4096;

/// If an index has existed for this many frames, the next wait is short again.
const KEPT_FRAMES: u32 = 512;

/// An index counts as filled if at most one of this many entities is loose.
const LOOSE_PART: usize = 16;

/// Approximate number of frames over which the mean number of changes is taken.
const MEAN_FRAMES: f32 = 16.0;

/// Largest mean number of entities that may change in a frame, for any number of entities. Tracking an entity that lies
/// far away in memory takes some microseconds. With more changes, a plain pass over a million entities is as fast.
const MOST_CHANGED: usize = 6000;

/// Least number of entities that may settle in a frame, so that a small index is filled soon.
const LEAST_SETTLED: usize = 64;

/// Counts of the plugin's work in the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OspCullingCounts {
    /// Number of entities whose visibility is tracked: with a `ViewVisibility` and without `NoCpuCulling`.
    pub entities: usize,
    /// Number of these entities in the index; 0 without an index.
    pub indexed: usize,
    /// Number of entities that have changed recently, or are not in the index yet. They are tested for every view. Some
    /// of them are also in the index, with an old box.
    pub loose: usize,
    /// Number of entities that are tested for every view because they have no finite box, or because a component
    /// forbids culling by the box.
    pub always: usize,
    /// Number of views that were culled by the index.
    pub views_by_index: usize,
    /// Number of views that were culled by a plain pass.
    pub views_by_pass: usize,
    /// Number of shadow views of lights that were culled by the index: cascades, six faces of a point light, spot
    /// lights.
    pub shadows_by_index: usize,
    /// Number of shadow views that were culled by a plain pass.
    pub shadows_by_pass: usize,
    /// Number of entities that the index found for all these views, before Bevy's own test.
    pub found: usize,
    /// Number of entities in view that an [`Occluder`](crate::Occluder) hides, for all views.
    pub occluded: usize,
}

/// The index of the world's entities. The plugin adds and updates this resource. Any system may read its counts.
#[derive(Resource, Debug, Default)]
pub struct OspCulling {
    entities: Entities,
    /// Whether the system is in the schedule.
    is_in_place: bool,
    /// Whether the systems for lights are in the schedule.
    #[cfg(feature = "light")]
    pub(crate) are_lights_in_place: bool,
    is_indexed: bool,
    wait_frames: u32,
    /// Number of frames since the present wait or the present index began.
    frames: u32,
    /// Mean number of entities that change in a frame, over the last frames.
    mean_changed: f32,
    /// Number of changes in a frame from which on no index is started, because an index has cost more than it saved.
    too_many: Option<usize>,
    meter: Meter,
    counts: OspCullingCounts,
    found: VisibleBlocks,
    list: Vec<Entity>,
}

impl OspCulling {
    /// Returns the counts of the last frame.
    pub fn counts(&self) -> &OspCullingCounts {
        &self.counts
    }

    /// Whether there is an index. It may not be full yet.
    pub fn is_indexed(&self) -> bool {
        self.is_indexed
    }

    pub(crate) fn is_in_place(&self) -> bool {
        self.is_in_place
    }

    pub(crate) fn set_in_place(&mut self) {
        self.is_in_place = true;
    }

    pub(crate) fn counts_mut(&mut self) -> &mut OspCullingCounts {
        &mut self.counts
    }

    /// Counts views that were culled by the index, which found `found` candidates, or by one plain pass.
    pub(crate) fn end_views(&mut self, kind: Kind, views: usize, found: Option<usize>) {
        let counts = &mut self.counts;
        let count = match (kind, found.is_some()) {
            (Kind::Camera, true) => &mut counts.views_by_index,
            (Kind::Camera, false) => &mut counts.views_by_pass,
            (_, true) => &mut counts.shadows_by_index,
            (_, false) => &mut counts.shadows_by_pass,
        };
        *count += views;
        // One pass tests all faces of a point light.
        let parts = if matches!(kind, Kind::Lamp) { 1 } else { views };
        self.meter.end_views(kind, parts, found, counts.entities);
    }

    /// Begins a frame: updates, drops or starts the index.
    pub(crate) fn follow(&mut self, settings: &OspCullingSettings, changes: &mut Changes<'_, '_>) {
        let entities = changes.count();
        self.meter.start(settings.is_measured && self.is_indexed);
        self.entities.next_frame();
        self.frames = self.frames.saturating_add(1);
        let is_large = entities >= settings.least_entities;
        if self.is_indexed {
            // The limit is a quarter lower here. Otherwise a number of entities near the limit would start and drop the
            // index again and again.
            if !is_large && entities < settings.least_entities - settings.least_entities / 4 {
                self.give_up(0);
            } else if changes.has_missed() {
                self.begin(changes, entities);
            } else {
                self.apply(settings, changes, entities);
            }
        } else if is_large && self.frames > self.wait_frames {
            let most = most_mean(settings, entities).min(self.too_many.unwrap_or(usize::MAX));
            if changes.are_more_changed_than(most) {
                self.too_many = self.too_many.map(|many| many + many / 8 + 1);
                self.wait_longer();
            } else {
                self.begin(changes, entities);
            }
        }
        if self.is_indexed {
            let most = (entities / settings.fill_frames.max(1) as usize).max(LEAST_SETTLED);
            self.entities.settle(most, settings.settle_frames.max(1), |entity| changes.bounds(entity));
        }
        let is_filled =
            self.entities.loose() * LOOSE_PART <= entities || self.frames > 4 * settings.fill_frames;
        if self.meter.end_changes(is_filled) && self.is_indexed {
            self.too_many = Some(self.mean_changed as usize / 2);
            self.give_up(self.wait_frames);
            self.wait_longer();
        }
        self.counts = OspCullingCounts {
            entities,
            indexed: self.entities.indexed(),
            loose: self.entities.loose(),
            always: self.entities.always(),
            ..OspCullingCounts::default()
        };
    }

    /// Updates the index with the changes, unless there are too many.
    fn apply(&mut self, settings: &OspCullingSettings, changes: &mut Changes<'_, '_>, entities: usize) {
        let most = OspCullingSettings::part(settings.most_moved_at_once, entities);
        let mut left = most;
        let followed = &mut self.entities;
        let flow = changes.follow(|received| {
            match received {
                Received::Gone(entity) => followed.forget(entity),
                Received::Changed { entity, has_bounds } => {
                    if left == 0 || followed.note(entity, has_bounds).is_err() {
                        return ControlFlow::Break(());
                    }
                    left -= 1;
                }
            }
            ControlFlow::Continue(())
        });
        self.mean_changed += ((most - left) as f32 - self.mean_changed) / MEAN_FRAMES;
        if flow.is_break() || self.mean_changed > most_mean(settings, entities) as f32 {
            let wait_frames = if self.frames > KEPT_FRAMES { 0 } else { self.wait_frames };
            self.give_up(wait_frames);
            self.wait_longer();
        }
    }

    /// Starts an index of all entities. They are all loose at first.
    fn begin(&mut self, changes: &mut Changes<'_, '_>, entities: usize) {
        changes.skip_messages();
        let mut root = WorldBox::EMPTY;
        changes.for_each(|_, _, transform| {
            let place = Vec3::from(transform.translation().to_array());
            if place.is_finite() {
                root = root.union(&WorldBox::new(place, place));
            }
        });
        self.entities.begin(cube_around(&root), entities);
        let mut is_within = true;
        changes.for_each(|entity, has_bounds, _| is_within &= self.entities.note(entity, has_bounds).is_ok());
        self.meter.begin_index();
        (self.is_indexed, self.frames, self.mean_changed) = (true, 0, 0.0);
        if !is_within {
            self.give_up(MOST_WAIT_FRAMES);
        }
    }

    fn give_up(&mut self, wait_frames: u32) {
        self.entities.clear();
        (self.is_indexed, self.frames, self.wait_frames) = (false, 0, wait_frames);
    }

    fn wait_longer(&mut self) {
        self.frames = 0;
        self.wait_frames = (self.wait_frames * 2).clamp(LEAST_WAIT_FRAMES, MOST_WAIT_FRAMES);
    }

    /// Returns the entities that may lie within the frustum. `None` if a plain pass is faster. Call `end_views` after
    /// the tests.
    pub(crate) fn candidates(
        &mut self,
        settings: &OspCullingSettings,
        kind: Kind,
        frustum: &Frustum,
    ) -> Option<Distinct<'_>> {
        self.meter.start(settings.is_measured);
        let entities = self.counts.entities;
        let most = OspCullingSettings::part(settings.most_found, entities);
        if !self.is_indexed || self.entities.loose() + self.entities.always() > most {
            return None;
        }
        self.entities.find(frustum, &mut self.found);
        let found = self.found.len();
        if found > most || settings.is_measured && self.meter.is_pass_faster(kind, found, entities) {
            return None;
        }
        self.entities.list(&self.found, &mut self.list);
        self.counts.found += self.list.len();
        Some(Distinct::ascending(&self.list))
    }
}

/// Returns the largest mean number of entities that may change in a frame.
fn most_mean(settings: &OspCullingSettings, entities: usize) -> usize {
    match OspCullingSettings::part(settings.most_moved, entities) {
        usize::MAX => usize::MAX,
        part => part.min(MOST_CHANGED),
    }
}

/// Returns a cube around a box.
fn cube_around(bounds: &WorldBox) -> WorldBox {
    if !bounds.is_valid() {
        return osp::index::IndexConfig::default().root;
    }
    WorldBox::cube(bounds.center(), bounds.extent().max_element() * 1.01 + 1.0)
}
