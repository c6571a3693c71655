use std::hint::black_box;

use bevy_ecs::{
    entity::Entity,
    query::{IterQueryData, QueryFilter, QueryItem},
    system::Query,
};
use bevy_tasks::ComputeTaskPool;
use bevy_utils::Parallel;

/// Least number of entities for a thread. For fewer, waking another thread takes longer than the tests.
const LEAST_PART: usize = 1024;

/// Number of entities whose components are fetched before the first of these entities is tested. The components lie far
/// apart in memory. Fetching them one after the other would take several times as long.
const AT_ONCE: usize = 16;

/// A list of entities in which each occurs once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distinct<'a>(&'a [Entity]);

impl<'a> Distinct<'a> {
    /// Wraps entities with ascending indices, as a set yields them. Panics if the indices do not ascend.
    pub(crate) fn ascending(entities: &'a [Entity]) -> Self {
        let do_ascend = entities.is_sorted_by(|a, b| a.index_u32() < b.index_u32());
        assert!(do_ascend, "the numbers of a set ascend");
        Self(entities)
    }

    pub(crate) fn len(self) -> usize {
        self.0.len()
    }

    /// Calls `check` for the query's item of each entity, on the threads of the task pool, with a value that each
    /// thread keeps. `touch` reads the data that `check` will read, so that the memory of several items is fetched at
    /// once.
    ///
    /// Bevy's own method compares each entity with every other entity.
    pub(crate) fn for_each<D: IterQueryData, F: QueryFilter, T: Default + Send>(
        self,
        query: &mut Query<'_, '_, D, F>,
        locals: &Parallel<T>,
        touch: impl Fn(&QueryItem<'_, '_, D>) -> u32 + Sync,
        check: impl Fn(QueryItem<'_, '_, D>, &mut T) + Sync,
    ) {
        let query = &*query;
        let check_part = |part: &[Entity]| {
            let mut local = locals.borrow_local_mut();
            for few in part.chunks(AT_ONCE) {
                let mut items: [_; AT_ONCE] = std::array::from_fn(|at| {
                    let entity = *few.get(at)?;
                    // SAFETY: the query is borrowed mutably, so only this function uses it. All entities are different,
                    // and the parts have none in common, so each item is fetched once.
                    #[expect(unsafe_code, reason = "the safe method takes quadratic time")]
                    unsafe {
                        query.get_unchecked(entity).ok()
                    }
                });
                black_box(items.iter().flatten().fold(0, |sum, item| sum ^ touch(item)));
                for item in items.iter_mut().filter_map(Option::take) {
                    check(item, &mut local);
                }
            }
        };
        let threads = ComputeTaskPool::try_get().map_or(1, |pool| pool.thread_num());
        let parts = (self.len() / LEAST_PART).min(threads);
        if parts <= 1 {
            check_part(self.0);
            return;
        }
        let check_part = &check_part;
        ComputeTaskPool::get().scope(|scope| {
            for part in self.0.chunks(self.len().div_ceil(parts)) {
                scope.spawn(async move { check_part(part) });
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use bevy_ecs::{component::Component, system::RunSystemOnce, world::World};
    use bevy_tasks::TaskPoolBuilder;

    use super::*;

    #[derive(Component, Default)]
    struct Visits(usize);

    #[test]
    fn each_is_visited_once() {
        ComputeTaskPool::get_or_init(|| TaskPoolBuilder::new().num_threads(3).build());
        for count in [0, 1, LEAST_PART - 1, 2 * LEAST_PART - 1, 2 * LEAST_PART, 7001] {
            let mut world = World::new();
            let mut all = (0..count).map(|_| world.spawn(Visits(0)).id()).collect::<Vec<_>>();
            all.sort_unstable_by_key(|id| id.index_u32());
            // Entities that no longer exist are skipped.
            let gone = all.iter().copied().step_by(7).collect::<Vec<_>>();
            assert!(gone.iter().all(|id| world.despawn(*id)));
            let listed = all.clone();
            let visit = move |mut query: Query<'_, '_, &mut Visits>| {
                let mut locals = Parallel::<usize>::default();
                Distinct::ascending(&listed).for_each(
                    &mut query,
                    &locals,
                    |visits| visits.0 as u32,
                    |mut visits, local| {
                        visits.0 += 1;
                        *local += 1;
                    },
                );
                locals.iter_mut().map(|local| *local).sum::<usize>()
            };
            assert_eq!(world.run_system_once(visit).unwrap(), count - gone.len());
            assert!(world.query::<&Visits>().iter(&world).all(|visits| visits.0 == 1));
        }
    }

    #[test]
    #[should_panic(expected = "ascend")]
    fn twice_the_same_is_refused() {
        let entity = World::new().spawn_empty().id();
        Distinct::ascending(&[entity, entity]);
    }
}
