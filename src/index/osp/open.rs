use super::{layout::Run, pool::NONE, tuning::RUN_STRETCH};
use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
};

/// The block of sixteen ids that is being drawn. When the next block begins, the polygons of this block are divided into
/// runs and inserted into the tree. Until then queries test them one by one.
#[derive(Clone, Debug)]
pub(super) struct OpenBlock {
    /// Number of the block, `id / 16`; [`NONE`] if no block is open.
    block: u32,
    /// Polygons of the block that are in the tree, because the block was open before.
    in_tree: u16,
    /// Polygons of the block that are not in the tree yet.
    lanes: u16,
    /// The boxes of the polygons `lanes`; other lanes are unspecified.
    boxes: Boxes<16>,
}

/// The runs of a closed block.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    pub(super) runs: [(Run, Wide); 16],
    pub(super) count: usize,
    /// Mask of the polygons in runs of several polygons.
    pub(super) shared: u16,
}

impl Default for Gathered {
    fn default() -> Self {
        Self { runs: [(Run::NONE, Wide::EMPTY); 16], count: 0, shared: 0 }
    }
}

impl Gathered {
    #[inline]
    fn add(&mut self, block: u32, mask: u16, bounds: Wide) {
        let skip = mask.trailing_zeros();
        let run = Run { first: block * 16 + skip, store: NONE, mask: mask >> skip };
        if run.mask != 1 {
            self.shared |= mask;
        }
        self.runs[self.count % 16] = (run, bounds);
        self.count += 1;
    }
}

/// Number of latest runs that a polygon may join. It is more than one, because the ids of strokes that are drawn at the
/// same time, such as mirrored strokes, alternate.
const JOINABLE_RUNS: usize = 4;

/// If no polygon has joined one of the first runs of this number, later polygons begin new runs without a test.
const TESTED_RUNS: usize = 6;

impl OpenBlock {
    pub(super) fn new() -> Self {
        Self { block: NONE, in_tree: 0, lanes: 0, boxes: Boxes::EMPTY }
    }

    #[inline]
    pub(super) fn is(&self, block: u32) -> bool {
        self.block == block
    }

    #[inline]
    pub(super) fn block(&self) -> u32 {
        self.block
    }

    /// The polygons that are not in the tree yet.
    #[inline]
    pub(super) fn lanes(&self) -> u16 {
        self.lanes
    }

    /// All polygons of the block, in the tree or not.
    #[inline]
    pub(super) fn present(&self) -> u16 {
        self.in_tree | self.lanes
    }

    /// The box of a polygon that is not in the tree yet.
    #[inline]
    pub(super) fn bounds(&self, lane: usize) -> Aabb {
        self.boxes.get(lane % 16)
    }

    /// The boxes of the polygons `lanes`; other lanes are unspecified.
    #[inline]
    pub(super) fn rows(&self) -> &Boxes<16> {
        &self.boxes
    }

    /// Opens a block whose polygons `in_tree` are in the tree.
    pub(super) fn begin(&mut self, block: u32, in_tree: u16) {
        (self.block, self.in_tree, self.lanes) = (block, in_tree, 0);
    }

    /// Opens a block with the polygons `lanes` and no others.
    pub(super) fn begin_with(&mut self, block: u32, lanes: u16, boxes: &Boxes<16>) {
        (self.block, self.in_tree, self.lanes) = (block, 0, lanes);
        self.boxes = *boxes;
    }

    /// Records that a polygon of the block was removed from the tree.
    pub(super) fn forget_in_tree(&mut self, lane: usize) {
        self.in_tree &= !(1 << lane);
    }

    /// Adds a polygon, or replaces its box.
    #[inline]
    pub(super) fn add(&mut self, lane: usize, bounds: Wide) {
        self.lanes |= 1 << lane;
        self.boxes.set_wide(lane % 16, bounds);
    }

    /// Removes a polygon that is not in the tree yet.
    pub(super) fn remove(&mut self, lane: usize) {
        self.lanes &= !(1 << lane);
    }

    /// Closes the block, so that no block is open.
    pub(super) fn close(&mut self) {
        self.begin(NONE, 0);
    }

    /// Divides the polygons into runs, in the order of their ids. A polygon joins the run of its predecessor if this
    /// run is close, otherwise one of the last few runs. If none of these runs is close, it begins a new run. The
    /// caller sets the store of runs of several polygons.
    pub(super) fn gather(&self, to: &mut Gathered) {
        (to.count, to.shared) = (0, 0);
        let mut run = OpenRun::NONE;
        let mut left = self.lanes;
        let mut breaks = 0;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let bounds = Wide::from_box(&self.boxes.get(lane % 16));
            if !run.join(lane, bounds) {
                if run.mask != 0 {
                    to.add(self.block, run.mask, run.bounds);
                }
                breaks += 1;
                // Few runs mean consecutive strokes. Many runs may mean that the ids of strokes alternate.
                if breaks > JOINABLE_RUNS {
                    self.gather_alternating(to);
                    return;
                }
                run = OpenRun { mask: 1 << lane, bounds, length_m: bounds.length() };
            }
        }
        if run.mask != 0 {
            to.add(self.block, run.mask, run.bounds);
        }
    }

    /// Does the same as [`OpenBlock::gather`] for strokes whose ids alternate.
    fn gather_alternating(&self, to: &mut Gathered) {
        let mut open = [OpenRun::NONE; 16];
        let (mut count, mut joined_count) = (0, 0);
        let mut left = self.lanes;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let bounds = Wide::from_box(&self.boxes.get(lane % 16));
            // If the ids of strokes alternate, polygons soon join earlier runs. Otherwise the polygons are scattered.
            let has_joined = (joined_count > 0 || count < TESTED_RUNS) && {
                let latest = open[..count].iter_mut().rev().take(JOINABLE_RUNS);
                latest.into_iter().any(|run| run.join(lane, bounds))
            };
            joined_count += usize::from(has_joined);
            if !has_joined {
                open[count] = OpenRun { mask: 1 << lane, bounds, length_m: bounds.length() };
                count += 1;
            }
        }
        (to.count, to.shared) = (0, 0);
        for run in &open[..count] {
            to.add(self.block, run.mask, run.bounds);
        }
    }
}

#[derive(Clone, Copy)]
struct OpenRun {
    mask: u16,
    bounds: Wide,
    /// Sum of the longest edges of the boxes of the run's polygons, metres.
    length_m: f32,
}

impl OpenRun {
    const NONE: Self = Self { mask: 0, bounds: Wide::EMPTY, length_m: 0.0 };

    /// Adds the polygon if it is close enough. Returns whether it was added.
    #[inline]
    fn join(&mut self, lane: usize, bounds: Wide) -> bool {
        let union = self.bounds.union(bounds);
        let sum_m = self.length_m + bounds.length();
        // If the sum overflows, every polygon joins. The box of such a run is huge anyway.
        if self.mask == 0 || union.length() > sum_m * RUN_STRETCH {
            return false;
        }
        (self.bounds, self.length_m) = (union, sum_m);
        self.mask |= 1 << lane;
        true
    }
}
