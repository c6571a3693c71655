//! Queries of the polygons in the flat rows: all groups are tested, sixteen boxes at a time. Blocks that have not moved
//! lately are first tested by the boxes around them.

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
        self.backend
            .run(MoversQuery { movers: &self.movers, planes: planes_for(frustum, &self.movers), answer })
            .0
    }

    /// Adds the polygons of the flat rows that the frustum may see to a set.
    pub(super) fn cull_mover_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        if self.movers.len() == 0 {
            return WorkCounts::default();
        }
        let answer = Blocks::new(visible.masks_for(self.movers.ids_end()));
        let planes = planes_for(frustum, &self.movers);
        let (work, (blocks, found)) = self.backend.run(MoversQuery { movers: &self.movers, planes, answer });
        visible.note_filled(blocks, found);
        work
    }
}

/// With fewer blocks of a group behind a plane, all its blocks are tested together.
const LEAST_BEHIND: u32 = 4;

struct MoversQuery<'a, A> {
    movers: &'a Movers,
    planes: PlaneSet,
    answer: A,
}

impl<A: Filling> WithKernel for MoversQuery<'_, A> {
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
        let are_narrow = rows.are_narrow();
        let groups = rows.lanes.chunks(BLOCK).zip(rows.boxes.chunks(BLOCK));
        for (group, (numbers, (lanes, boxes))) in rows.numbers.chunks(BLOCK).zip(groups).enumerate() {
            let (around, changed) = rows.group(group);
            let there = !(u32::MAX << numbers.len());
            let unchanged = there & !u32::from(changed);
            let behind = if unchanged == 0 { 0 } else { planes.behind_any(kernel, around) & unchanged };
            if behind.count_ones() < LEAST_BEHIND {
                let seen = seen(kernel, &planes, lanes, boxes);
                if are_narrow {
                    // Most blocks have no polygon in view.
                    let some = (0..BLOCK).fold(0, |some, at| some | u64::from(seen[at] != 0) << at);
                    for at in bits_of(some) {
                        answer.run(kernel, numbers[at] * BLOCK as u32, u32::from(seen[at]));
                    }
                } else {
                    answer.numbered(kernel, numbers, &seen);
                }
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

/// The planes of a frustum in the best order for a test of all rows. A test of a block ends when no polygon is left. If
/// blocks are narrow, near and far plane are last, so that most tests end early. Otherwise they are first, so that hardly
/// any test ends early: a processor could not predict which one does.
fn planes_for(frustum: &Frustum, movers: &Movers) -> PlaneSet {
    let mut planes = *frustum.planes();
    let along = |pair: usize| planes[2 * pair].normal.dot(planes[2 * pair + 1].normal);
    let opposite = (1..3).fold(0, |least, pair| if along(pair) < along(least) { pair } else { least });
    let last = if movers.own_rows().are_narrow() { opposite } else { (opposite + 2) % 3 };
    planes.rotate_left(2 * (last + 1) % 6);
    PlaneSet::new(&Frustum::new(planes))
}

/// For each of at most sixteen groups, the polygons among `lanes` that no plane excludes.
#[inline(always)]
fn seen<K: Kernel>(kernel: K, planes: &PlaneSet, lanes: &[u16], boxes: &[Boxes<BLOCK>]) -> [u16; BLOCK] {
    // Without `black_box`, the compiler would prepare the planes once for all groups, and run out of registers.
    let planes = std::hint::black_box(planes);
    let mut seen = [0; BLOCK];
    for ((seen, lanes), boxes) in seen.iter_mut().zip(lanes).zip(boxes) {
        *seen = lanes & !(planes.behind_any(kernel, boxes) as u16);
    }
    seen
}
