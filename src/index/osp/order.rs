//! Sorts runs along a space-filling curve if polygons are inserted in no spatial order, such as the faces of many
//! imported models. The pages of a leaf are filled in the order of arrival. Without sorting, each page is as wide as
//! the leaf, and a plane that cuts the leaf cuts all its pages. A leaf that has grown by half is queued to be packed:
//! neighbouring runs then share a page. A commit packs a few of the queued leaves.

use super::{
    grid::{self, Key},
    index::Osp,
    layout::Bucket,
    pool::Pooled,
    tuning::MOST_TAKEN,
};
use crate::index::simd::Wide;

/// Number of levels below the leaf's cell down to which runs are sorted.
const LEVELS: u32 = 3;

/// Number of cells of the lowest level.
const CELLS: usize = 1 << (3 * LEVELS);

/// Position on a Hilbert curve of the cell that contains a key. Successive cells on the curve share a side.
#[inline]
fn cell_of(key: &Key, shift: u32) -> usize {
    let morton = (0..LEVELS).fold(0, |code, level| {
        let octant = if shift > level { grid::octant(key, shift - level) } else { 0 };
        code << 3 | octant
    });
    usize::from(CURVE[morton])
}

/// Position of each cell on the curve, by the cell's Morton code.
static CURVE: [u16; CELLS] = {
    let mut table = [0; CELLS];
    let mut morton = 0;
    while morton < CELLS {
        table[morton] = place_on_curve(morton);
        morton += 1;
    }
    table
};

/// Computes a position on the curve. Method: John Skilling, "Programming the Hilbert curve" (2004).
const fn place_on_curve(morton: usize) -> u16 {
    let mut at = [0u16; 3];
    let mut bit = 0;
    while bit < 3 * LEVELS {
        at[(bit % 3) as usize] |= ((morton >> bit & 1) as u16) << (bit / 3);
        bit += 1;
    }
    let top = 1 << (LEVELS - 1);
    let mut level = top;
    while level > 1 {
        let below = level - 1;
        let mut axis = 0;
        while axis < 3 {
            if at[axis] & level != 0 {
                at[0] ^= below;
            } else {
                let swapped = (at[0] ^ at[axis]) & below;
                at[0] ^= swapped;
                at[axis] ^= swapped;
            }
            axis += 1;
        }
        level >>= 1;
    }
    at[1] ^= at[0];
    at[2] ^= at[1];
    let mut turned = 0;
    level = top;
    while level > 1 {
        if at[2] & level != 0 {
            turned ^= level - 1;
        }
        level >>= 1;
    }
    let (mut place, mut bit) = (0, 3 * LEVELS);
    while bit > 0 {
        bit -= 1;
        let axis = 2 - (bit % 3) as usize;
        place = place << 1 | (at[axis] ^ turned) >> (bit / 3) & 1;
    }
    place
}

/// Number of leaves that every commit packs, if so many are queued.
const LEAVES_A_COMMIT: u32 = 1;
/// A commit packs a further leaf for this number of runs that were inserted since the last commit.
const RUNS_A_LEAF: u32 = 64;

impl Osp {
    /// Queues a leaf that has grown since it was packed, if its polygons are scattered.
    pub(super) fn queue_for_packing(&mut self, head: u32) {
        let leaf = &mut self.buckets[head];
        leaf.pack_at = leaf.runs + leaf.runs / 2;
        if leaf.is_scattered() && !leaf.is_queued {
            leaf.is_queued = true;
            self.to_pack.push_back(head);
        }
    }

    /// Packs a few of the queued leaves. `new_runs` is the number of runs inserted since the last commit.
    pub(super) fn pack_some(&mut self, new_runs: u32) {
        for _ in 0..LEAVES_A_COMMIT + new_runs / RUNS_A_LEAF {
            let Some(head) = self.to_pack.pop_front() else { return };
            // Since the leaf was queued, it may have been removed or replaced.
            if self.buckets[head].is_queued {
                self.buckets[head].is_queued = false;
                if self.buckets[head].is_scattered() {
                    self.pack(head);
                }
            }
        }
    }

    /// Releases a bucket and clears its marks.
    pub(super) fn give_bucket(&mut self, number: u32) {
        let bucket = &mut self.buckets[number];
        (bucket.is_queued, bucket.divides, bucket.drains) = (false, false, false);
        self.buckets.give(number);
    }

    /// Distributes the runs of a leaf to its pages along a space-filling curve.
    fn pack(&mut self, head: u32) {
        let old = self.buckets.take();
        self.buckets[old] = self.buckets[head];
        let first = &mut self.buckets[head];
        let Bucket { parent, slot, shift, split_at, pack_at, .. } = *first;
        *first = Bucket { parent, slot, shift, split_at, pack_at, ..Bucket::BLANK };
        let mut taken = std::mem::take(&mut self.taken);
        taken.clear();
        self.take_apart(old, &mut taken);
        let mut cells = [0u16; MOST_TAKEN];
        let mut starts = [0u16; CELLS + 1];
        for (cell, (_, bounds, _)) in cells.iter_mut().zip(&taken) {
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
            self.append_taken(head, &taken[usize::from(i)]);
        }
        self.taken = taken;
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

    /// Inserts small boxes, scattered in a cube of 3.8 metres or along a line. Each block of sixteen is a frame.
    fn grown(root_m: f32, is_scattered: bool, mut each: impl FnMut(&mut Osp)) -> Osp {
        let root = Aabb::cube(Vec3::ZERO, root_m);
        let mut osp = Osp::new(&IndexConfig { root, capacity: POLYGONS as usize }).with_all_in_tree();
        let mut state = 7u32;
        let mut unit = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for id in 0..POLYGONS {
            let along = Vec3::splat(id as f32 / POLYGONS as f32);
            let at = if is_scattered { Vec3::new(unit(), unit(), unit()) } else { along };
            osp.insert(PolygonId(id), &Aabb::cube(at * 3.8 - 1.9, 0.01)).expect("a finite box, each id once");
            if id % 16 == 15 {
                osp.commit();
                each(&mut osp);
            }
        }
        osp
    }

    /// Sum of the surface areas of the boxes of pages, square metres. It measures how often a plane cuts a page.
    fn surface_m2(osp: &Osp) -> f32 {
        let pages = (0..osp.pages.live()).map(|number| &osp.pages[number]).filter(|page| page.runs > 0);
        let extents = pages.map(|page| page.boxes.around(page.used()).extent());
        extents.map(|e| 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x)).sum()
    }

    #[test]
    fn scattered_leaves_are_packed_a_few_a_commit() {
        // In the second tree, most cells lie outside of the preallocated levels.
        for root_m in [4.0, 0.25] {
            let mut osp = grown(root_m, true, |_| ());
            let not_packed = grown(root_m, true, |osp| osp.to_pack.clear());
            let (is, was) = (surface_m2(&osp), surface_m2(&not_packed));
            assert!(is * 1.1 < was, "{was} and {is} square metres");
            // Leaves that go while they wait are left alone.
            for id in 0..POLYGONS {
                osp.remove(PolygonId(id)).expect("it is there");
                if id % 256 == 0 {
                    let waiting = osp.to_pack.len();
                    osp.commit();
                    assert!(waiting <= osp.to_pack.len() + 1, "one leaf in a frame without insertions");
                    osp.validate().expect("a sound tree");
                }
            }
            (0..2_000).for_each(|_| osp.commit());
            osp.validate().expect("a sound tree");
            assert!(osp.to_pack.is_empty());
        }
        grown(4.0, false, |osp| assert!(osp.to_pack.is_empty(), "polygons along a line need no packing"));
    }
}
