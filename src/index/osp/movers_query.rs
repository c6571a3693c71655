//! Queries of the polygons in the flat rows: all groups are tested, sixteen boxes at a time.

use super::{
    answer::{Blocks, Filling, Ids},
    index::Osp,
    movers::Movers,
    query::count,
};
use crate::{
    index::{
        WorkCounts,
        simd::{Kernel, PlaneSet, WithKernel},
    },
    math::Frustum,
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

impl Osp {
    /// Appends the polygons of the flat rows that the frustum may see.
    pub(super) fn cull_movers(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        if self.movers.len() == 0 {
            return WorkCounts::default();
        }
        let answer = Ids::new(draw_list);
        self.backend.run(Pass { movers: &self.movers, planes: PlaneSet::new(frustum), answer }).0
    }

    /// Adds the polygons of the flat rows that the frustum may see to a set.
    pub(super) fn cull_mover_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        if self.movers.len() == 0 {
            return WorkCounts::default();
        }
        let answer = Blocks::new(visible.masks_for(self.movers.ids_end()));
        let planes = PlaneSet::new(frustum);
        let (work, (blocks, found)) = self.backend.run(Pass { movers: &self.movers, planes, answer });
        visible.note_filled(blocks, found);
        work
    }
}

struct Pass<'a, A> {
    movers: &'a Movers,
    planes: PlaneSet,
    answer: A,
}

impl<A: Filling> WithKernel for Pass<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> Self::Output {
        let mut work = WorkCounts::default();
        let before = self.answer.count();
        for (block, lanes, boxes) in self.movers.own_groups() {
            let seen = u32::from(lanes) & !self.planes.behind_any(kernel, boxes);
            self.answer.run(kernel, block * BLOCK as u32, seen);
        }
        for (ids, lanes, boxes) in self.movers.shared_groups() {
            let seen = u32::from(lanes) & !self.planes.behind_any(kernel, boxes);
            self.answer.listed(kernel, ids, seen);
        }
        count(&mut work, self.movers.len() as u32, PlaneSet::ALL);
        work.nodes = self.movers.group_count() as u64;
        work.reported = (self.answer.count() - before) as u64;
        (work, self.answer.finish())
    }
}
