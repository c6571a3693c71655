//! Sorts runs along a space-filling curve if polygons are inserted in no spatial order, such as the faces of many
//! imported models. The pages of a leaf are filled in the order of arrival. Without sorting, each page is as wide as
//! the leaf, and a plane that cuts the leaf cuts all its pages. A leaf that has grown by half is queued to be packed:
//! neighbouring runs then share a page. A commit packs a few of the queued leaves.

use super::{
    grid::{self, Key},
    index::Osp,
    layout::{Bucket, TakenRun},
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

    /// Calls `out` with the runs of a leaf in their order along a space-filling curve. `shift` is the level of the leaf's
    /// cell.
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
        index::{
            IndexConfig, SpatialIndex,
            osp::{layout::Target, pool::NONE},
        },
        math::Aabb,
        polygon::PolygonId,
    };

    const POLYGONS: u32 = 20_000;

    /// Small boxes, scattered in a cube of 3.8 metres or along a line.
    fn boxes(is_scattered: bool) -> impl Iterator<Item = (PolygonId, Aabb)> {
        let mut state = 7u32;
        let mut unit = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        (0..POLYGONS).map(move |id| {
            let along = id as f32 / POLYGONS as f32;
            let at = if is_scattered { Vec3::new(unit(), unit(), unit()) } else { Vec3::splat(along) };
            (PolygonId(id), Aabb::cube(at * 3.8 - 1.9, 0.01))
        })
    }

    fn empty(root_m: f32) -> Osp {
        let root = Aabb::cube(Vec3::ZERO, root_m);
        Osp::new(&IndexConfig { root, capacity: POLYGONS as usize }).with_all_in_tree()
    }

    /// Inserts all boxes, with a commit after every `a_commit` polygons.
    fn grown(mut osp: Osp, a_commit: u32, mut each: impl FnMut(&Osp)) -> Osp {
        for (id, bounds) in boxes(true) {
            osp.insert(id, &bounds).expect("a finite box, each id once");
            if id.0 % a_commit == a_commit - 1 {
                osp.commit();
                each(&osp);
            }
        }
        osp
    }

    /// Sum of the surface areas of the pages' boxes, square metres. It measures how often a plane cuts a page.
    fn surface_m2(osp: &Osp, node: u32) -> f32 {
        let children = osp.nodes[node].children.iter();
        let of_child = children.map(|link| match link.target() {
            Target::Nothing => 0.0,
            Target::Node(below) => surface_m2(osp, below),
            Target::Leaf(head) => {
                let next = |&at: &u32| Some(osp.buckets[at].next).filter(|&next| next != NONE);
                let buckets = std::iter::successors(Some(head), next);
                let of_bucket = |at: u32| {
                    let bucket = &osp.buckets[at];
                    let extents = (0..bucket.page_count as usize).map(|at| bucket.boxes.get(at).extent());
                    extents.map(|e| 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x)).sum::<f32>()
                };
                buckets.map(of_bucket).sum()
            }
        });
        of_child.sum()
    }

    /// The same tree without packing, because the queue is cleared before each commit.
    fn not_packed(root_m: f32) -> Osp {
        let mut osp = empty(root_m);
        for (id, bounds) in boxes(true) {
            osp.insert(id, &bounds).expect("a finite box, each id once");
            osp.to_pack.clear();
            if id.0 % 16 == 15 {
                osp.commit();
            }
        }
        osp
    }

    #[test]
    fn a_growing_tree_is_packed_wherever_it_grows() {
        // In the second tree, most cells lie outside of the preallocated levels.
        for root_m in [4.0, 0.25] {
            let packed = grown(empty(root_m), 16, |_| ());
            packed.validate().expect("a sound tree");
            let before = not_packed(root_m);
            let (is, was) = (surface_m2(&packed, packed.top), surface_m2(&before, before.top));
            assert!(is * 1.1 < was, "{was} and {is} square metres");
        }
    }

    #[test]
    fn a_commit_packs_a_share_of_what_came() {
        let mut before = 0;
        let osp = grown(empty(4.0), 500, |osp| {
            // A commit files whole blocks.
            let most = before + 500 / FEWEST_APART + 2;
            assert!(osp.to_pack.len() <= most, "{} leaves wait", osp.to_pack.len());
            before = osp.to_pack.len();
        });
        let mut osp = osp;
        let mut waiting = osp.to_pack.len();
        while waiting > 0 {
            osp.commit();
            let left = osp.to_pack.len();
            assert_eq!(waiting - left, 1, "one leaf in a frame without changes");
            osp.validate().expect("a sound tree");
            waiting = left;
        }
    }

    /// Least number of runs that a leaf receives before it is queued again.
    const FEWEST_APART: usize = 32;

    #[test]
    fn what_is_drawn_along_a_line_never_waits() {
        let mut osp = empty(4.0);
        for (id, bounds) in boxes(false) {
            osp.insert(id, &bounds).expect("a finite box, each id once");
            if id.0 % 16 == 15 {
                osp.commit();
            }
            assert!(osp.to_pack.is_empty());
        }
    }

    #[test]
    fn leaves_that_go_while_they_wait_are_left_alone() {
        let mut osp = empty(4.0);
        for (id, bounds) in boxes(true) {
            osp.insert(id, &bounds).expect("a finite box, each id once");
        }
        // A commit would pack them.
        for block in 0..POLYGONS / 16 {
            osp.file(block, u16::MAX);
        }
        assert!(osp.to_pack.len() > 10);
        for id in 0..POLYGONS - 100 {
            osp.remove(PolygonId(id)).expect("it is there");
            if id % 256 == 0 {
                osp.commit();
                osp.validate().expect("a sound tree");
            }
        }
        for _ in 0..2_000 {
            osp.commit();
        }
        osp.validate().expect("a sound tree");
        assert!(osp.to_pack.is_empty());
    }
}
