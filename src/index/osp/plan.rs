//! Selects the method of a query. The walk in the order of the ids is short if planes cut few groups of consecutive ids,
//! as in drawn models, small models, and models that lie wholly in view. Otherwise the tree answers for the polygons that
//! it holds, and the walk for the rest. Counted work decides, so the choice is the same on every machine.

use std::{cell::Cell, ops::Range};

use super::{
    answer::{Answer, Blocks, Ids, Listing},
    in_order::{FindShelves, InOrder, Of, Seen},
    index::Osp,
    query::Cull,
    residence::Demand,
    shelf::GROUPS,
    tuning::MOST_IN_ORDER_SCATTERED,
};
use crate::{
    index::{WorkCounts, mask_writer::SetAll, simd::PlaneSet},
    math::Frustum,
    polygon::{PolygonId, VisibleBlocks},
};

thread_local! {
    /// Working memory of a query: the shelves that it may see.
    static SEEN: Cell<Vec<Seen>> = const { Cell::new(Vec::new()) };
}

/// Room for the shelves of four million polygons.
const SHELVES: usize = 1024;

/// Calls `query` with working memory of this thread. If the thread is ending, the memory is new.
pub(super) fn with_seen<R>(query: impl FnOnce(&mut Vec<Seen>) -> R) -> R {
    let mut seen = SEEN.try_with(Cell::take).unwrap_or_default();
    seen.clear();
    seen.reserve(SHELVES);
    let result = query(&mut seen);
    let _ = SEEN.try_with(|kept| kept.set(seen));
    result
}

impl Osp {
    /// Largest number of groups that planes cut in a query by the walk in the order of the ids alone.
    pub(super) fn most_in_order(&self) -> usize {
        match self.store.are_scattered() {
            true => self.most_in_order.min(MOST_IN_ORDER_SCATTERED),
            false => self.most_in_order,
        }
    }

    /// Whether the walk in the order of the ids answers a query alone. Then `seen` has the shelves of the walk.
    fn is_in_order(&self, planes: &PlaneSet, seen: &mut Vec<Seen>) -> bool {
        let (store, most) = (&self.store, self.most_in_order());
        let is_sure = store.filed() == 0 || store.shelf_count() * GROUPS <= most || store.is_mostly_unfiled();
        seen.clear();
        let of = Of::All;
        let is_short = self.backend.run(FindShelves { store, planes, of, most, may_stop: !is_sure, seen });
        self.residence.demand.note(if is_short { Demand::NO } else { Demand::YES });
        is_short || is_sure
    }

    fn find_unfiled(&self, planes: &PlaneSet, seen: &mut Vec<Seen>) {
        seen.clear();
        let (store, of, most) = (&self.store, Of::Unfiled, usize::MAX);
        self.backend.run(FindShelves { store, planes, of, most, may_stop: false, seen });
    }

    /// The planes of a frustum. For scattered polygons, two opposite planes come first, such as near and far plane: a
    /// test of a wide block then hardly ever ends early, so that a processor can predict it.
    fn planes(&self, frustum: &Frustum) -> PlaneSet {
        if !self.store.are_scattered() {
            return PlaneSet::new(frustum);
        }
        let mut planes = *frustum.planes();
        let along = |pair: usize| planes[2 * pair].normal.dot(planes[2 * pair + 1].normal);
        let opposite = (1..3).fold(0, |least, pair| if along(pair) < along(least) { pair } else { least });
        planes.rotate_left(2 * opposite);
        PlaneSet::new(&Frustum::new(planes))
    }

    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let planes = &self.planes(frustum);
        with_seen(|seen| {
            if self.is_in_order(planes, seen) {
                return self.in_order(planes, Of::All, seen, Ids::new(draw_list)).0;
            }
            let answer = Ids::new(draw_list);
            let mut work = self.backend.run(Cull { osp: self, top: self.top, planes, answer }).0;
            if self.store.unfiled() > 0 {
                self.find_unfiled(planes, seen);
                work += self.in_order(planes, Of::Unfiled, seen, Ids::new(draw_list)).0;
            }
            work
        })
    }

    pub(super) fn cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let planes = &self.planes(frustum);
        if let Some(work) = self.cull_in_order(planes, visible) {
            return work;
        }
        let mut work = if self.store.are_scattered() {
            visible.with_list(self.store.len(), |visible, singles| {
                let work = self.fill(visible, |runs| {
                    let answer = Listing::new(runs, singles);
                    self.backend.run(Cull { osp: self, top: self.top, planes, answer })
                });
                self.backend.run(SetAll { visible, ids: singles });
                work
            })
        } else {
            self.fill(visible, |answer| self.backend.run(Cull { osp: self, top: self.top, planes, answer }))
        };
        work += self.cull_unfiled(planes, visible);
        work
    }

    /// Culls by the walk in the order of the ids; `None` without effect if it does not answer alone.
    pub(super) fn cull_in_order(&self, planes: &PlaneSet, visible: &mut VisibleBlocks) -> Option<WorkCounts> {
        with_seen(|seen| {
            self.is_in_order(planes, seen)
                .then(|| self.fill(visible, |answer| self.in_order(planes, Of::All, seen, answer)))
        })
    }

    /// Adds the polygons that are not in the tree.
    pub(super) fn cull_unfiled(&self, planes: &PlaneSet, visible: &mut VisibleBlocks) -> WorkCounts {
        if self.store.unfiled() == 0 {
            return WorkCounts::default();
        }
        with_seen(|seen| {
            self.find_unfiled(planes, seen);
            self.fill(visible, |answer| self.in_order(planes, Of::Unfiled, seen, answer))
        })
    }

    fn in_order<A: Answer>(
        &self,
        planes: &PlaneSet,
        of: Of,
        seen: &[Seen],
        answer: A,
    ) -> (WorkCounts, A::Done) {
        self.backend.run(InOrder { store: &self.store, planes, of, seen, answer })
    }

    /// Calls `query` to write the masks of a set.
    fn fill(
        &self,
        visible: &mut VisibleBlocks,
        query: impl FnOnce(Blocks<'_>) -> (WorkCounts, (Range<usize>, usize)),
    ) -> WorkCounts {
        let (work, (blocks, found)) = query(Blocks::new(visible.masks_for(self.store.ids_end())));
        visible.note_filled(blocks, found);
        work
    }
}
