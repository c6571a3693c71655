use super::{layout::Run, pool::NONE, tuning::RUN_STRETCH};
use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
};

/// The block of sixteen ids that is being drawn now. Its polygons are kept here, and divided into runs and inserted when
/// the next block begins; until then queries test them one by one.
#[derive(Clone, Debug)]
pub(super) struct OpenBlock {
    /// `id / 16`; [`NONE`] if nothing is open.
    block: u32,
    /// Polygons of the block that are in the tree already (it was open before).
    filed: u16,
    /// Polygons kept here.
    lanes: u16,
    /// In rows, as queries read them; lanes of nothing hold anything.
    boxes: Boxes<16>,
}

/// What an open block becomes.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    pub(super) runs: [(Run, Wide); 16],
    pub(super) count: usize,
    /// Polygons in runs of several.
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

/// Runs that a polygon is offered to before it begins one of its own: strokes that are drawn at the same time
/// (mirrored, say) take turns.
const OFFERS: usize = 4;

/// Runs that are begun before it is given up to look for strokes that take turns.
const TURNS_SHOW: usize = 6;

impl OpenBlock {
    pub(super) fn new() -> Self {
        Self { block: NONE, filed: 0, lanes: 0, boxes: Boxes::EMPTY }
    }

    #[inline]
    pub(super) fn is(&self, block: u32) -> bool {
        self.block == block
    }

    #[inline]
    pub(super) fn block(&self) -> u32 {
        self.block
    }

    /// The polygons kept here.
    #[inline]
    pub(super) fn lanes(&self) -> u16 {
        self.lanes
    }

    /// All polygons of the block, here or in the tree.
    #[inline]
    pub(super) fn present(&self) -> u16 {
        self.filed | self.lanes
    }

    /// The box of a polygon kept here.
    #[inline]
    pub(super) fn bounds(&self, lane: usize) -> Aabb {
        self.boxes.get(lane % 16)
    }

    /// The boxes in rows; lanes of nothing hold anything.
    #[inline]
    pub(super) fn rows(&self) -> &Boxes<16> {
        &self.boxes
    }

    /// Begins a block of which some polygons are in the tree.
    pub(super) fn begin(&mut self, block: u32, filed: u16) {
        (self.block, self.filed, self.lanes) = (block, filed, 0);
    }

    /// Begins a block of which these polygons, and no others, come at once.
    pub(super) fn begin_with(&mut self, block: u32, lanes: u16, boxes: &Boxes<16>) {
        (self.block, self.filed, self.lanes) = (block, 0, lanes);
        self.boxes = *boxes;
    }

    /// Notes that a polygon of the block was taken out of the tree.
    pub(super) fn forget_filed(&mut self, lane: usize) {
        self.filed &= !(1 << lane);
    }

    /// Takes a polygon in.
    #[inline]
    pub(super) fn add(&mut self, lane: usize, bounds: Wide) {
        self.lanes |= 1 << lane;
        self.boxes.set_wide(lane % 16, bounds);
    }

    /// Takes a polygon out that is kept here.
    pub(super) fn remove(&mut self, lane: usize) {
        self.lanes &= !(1 << lane);
    }

    /// Nothing is open any more.
    pub(super) fn close(&mut self) {
        self.begin(NONE, 0);
    }

    /// Divides the polygons into runs, in the order of their ids: each joins the run of the one before if it lies
    /// close by, else one of the last few, else it begins a new one. Runs of several do not know their store yet.
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
                // Few runs: strokes that follow each other. Many: perhaps strokes that take turns.
                if breaks > OFFERS {
                    self.gather_in_turns(to);
                    return;
                }
                run = OpenRun { mask: 1 << lane, bounds, length_m: bounds.length() };
            }
        }
        if run.mask != 0 {
            to.add(self.block, run.mask, run.bounds);
        }
    }

    /// [`OpenBlock::gather`] for strokes that take turns.
    fn gather_in_turns(&self, to: &mut Gathered) {
        let mut open = [OpenRun::NONE; 16];
        let (mut count, mut taken_in) = (0, 0);
        let mut left = self.lanes;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let bounds = Wide::from_box(&self.boxes.get(lane % 16));
            // Strokes that take turns show soon; else the polygons come from everywhere.
            let taken = (taken_in > 0 || count < TURNS_SHOW) && {
                let offers = open[..count].iter_mut().rev().take(OFFERS);
                offers.into_iter().any(|run| run.join(lane, bounds))
            };
            taken_in += usize::from(taken);
            if !taken {
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
    /// Sum of the longest edges of its polygons' boxes, metres.
    length_m: f32,
}

impl OpenRun {
    const NONE: Self = Self { mask: 0, bounds: Wide::EMPTY, length_m: 0.0 };

    /// Takes the polygon if it lies close enough.
    #[inline]
    fn join(&mut self, lane: usize, bounds: Wide) -> bool {
        let union = self.bounds.union(bounds);
        let sum_m = self.length_m + bounds.length();
        // Sums that overflow join whatever comes: such a run is everywhere anyway.
        if self.mask == 0 || union.length() > sum_m * RUN_STRETCH {
            return false;
        }
        (self.bounds, self.length_m) = (union, sum_m);
        self.mask |= 1 << lane;
        true
    }
}
