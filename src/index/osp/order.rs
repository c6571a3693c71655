//! The order of space for polygons that arrive in no order, as the faces of many imported models do. Their leaves' pages are
//! filled in the order of arrival, so each of them is as wide as its leaf, and a plane that cuts the leaf cuts all. In
//! frames in which nothing comes or goes, a few leaves each are packed again: runs that lie side by side share a page.

use super::{
    grid::{self, Key},
    index::Osp,
    layout::{Bucket, Link, TakenRun, Target},
    pool::Pooled,
    tuning::MOST_TAKEN,
};
use crate::index::simd::Wide;

/// Levels below the leaf's cell that are told apart.
const LEVELS: u32 = 3;

/// Cells of that level.
const CELLS: usize = 1 << (3 * LEVELS);

/// Which of the cells a key lies in, in Morton order.
#[inline]
fn cell_of(key: &Key, shift: u32) -> usize {
    (0..LEVELS).fold(0, |code, level| {
        let octant = if shift > level { grid::octant(key, shift - level) } else { 0 };
        code << 3 | octant
    })
}

/// Leaves that a commit packs at most.
const LEAVES_A_COMMIT: usize = 2;

/// Preallocated cells that a commit looks at to find them.
const CELLS_A_COMMIT: usize = 4096;

/// Fewer runs are in too few pages for any order to matter; and so many may come or go before a leaf is packed again.
const FEW_RUNS: u32 = 32;

impl Osp {
    /// Packs a few leaves, if nothing has come or gone since the last time. Those below the preallocated levels are left.
    pub(super) fn pack_some(&mut self) {
        let mut packed = 0;
        for _ in 0..CELLS_A_COMMIT.min(self.unpacked_cells) {
            self.unpacked_cells -= 1;
            let link = Link::from_bits(self.flat[self.unpacked_cells]);
            if let Target::Leaf(head) = link.target()
                && self.needs_packing(head)
            {
                self.pack(head);
                packed += 1;
                if packed == LEAVES_A_COMMIT {
                    return;
                }
            }
        }
    }

    fn needs_packing(&self, head: u32) -> bool {
        let Bucket { runs, polygons, packed, .. } = self.buckets[head];
        // Strokes are in order as they come.
        let is_scattered = polygons < runs * 2 && runs as usize <= MOST_TAKEN;
        is_scattered && runs > FEW_RUNS && runs.abs_diff(u32::from(packed)) >= FEW_RUNS
    }

    /// Puts the runs of a leaf into pages in the order of space.
    fn pack(&mut self, head: u32) {
        let old = self.buckets.take();
        self.buckets[old] = self.buckets[head];
        let first = &mut self.buckets[head];
        let Bucket { parent, slot, shift, split_at, runs, .. } = *first;
        *first = Bucket { parent, slot, shift, split_at, packed: runs as u16, ..Bucket::BLANK };
        let mut taken = std::mem::take(&mut self.taken);
        taken.clear();
        self.take_apart(old, |_, run| taken.push(run));
        self.in_order_of_space(&taken, shift, |osp, (run, bounds, loose)| {
            let wide = Wide::from_box(&bounds);
            let place = osp.append(head, run, wide, osp.grid.level_for(wide));
            if loose {
                osp.mark_loose(place);
            }
        });
        self.taken = taken;
    }

    /// Hands the runs of a leaf, whose cell is of level `shift`, out in the order of space.
    fn in_order_of_space(
        &mut self,
        taken: &[TakenRun],
        shift: u32,
        mut out: impl FnMut(&mut Self, TakenRun),
    ) {
        let mut cells = [0u16; MOST_TAKEN];
        let mut starts = [0u16; CELLS + 1];
        for (cell, (_, bounds, _)) in cells.iter_mut().zip(taken) {
            *cell = cell_of(&self.grid.key(Wide::from_box(bounds)), shift) as u16;
            starts[usize::from(*cell) + 1] += 1;
        }
        for i in 0..CELLS {
            starts[i + 1] += starts[i];
        }
        let mut order = [0u16; MOST_TAKEN];
        for (i, cell) in cells.iter().enumerate().take(taken.len()) {
            let at = &mut starts[usize::from(*cell)];
            order[usize::from(*at)] = i as u16;
            *at += 1;
        }
        for &i in order.iter().take(taken.len()) {
            out(self, taken[usize::from(i)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        index::{IndexConfig, SpatialIndex},
        math::Aabb,
        polygon::PolygonId,
    };

    const POLYGONS: u32 = 20_000;

    /// A tree of small boxes from everywhere.
    fn scattered() -> Osp {
        let config = IndexConfig { root: Aabb::cube(Vec3::ZERO, 4.0), capacity: POLYGONS as usize };
        let mut osp = Osp::new(&config);
        let mut state = 7u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for id in 0..POLYGONS {
            let center = Vec3::new(unit(), unit(), unit()) * 3.8 - 1.9;
            osp.insert(PolygonId(id), &Aabb::cube(center, 0.01)).expect("finite boxes, each id once");
            if id % 16 == 15 {
                osp.commit();
            }
        }
        osp
    }

    fn leaves(osp: &Osp) -> Vec<u32> {
        let targets = osp.flat.iter().map(|&bits| Link::from_bits(bits).target());
        targets.filter_map(|t| if let Target::Leaf(head) = t { Some(head) } else { None }).collect()
    }

    /// Sum of the surfaces of the pages' boxes, square metres: how often a plane cuts one.
    fn surface_m2(osp: &Osp) -> f32 {
        let heads = leaves(osp);
        let pages = heads.iter().flat_map(|&head| {
            let bucket = &osp.buckets[head];
            (0..bucket.page_count as usize).map(|at| bucket.boxes.get(at).extent())
        });
        pages.map(|e| 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x)).sum()
    }

    #[test]
    fn quiet_frames_pack_two_leaves_each_until_all_are_packed() {
        let mut osp = scattered();
        let before = surface_m2(&osp);
        let to_pack = |osp: &Osp| leaves(osp).into_iter().filter(|&head| osp.needs_packing(head)).count();
        let mut left = to_pack(&osp);
        assert!(left > 20, "{left} leaves to pack");
        // The frame after the last change does not.
        osp.commit();
        for frame in 0.. {
            let now = to_pack(&osp);
            assert!(now + LEAVES_A_COMMIT >= left, "{} leaves in a frame", left - now);
            left = now;
            if osp.unpacked_cells == 0 {
                break;
            }
            assert!(frame < 1_000, "it has an end");
            osp.commit();
            osp.validate().expect("valid");
        }
        assert_eq!(left, 0);
        let after = surface_m2(&osp);
        assert!(after * 1.4 < before, "{before} and {after} square metres");
    }

    #[test]
    fn frames_with_changes_pack_nothing() {
        let mut osp = scattered();
        let packed = |osp: &Osp| leaves(osp).iter().any(|&head| osp.buckets[head].packed != 0);
        for id in 0..500 {
            osp.remove(PolygonId(id)).expect("it is there");
            osp.commit();
        }
        assert!(!packed(&osp));
        // Most of these commits begin no new block of sixteen numbers.
        for id in POLYGONS..POLYGONS + 100 {
            osp.insert(PolygonId(id), &Aabb::cube(Vec3::ZERO, 0.01)).expect("a finite box, a new id");
            osp.commit();
        }
        assert!(!packed(&osp));
    }
}
