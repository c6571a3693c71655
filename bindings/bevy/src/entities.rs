//! The state of each entity: whether it is in the index, or must be tested in every frame.
//!
//! An entity's number in the index is the index of its [`Entity`]. Its record contains the whole `Entity`, to detect
//! that another entity reuses the number.
//!
//! ```text
//!            changes            rests for some frames
//! indexed ───────────> loose ─────────────────────────> indexed
//!                        └─ no box, not finite, NoFrustumCulling ──> always
//! ```
//!
//! A loose entity stays in the index with its old box until it settles. An entity that moves in every frame therefore
//! causes no changes of the index. Every loose entity is a candidate for every view, so its old box does no harm.

use std::collections::VecDeque;

use bevy_ecs::entity::Entity;
use osp::{
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb as WorldBox, Frustum},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

/// The list that contains an entity's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The entity is not tracked.
    Absent,
    /// The entity is in `always`, because no box bounds it.
    Always,
    /// The entity is in `loose`, because it has changed lately.
    Loose,
    /// The entity is in the index.
    Indexed,
}

#[derive(Clone, Copy, Debug)]
struct Record {
    entity: Entity,
    /// The frame of the last change.
    changed_in: u32,
    state: State,
    /// Whether the entity's number is in the queue.
    is_queued: bool,
    /// Whether the entity is in the index. A loose entity may be in the index with an old box.
    is_inserted: bool,
}

const ABSENT: Record = Record {
    entity: Entity::PLACEHOLDER,
    changed_in: 0,
    state: State::Absent,
    is_queued: false,
    is_inserted: false,
};

/// The bounds of an entity when it settles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bounds {
    /// The entity no longer exists.
    Gone,
    /// The box is unknown, or must not be used for culling.
    Unknown,
    /// The entity has this box in world space.
    Box(WorldBox),
}

/// The error for an entity whose index is too large for the index of boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BeyondLimit;

#[derive(Debug)]
pub(crate) struct Entities {
    index: Osp,
    /// Records by the index of the entity.
    records: Vec<Record>,
    always: VisibleBlocks,
    loose: VisibleBlocks,
    /// Numbers of all loose entities, and of some entities that are no longer loose.
    queue: VecDeque<u32>,
    frame: u32,
}

impl Default for Entities {
    fn default() -> Self {
        Self {
            index: Osp::new(&IndexConfig { capacity: 0, ..IndexConfig::default() }),
            records: Vec::new(),
            always: VisibleBlocks::new(),
            loose: VisibleBlocks::new(),
            queue: VecDeque::new(),
            frame: 0,
        }
    }
}

impl Entities {
    /// Removes everything, and creates an index for `capacity` entities in the cube `root`.
    pub(crate) fn begin(&mut self, root: WorldBox, capacity: usize) {
        self.clear();
        self.index = Osp::new(&IndexConfig { root, capacity });
    }

    /// Removes everything.
    pub(crate) fn clear(&mut self) {
        self.index.clear();
        self.records.clear();
        self.always.clear();
        self.loose.clear();
        self.queue.clear();
    }

    /// Returns the number of entities in the index, including loose entities with an old box.
    pub(crate) fn indexed(&self) -> usize {
        self.index.len()
    }

    /// Returns the number of entities that have changed lately.
    pub(crate) fn loose(&self) -> usize {
        self.loose.len()
    }

    /// Returns the number of entities that are found for every view.
    pub(crate) fn always(&self) -> usize {
        self.always.len()
    }

    /// Starts the next frame.
    pub(crate) fn next_frame(&mut self) {
        self.frame = self.frame.wrapping_add(1);
    }

    /// Adds or updates an entity. `has_bounds` is whether it has a box or a sphere, and no component that forbids
    /// culling by it.
    #[inline]
    pub(crate) fn note(&mut self, entity: Entity, has_bounds: bool) -> Result<(), BeyondLimit> {
        let number = entity.index_u32();
        if number >= PolygonId::LIMIT {
            return Err(BeyondLimit);
        }
        let at = number as usize;
        if at >= self.records.len() {
            self.records.resize(at + 1, ABSENT);
        }
        let record = &mut self.records[at];
        record.changed_in = self.frame;
        let state = if has_bounds { State::Loose } else { State::Always };
        if record.entity == entity && record.state == state {
            return Ok(());
        }
        record.entity = entity;
        self.enter(number, state);
        Ok(())
    }

    /// Stops tracking an entity.
    pub(crate) fn forget(&mut self, entity: Entity) {
        let number = entity.index_u32();
        if self.records.get(number as usize).is_some_and(|record| record.entity == entity) {
            self.enter(number, State::Absent);
        }
    }

    fn enter(&mut self, number: u32, state: State) {
        let record = &mut self.records[number as usize];
        let id = PolygonId(number);
        let (block, mask) = (number as usize / BLOCK, 1 << (number as usize % BLOCK));
        match std::mem::replace(&mut record.state, state) {
            State::Absent => {}
            State::Always => self.always.remove_block(block, mask),
            State::Loose => self.loose.remove_block(block, mask),
            State::Indexed => {}
        }
        let is_to_leave = matches!(state, State::Absent | State::Always);
        if is_to_leave && std::mem::take(&mut record.is_inserted) {
            // This does not fail, because no other code removes the entity.
            self.index.remove(id).expect("what is inserted is in the index");
        }
        match state {
            State::Absent => record.entity = Entity::PLACEHOLDER,
            State::Always => drop(self.always.insert(id)),
            State::Loose => {
                self.loose.insert(id);
                if !std::mem::replace(&mut record.is_queued, true) {
                    self.queue.push_back(number);
                }
            }
            State::Indexed => {}
        }
    }

    /// Puts at most `most` entities that have not changed for `frames` frames into the index.
    pub(crate) fn settle(&mut self, most: usize, frames: u32, mut bounds_of: impl FnMut(Entity) -> Bounds) {
        let mut settled = 0;
        // Up to `most` entities that still change are examined, too.
        for _ in 0..self.queue.len().min(2 * most) {
            if settled == most {
                break;
            }
            let Some(number) = self.queue.pop_front() else { break };
            let Record { entity, changed_in, state, .. } = self.records[number as usize];
            if state == State::Loose && self.frame.wrapping_sub(changed_in) < frames {
                self.queue.push_back(number);
                continue;
            }
            self.records[number as usize].is_queued = false;
            if state != State::Loose {
                continue;
            }
            settled += 1;
            let state = match bounds_of(entity) {
                Bounds::Gone => State::Absent,
                Bounds::Unknown => State::Always,
                Bounds::Box(bounds) => {
                    let (id, record) = (PolygonId(number), &mut self.records[number as usize]);
                    let inserted = if record.is_inserted {
                        self.index.update(id, &bounds)
                    } else {
                        self.index.insert(id, &bounds)
                    };
                    // A refused update leaves the old box in the index.
                    record.is_inserted |= inserted.is_ok();
                    if inserted.is_ok() { State::Indexed } else { State::Always }
                }
            };
            self.enter(number, state);
        }
        self.index.commit();
    }

    /// Finds the numbers of all entities that a view with this frustum may see.
    pub(crate) fn find(&self, frustum: &Frustum, found: &mut VisibleBlocks) {
        found.clear();
        self.index.frustum_cull_blocks(frustum, found);
        found.add(&self.loose);
        found.add(&self.always);
    }

    /// Returns the entities with these numbers. Their indices ascend, so no entity appears twice.
    pub(crate) fn list(&self, found: &VisibleBlocks, entities: &mut Vec<Entity>) {
        entities.clear();
        entities.reserve(found.len());
        entities.extend(found.ids().map(|id| self.records[id.index()].entity));
    }

    /// Checks that each entity is in exactly one list. For tests.
    #[cfg(test)]
    pub(crate) fn validate(&self) {
        self.index.validate().unwrap();
        let mut counts = [0; 3];
        for (number, record) in self.records.iter().enumerate() {
            let id = PolygonId(number as u32);
            let is_inserted = self.index.bounds(id).is_some();
            assert_eq!(is_inserted, record.is_inserted, "{record:?}");
            let is_indexed = is_inserted && record.state != State::Loose;
            let places = [is_indexed, self.loose.contains(id), self.always.contains(id)];
            let expected = match record.state {
                State::Absent => [false; 3],
                State::Indexed => [true, false, false],
                State::Loose => [false, true, false],
                State::Always => [false, false, true],
            };
            assert_eq!(places, expected, "{record:?}");
            assert!(record.state == State::Absent || record.entity.index_u32() == id.0);
            assert!(record.state != State::Loose || record.is_queued);
            let places = [is_inserted, places[1], places[2]];
            counts.iter_mut().zip(places).for_each(|(count, is_there)| *count += usize::from(is_there));
        }
        assert_eq!(counts, [self.indexed(), self.loose(), self.always()]);
    }
}

#[cfg(test)]
mod tests {
    use bevy_ecs::world::World;
    use osp::glam::Vec3;

    use super::*;

    fn cube_at(x: f32) -> WorldBox {
        WorldBox::cube(Vec3::new(x, 0.0, 0.0), 1.0)
    }

    #[test]
    fn an_entity_settles_moves_and_goes() {
        let entity = World::new().spawn_empty().id();
        let mut entities = Entities::default();
        let mut found = VisibleBlocks::new();
        entities.note(entity, true).unwrap();
        for frame in 0..5 {
            entities.validate();
            entities.settle(16, 3, |asked| {
                assert_eq!(asked, entity);
                Bounds::Box(cube_at(0.0))
            });
            assert_eq!((entities.loose(), entities.indexed()), if frame < 3 { (1, 0) } else { (0, 1) });
            entities.find(&Frustum::everything(), &mut found);
            assert_eq!(found.len(), 1);
            entities.next_frame();
        }
        // The entity moves away and back. The index has it once, at its old place.
        entities.note(entity, true).unwrap();
        entities.validate();
        assert_eq!((entities.loose(), entities.indexed()), (1, 1));
        (0..3).for_each(|_| entities.next_frame());
        entities.settle(16, 3, |_| Bounds::Box(cube_at(9.0)));
        entities.validate();
        assert_eq!((entities.loose(), entities.indexed()), (0, 1));
        assert_eq!(entities.index.bounds(PolygonId(entity.index_u32())), Some(cube_at(9.0)));
        // The index refuses this box, so the entity is always tested.
        entities.note(entity, true).unwrap();
        (0..3).for_each(|_| entities.next_frame());
        entities.settle(16, 3, |_| Bounds::Box(cube_at(f32::NAN)));
        entities.validate();
        assert_eq!((entities.always(), entities.indexed()), (1, 0));
        entities.note(entity, true).unwrap();
        entities.note(entity, false).unwrap();
        entities.validate();
        assert_eq!((entities.loose(), entities.always()), (0, 1));
        entities.forget(entity);
        entities.validate();
        entities.find(&Frustum::everything(), &mut found);
        assert!(found.is_empty());
    }

    #[test]
    fn a_number_that_another_entity_gets_is_not_mixed_up() {
        let first = World::new().spawn_empty().id();
        let second = Entity::from_index_and_generation(first.index(), first.generation().after_versions(1));
        assert_ne!(first, second);

        let mut entities = Entities::default();
        entities.note(first, true).unwrap();
        entities.next_frame();
        entities.settle(16, 1, |_| Bounds::Box(cube_at(5.0)));
        // The new entity is reported first, and then the removal of the old one.
        entities.note(second, true).unwrap();
        entities.forget(first);
        entities.validate();
        entities.next_frame();
        entities.settle(16, 1, |asked| {
            assert_eq!(asked, second);
            Bounds::Box(cube_at(0.0))
        });
        entities.validate();
        assert_eq!(entities.indexed(), 1);
        let mut listed = Vec::new();
        entities.list(&[PolygonId(second.index_u32())].into_iter().collect(), &mut listed);
        assert_eq!(listed, [second]);
    }

    #[test]
    fn what_the_index_refuses_is_tested_always() {
        let mut world = World::new();
        let mut entities = Entities::default();
        let bounds = [
            Bounds::Box(WorldBox::EMPTY),
            Bounds::Box(cube_at(f32::NAN)),
            Bounds::Unknown,
            Bounds::Gone,
            Bounds::Box(cube_at(0.0)),
        ];
        for _ in bounds {
            entities.note(world.spawn_empty().id(), true).unwrap();
        }
        entities.next_frame();
        let mut next = bounds.into_iter();
        entities.settle(16, 1, |_| next.next().unwrap());
        entities.validate();
        assert_eq!((entities.always(), entities.indexed(), entities.loose()), (3, 1, 0));
    }
}
