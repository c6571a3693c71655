//! Queries of the polygons in the flat rows: all groups are tested, sixteen boxes at a time. Blocks that have not moved
//! since they were in the plain list are excluded first by the boxes around them.

use super::{
    answer::{Blocks, Filling, Ids},
    index::Osp,
    movers::Movers,
    query::count,
};
use crate::{
    index::{
        WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, WithKernel},
    },
    math::Frustum,
    polygon::{BLOCK, PolygonId, VisibleBlocks, bits::bits_of},
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
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        // As a local variable the answer stays in registers.
        let Self { movers, planes, mut answer } = self;
        let mut work = WorkCounts::default();
        let before = answer.count();
        // Sixteen groups are tested before their polygons are added. With both in one loop, the planes would not stay in
        // registers.
        let (rows, mut tested) = (movers.own_rows(), movers.len() as u32);
        let groups = rows.lanes.chunks(BLOCK).zip(rows.boxes.chunks(BLOCK));
        for (group, (numbers, (lanes, boxes))) in rows.numbers.chunks(BLOCK).zip(groups).enumerate() {
            let (around, changed) = rows.group(group);
            let there = !(u32::MAX << numbers.len());
            let behind = match changed {
                u16::MAX => 0,
                _ => planes.behind_any(kernel, around) & !u32::from(changed) & there,
            };
            if behind == 0 {
                answer.numbered(kernel, numbers, &seen(kernel, &planes, lanes, boxes));
                continue;
            }
            tested -= bits_of(u64::from(behind)).map(|at| lanes[at].count_ones()).sum::<u32>();
            for at in bits_of(u64::from(there & !behind)) {
                let seen = u32::from(lanes[at]) & !planes.behind_any(kernel, &boxes[at]);
                answer.run(kernel, numbers[at] * BLOCK as u32, seen);
            }
        }
        let (ids, lanes, boxes) = movers.shared_rows();
        let rows = lanes.chunks(BLOCK).zip(boxes.chunks(BLOCK));
        for (ids, (lanes, boxes)) in ids.chunks(BLOCK).zip(rows) {
            answer.listed(kernel, ids, &seen(kernel, &planes, lanes, boxes));
        }
        count(&mut work, tested, PlaneSet::ALL);
        work.nodes = movers.group_count() as u64;
        work.reported = (answer.count() - before) as u64;
        (work, answer.finish())
    }
}

/// For each of at most sixteen groups, the polygons among `lanes` that no plane excludes.
#[inline(always)]
fn seen<K: Kernel>(kernel: K, planes: &PlaneSet, lanes: &[u16], boxes: &[Boxes<BLOCK>]) -> [u16; BLOCK] {
    // Without this, the compiler would prepare the planes of all groups once, in more registers than there are.
    let planes = std::hint::black_box(planes);
    let mut seen = [0; BLOCK];
    for ((seen, lanes), boxes) in seen.iter_mut().zip(lanes).zip(boxes) {
        *seen = lanes & !(planes.behind_any(kernel, boxes) as u16);
    }
    seen
}
