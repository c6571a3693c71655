//! Selects the method of a query. If the whole tree is in view, the result is the set of all polygons. If most of the
//! tree is in view, the query searches for the polygons outside the frustum and removes them from this set. Otherwise
//! it searches for the polygons inside. The query therefore reads only the smaller part of the tree. If the polygons
//! are scattered, a query for a list of ids always searches for the polygons inside.

use std::{cell::Cell, ops::Range};

use super::{
    answer::{Answer, Blocks, Filling, Ids, Listing, Outside},
    index::Osp,
    layout::{Node, Target},
    linear::LinearQuery,
    pool::NONE,
    query::{Below, Cull, WorkQueue, count},
};
use crate::{
    index::{
        WorkCounts,
        mask_writer::SetAll,
        simd::{Kernel, PlaneSet, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::{BLOCK, PolygonId, VisibleBlocks, mark},
};

thread_local! {
    /// Working memory of a query that first sets all ids and then clears the ids outside: a bit for each id up to the
    /// highest. Its contents are unspecified before a query.
    static MASKS: Cell<Vec<u16>> = const { Cell::new(Vec::new()) };
}

/// The polygons that a query searches for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plan {
    /// Nothing to search for: all polygons are in view.
    All,
    /// The polygons outside the frustum, to be removed from the set of all.
    Outside,
    /// The polygons inside.
    Inside,
}

impl Osp {
    pub(super) fn cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        let answer = Ids::new(draw_list);
        if self.is_linear {
            return self
                .backend
                .run(LinearQuery { linear: &self.linear, polygons: self.len, frustum, answer })
                .0;
        }
        let planes = PlaneSet::new(frustum);
        let (top, plan, mut work) = self.plan(frustum, &planes);
        match plan {
            // For scattered polygons, copying the ids inside costs less than reading all masks.
            Plan::Outside if !self.ids.are_scattered() => {
                let span = self.ids.span();
                let mut masks = MASKS.try_with(Cell::take).unwrap_or_default();
                if masks.len() < span.len() {
                    masks.resize(span.len(), 0);
                }
                work += self.search_outside(top, &planes, &mut masks, span.start);
                let rest = Listed { osp: self, planes: &planes, masks: &masks, first: span.start, answer };
                work += self.backend.run(rest);
                // If the thread is ending, the memory is freed.
                let _ = MASKS.try_with(|kept| kept.set(masks));
            }
            Plan::All => work += self.backend.run(All { osp: self, planes: &planes, answer }).0,
            _ => work += self.backend.run(Cull { osp: self, top, planes: &planes, answer }).0,
        }
        work
    }

    pub(super) fn cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        if self.is_linear {
            let answer = Blocks::new(visible.masks_for(self.ids_end()));
            let (work, (blocks, found)) =
                self.backend.run(LinearQuery { linear: &self.linear, polygons: self.len, frustum, answer });
            visible.note_filled(blocks, found);
            return work;
        }
        let planes = PlaneSet::new(frustum);
        let planned = self.plan(frustum, &planes);
        self.cull_blocks_by(&planes, planned, visible)
    }

    /// Does the same as [`Osp::cull_blocks`] in a tree, with the result of [`Osp::plan`].
    pub(super) fn cull_blocks_by(
        &self,
        planes: &PlaneSet,
        (top, plan, mut work): (u32, Plan, WorkCounts),
        visible: &mut VisibleBlocks,
    ) -> WorkCounts {
        let is_outside = plan == Plan::Outside && visible.is_empty();
        let found = match plan {
            Plan::All => self.fill(visible, |answer| self.backend.run(All { osp: self, planes, answer })),
            _ if is_outside => {
                let outside = self.fill_by_exclusion(top, planes, visible);
                visible.note_filled(self.ids.span(), outside.reported as usize);
                work += outside;
                self.fill(visible, |answer| self.backend.run(Open { osp: self, planes, answer }))
            }
            _ if self.ids.are_scattered() => visible.with_list(self.len, |visible, singles| {
                let work = self.fill(visible, |runs| {
                    let answer = Listing::new(runs, singles);
                    self.backend.run(Cull { osp: self, top, planes, answer })
                });
                self.backend.run(SetAll { visible, ids: singles });
                work
            }),
            _ => self.fill(visible, |answer| self.backend.run(Cull { osp: self, top, planes, answer })),
        };
        work += found;
        work
    }

    /// Calls `query` to write the masks of a set.
    fn fill(
        &self,
        visible: &mut VisibleBlocks,
        query: impl FnOnce(Blocks<'_>) -> (WorkCounts, (Range<usize>, usize)),
    ) -> WorkCounts {
        let (work, (blocks, found)) = query(Blocks::new(visible.masks_for(self.ids_end())));
        visible.note_filled(blocks, found);
        work
    }

    /// Sets the masks of an empty set to all polygons in the tree except the polygons outside the frustum. The caller
    /// records the written blocks in the set.
    fn fill_by_exclusion(&self, top: u32, planes: &PlaneSet, visible: &mut VisibleBlocks) -> WorkCounts {
        let end = self.ids_end();
        if !self.ids.are_scattered() {
            return self.search_outside(top, planes, visible.masks_for(end), 0);
        }
        visible.with_list(self.len, |visible, singles| {
            let masks = visible.masks_for(end);
            let answer = Listing::new(Outside::new(masks, 0, &self.ids), singles);
            let (work, _) = self.backend.run(Cull { osp: self, top, planes, answer });
            self.backend.run(ClearListed { masks, singles });
            work
        })
    }

    /// Upper bound of all ids, including the ids of the open block.
    pub(super) fn ids_end(&self) -> usize {
        if self.is_linear {
            return self.linear.ids_end();
        }
        let open = if self.open.lanes() == 0 { 0 } else { (self.open.block() as usize + 1) * BLOCK };
        self.ids.ids_end().max(open)
    }

    /// Returns the node at which the query begins, the plan, and the work counts of planning.
    pub(super) fn plan(&self, frustum: &Frustum, planes: &PlaneSet) -> (u32, Plan, WorkCounts) {
        let (mut top, mut passed) = (self.top, 0);
        // Top levels with a single child node are skipped, because their test decides nothing.
        while let Some(below) = self.nodes[top].only_node() {
            (top, passed) = (below, passed + 1);
        }
        let (plan, mut work) = self.backend.run(Weigh { osp: self, top, frustum, planes });
        work.nodes += passed;
        // A search for the polygons outside reads all blocks from the first to the last, so the ids must be dense.
        let is_dense = plan != Plan::Outside || self.ids.span().len() <= self.len;
        (top, if is_dense { plan } else { Plan::Inside }, work)
    }

    /// Sets the masks of all polygons in the tree that are not outside the frustum. `masks` begins with block `first`.
    fn search_outside(&self, top: u32, planes: &PlaneSet, masks: &mut [u16], first: usize) -> WorkCounts {
        let answer = Outside::new(masks, first, &self.ids);
        self.backend.run(Cull { osp: self, top, planes, answer }).0
    }
}

/// Clears the bits of the listed polygons.
struct ClearListed<'a> {
    masks: &'a mut [u16],
    singles: &'a [PolygonId],
}

impl WithKernel for ClearListed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _kernel: K) {
        mark::<false>(self.masks, self.singles);
    }
}

/// Chooses the plan: tests whether all of the tree lies inside the frustum, or estimates whether most of it does.
struct Weigh<'a> {
    osp: &'a Osp,
    top: u32,
    frustum: &'a Frustum,
    planes: &'a PlaneSet,
}

/// Largest number of nodes that are tested for this estimate.
const WEIGHED: usize = 24;

impl WithKernel for Weigh<'_> {
    type Output = (Plan, WorkCounts);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> (Plan, WorkCounts) {
        let mut work = WorkCounts::default();
        let top = &self.osp.nodes[self.top];
        // The other plans read every entry of the id map. They save time only if entries do not outnumber polygons.
        if self.osp.ids.entries() > self.osp.len {
            return (Plan::Inside, work);
        }
        let plan = if holds_all(self.osp, kernel, self.planes, top, &mut work) {
            Plan::All
        } else if !self.osp.is_flat && self.is_mostly_seen(kernel, &mut work) {
            Plan::Outside
        } else {
            Plan::Inside
        };
        (plan, work)
    }
}

/// Whether all polygons in the tree lie inside every plane. Stops at the first box that is not inside every
/// plane.
#[inline(always)]
pub(super) fn holds_all<K: Kernel>(
    osp: &Osp,
    kernel: K,
    planes: &PlaneSet,
    top: &Node,
    work: &mut WorkCounts,
) -> bool {
    work.nodes += 1;
    let used = top.used();
    if used != 0 {
        count(work, 8, PlaneSet::ALL);
        if !planes.hold(kernel, &top.boxes, used) {
            return false;
        }
    }
    let mut at = top.own;
    while at != NONE {
        let bucket = &osp.buckets[at];
        count(work, bucket.page_count, PlaneSet::ALL);
        let [low, high] = &bucket.boxes.0;
        let used = bucket.used();
        if !(planes.hold(kernel, low, used & 0xFF) && planes.hold(kernel, high, used >> 8)) {
            return false;
        }
        at = bucket.next;
    }
    true
}

impl Weigh<'_> {
    /// Estimates from the upper levels whether more of the tree is inside than outside. The weight of a cell is the
    /// number of nodes and leaves in it. A cell that a plane cuts counts by the centre of its box.
    #[inline(always)]
    fn is_mostly_seen<K: Kernel>(&self, kernel: K, work: &mut WorkCounts) -> bool {
        let top = &self.osp.nodes[self.top];
        let mut waiting = WorkQueue::<(Below, i64), { 8 * WEIGHED }>::new();
        waiting.push((Below { number: self.top, planes: PlaneSet::ALL }, 0));
        let mut more_seen = 0i64;
        // The weight that is not decided yet.
        let mut open = i64::from(top.weight());
        let mut tested = 0;
        while tested < WEIGHED && waiting.len() > 0 && more_seen.abs() <= open {
            let (Below { number, planes }, by_center) = waiting.pop();
            more_seen -= by_center;
            let node = &self.osp.nodes[number];
            tested += usize::from(node.used().count_ones() > 1);
            work.nodes += 1;
            count(work, 8, planes);
            let sides = self.planes.sides8(kernel, planes, &node.boxes);
            let mut used = node.used();
            while used != 0 {
                let slot = used.trailing_zeros() as usize % 8;
                used &= used - 1;
                let weight = i64::from(node.nodes_below[slot] + 1);
                let (is_behind, planes) = (sides.behind >> slot & 1 == 1, sides.planes_at(planes, slot));
                let is_seen = !is_behind && (planes == 0 || self.holds_center(&node.boxes.get(slot)));
                let signed = if is_seen { weight } else { -weight };
                more_seen += signed;
                match node.children[slot].target() {
                    Target::Node(number) if !is_behind && planes != 0 => {
                        waiting.push((Below { number, planes }, signed));
                    }
                    _ => open -= weight,
                }
            }
        }
        more_seen > 0
    }

    fn holds_center(&self, bounds: &Aabb) -> bool {
        let center = bounds.center();
        self.frustum.planes().iter().all(|plane| plane.signed_distance(center) >= 0.0)
    }
}

/// Tests the polygons of the open block.
#[inline(always)]
fn test_open_block<K: Kernel, A: Answer>(
    osp: &Osp,
    kernel: K,
    planes: &PlaneSet,
    answer: &mut A,
) -> WorkCounts {
    let mut work = WorkCounts::default();
    let lanes = u32::from(osp.open.lanes());
    if lanes != 0 {
        count(&mut work, lanes.count_ones(), PlaneSet::ALL);
        let seen = lanes & !planes.behind_any(kernel, osp.open.rows());
        answer.run(kernel, osp.open.block() * BLOCK as u32, seen);
        work.reported = u64::from(seen.count_ones());
    }
    work
}

/// A query of the open block alone.
struct Open<'a, A> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    answer: A,
}

impl<A: Answer> WithKernel for Open<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> Self::Output {
        let work = test_open_block(self.osp, kernel, self.planes, &mut self.answer);
        (work, self.answer.finish())
    }
}

/// A query that reports all polygons of the id map and does not read the tree.
struct All<'a, A> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    answer: A,
}

impl<A: Filling> WithKernel for All<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> Self::Output {
        let mut work = test_open_block(self.osp, kernel, self.planes, &mut self.answer);
        let before = self.answer.count();
        self.answer.all(kernel, &self.osp.ids);
        let filled = (self.answer.count() - before) as u64;
        (work.taken_whole, work.reported) = (filled, work.reported + filled);
        (work, self.answer.finish())
    }
}

/// A query that lists the ids of all polygons that are not outside, from their masks.
struct Listed<'a> {
    osp: &'a Osp,
    planes: &'a PlaneSet,
    masks: &'a [u16],
    first: usize,
    answer: Ids<'a>,
}

impl WithKernel for Listed<'_> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> WorkCounts {
        let work = test_open_block(self.osp, kernel, self.planes, &mut self.answer);
        for (first, in_tree) in self.osp.ids.shelves() {
            let block = first as usize / BLOCK - self.first;
            self.answer.blocks(kernel, first, &self.masks[block..block + in_tree.len()]);
        }
        self.answer.finish();
        work
    }
}

impl super::ids::IdMap {
    /// The range of blocks from the first shelf with a polygon to the last block with a polygon.
    fn span(&self) -> Range<usize> {
        let (mut begin, mut end) = (usize::MAX, 0);
        for (first, masks) in self.shelves() {
            let block = first as usize / BLOCK;
            (begin, end) = (begin.min(block), end.max(block + masks.len()));
        }
        begin.min(end)..end
    }
}
