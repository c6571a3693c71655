//! Selects the method of a query. The walk in the order of the ids is short if planes cut few groups of consecutive ids,
//! as in drawn models, small models, and models that lie wholly in view. Otherwise the tree answers for the polygons that
//! it holds, and the walk for the rest. Counted work decides, so the choice is the same on every machine.

use std::cell::Cell;

use super::{
    answer::{Answer, Listing, Pair},
    in_order::{FindShelves, InOrder, Of, Seen},
    index::Osp,
    query::Cull,
    residence::Demand,
    shelf::GROUPS,
    tuning::MOST_IN_ORDER_SCATTERED,
};
use crate::{
    index::{
        WorkCounts,
        mask_writer::{MaskWriter, RunSink, SetAll},
        simd::{IdWriter, PlaneSet},
    },
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

    /// Walks the tree for views that see nearly the same.
    fn cull_tree<A: Answer<V>, const V: usize>(&self, planes: &[PlaneSet; V], answer: A) -> (WorkCounts, A) {
        self.backend.run(Cull { osp: self, planes, answer })
    }

    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let planes = self.planes(frustum);
        with_seen(|seen| {
            let out = IdWriter::new(draw_list);
            let (mut work, mut out, mut of) = (WorkCounts::default(), out, Of::All);
            if !self.is_in_order(&planes, seen) {
                (work, out) = self.cull_tree(std::array::from_ref(&planes), out);
                of = Of::Unfiled;
                self.find_unfiled(&planes, seen);
            }
            let (in_order, out) = self.in_order(&planes, of, seen, out);
            work += in_order;
            out.finish();
            work
        })
    }

    pub(super) fn cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let planes = self.planes(frustum);
        if let Some(work) = self.cull_in_order(&planes, visible) {
            return work;
        }
        let views = std::array::from_ref(&planes);
        let mut work = if self.store.are_scattered() {
            visible.with_list(self.store.len(), |visible, ids| {
                let work = self.fill(visible, |runs| {
                    let (work, all) = self.cull_tree(views, Listing { runs, singles: IdWriter::new(ids) });
                    all.singles.finish();
                    (work, all.runs)
                });
                self.backend.run(SetAll { visible, ids });
                work
            })
        } else {
            self.fill(visible, |out| self.cull_tree(views, out))
        };
        work += self.cull_unfiled(&planes, visible);
        work
    }

    /// Culls one view for each set. Two views that see nearly the same, such as those of two eyes, are culled in one walk
    /// of the tree. The walls of a CAVE, the faces of a cube map and shadow cascades share few nodes. For them, the
    /// tests of several views would cost more than such a walk would save.
    pub(super) fn cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        let views = frusta.len().min(visible.len());
        let mut at = 0;
        while at < views {
            match (&frusta[at..views], &mut visible[at..views]) {
                ([a, b, ..], [first, second, ..]) if !self.store.are_scattered() && are_alike(a, b) => {
                    let planes = [PlaneSet::new(a), PlaneSet::new(b)];
                    if let Some(of_first) = self.cull_in_order(&planes[0], first) {
                        work += of_first;
                        work += self.cull_blocks(b, second);
                    } else {
                        work += self.cull_pair(&planes, first, second);
                        work += self.cull_unfiled(&planes[0], first);
                        work += self.cull_unfiled(&planes[1], second);
                    }
                    at += 2;
                }
                _ => {
                    work += self.cull_blocks(&frusta[at], &mut visible[at]);
                    at += 1;
                }
            }
        }
        work
    }

    /// Culls by the walk in the order of the ids; `None` without effect if it does not answer alone.
    fn cull_in_order(&self, planes: &PlaneSet, visible: &mut VisibleBlocks) -> Option<WorkCounts> {
        with_seen(|seen| {
            self.is_in_order(planes, seen).then(|| self.fill_in_order(planes, Of::All, seen, visible))
        })
    }

    /// Adds the polygons that are not in the tree.
    fn cull_unfiled(&self, planes: &PlaneSet, visible: &mut VisibleBlocks) -> WorkCounts {
        if self.store.unfiled() == 0 {
            return WorkCounts::default();
        }
        with_seen(|seen| {
            self.find_unfiled(planes, seen);
            self.fill_in_order(planes, Of::Unfiled, seen, visible)
        })
    }

    fn fill_in_order(
        &self,
        planes: &PlaneSet,
        of: Of,
        seen: &[Seen],
        visible: &mut VisibleBlocks,
    ) -> WorkCounts {
        self.fill(visible, |out| self.in_order(planes, of, seen, out))
    }

    fn in_order<S: RunSink>(&self, planes: &PlaneSet, of: Of, seen: &[Seen], out: S) -> (WorkCounts, S) {
        self.backend.run(InOrder { store: &self.store, planes, of, seen, out })
    }

    fn cull_pair(
        &self,
        planes: &[PlaneSet; 2],
        first: &mut VisibleBlocks,
        second: &mut VisibleBlocks,
    ) -> WorkCounts {
        let end = self.store.ids_end();
        let pair = Pair::new(first.masks_for(end), second.masks_for(end));
        let (work, pair) = self.cull_tree(planes, pair);
        let (blocks, of_first, of_second) = pair.finish();
        first.note_filled(blocks.clone(), of_first);
        second.note_filled(blocks, of_second);
        work
    }

    /// Calls `query` to write the masks of a set.
    fn fill(
        &self,
        visible: &mut VisibleBlocks,
        query: impl FnOnce(MaskWriter<'_>) -> (WorkCounts, MaskWriter<'_>),
    ) -> WorkCounts {
        let (work, out) = query(MaskWriter::new(visible.masks_for(self.store.ids_end())));
        let (blocks, found) = out.finish();
        visible.note_filled(blocks, found);
        work
    }
}

/// Least scalar product of the normals of two similar planes.
const ALIKE: f32 = 0.9;
/// The distances between opposite planes are similar if neither is larger than the other by more than this factor.
const AS_WIDE: f32 = 1.25;

/// Whether two views see nearly the same: each plane of the first has nearly the normal of the second's plane, and the
/// distance between opposite planes is nearly equal.
fn are_alike(a: &Frustum, b: &Frustum) -> bool {
    let (a, b) = (a.planes(), b.planes());
    let slabs = (0..6).flat_map(|i| (0..i).map(move |j| (i, j)));
    a.iter().zip(b).all(|(a, b)| a.normal.dot(b.normal) > ALIKE)
        && slabs.filter(|&(i, j)| a[i].normal.dot(a[j].normal) < -ALIKE).all(|(i, j)| {
            let (wide, other) = (a[i].d + a[j].d, b[i].d + b[j].d);
            wide <= other * AS_WIDE && other <= wide * AS_WIDE
        })
}
