use super::{layout::Run, pool::NONE, tuning::RUN_STRETCH};
use crate::{index::simd::Boxes, math::Aabb};

/// The block of sixteen ids that is being drawn now. Its polygons are gathered into runs here and filed when the next
/// block begins; until then queries test them one by one.
#[derive(Clone, Debug)]
pub(super) struct OpenBlock {
    /// `id / 16`; [`NONE`] if nothing is open.
    block: u32,
    /// Polygons of the block that are in the tree already (it was open before).
    filed: u16,
    /// Polygons gathered here.
    lanes: u16,
    boxes: Boxes<16>,
    runs: [OpenRun; 16],
    run_count: usize,
    /// The run that took the last polygon.
    last: usize,
}

#[derive(Clone, Copy, Debug)]
struct OpenRun {
    mask: u16,
    bounds: Aabb,
    /// Sum of the longest edges of its polygons' boxes, metres.
    length_m: f32,
}

impl OpenRun {
    const BLANK: Self = Self { mask: 0, bounds: Aabb::EMPTY, length_m: 0.0 };
}

/// Runs that a polygon is offered to before it begins one of its own: strokes that are drawn at the same time
/// (mirrored, say) take turns.
const OFFERS: usize = 4;

impl OpenBlock {
    pub(super) fn new() -> Self {
        Self {
            block: NONE,
            filed: 0,
            lanes: 0,
            boxes: Boxes::EMPTY,
            runs: [OpenRun::BLANK; 16],
            run_count: 0,
            last: 0,
        }
    }

    #[inline]
    pub(super) fn is(&self, block: u32) -> bool {
        self.block == block
    }

    #[inline]
    pub(super) fn block(&self) -> u32 {
        self.block
    }

    /// The polygons gathered here.
    #[inline]
    pub(super) fn lanes(&self) -> u16 {
        self.lanes
    }

    /// All polygons of the block, here or in the tree.
    #[inline]
    pub(super) fn present(&self) -> u16 {
        self.filed | self.lanes
    }

    #[inline]
    pub(super) fn boxes(&self) -> &Boxes<16> {
        &self.boxes
    }

    /// Begins a block of which some polygons are filed.
    pub(super) fn begin(&mut self, block: u32, filed: u16) {
        (self.block, self.filed, self.lanes) = (block, filed, 0);
        (self.run_count, self.last) = (0, 0);
    }

    /// Notes that a polygon of the block was taken out of the tree.
    pub(super) fn forget_filed(&mut self, lane: usize) {
        self.filed &= !(1 << lane);
    }

    /// Takes a polygon in.
    #[inline]
    pub(super) fn add(&mut self, lane: usize, bounds: &Aabb) {
        self.lanes |= 1 << lane;
        self.boxes.set(lane, bounds);
        let length_m = bounds.extent().max_element();
        if self.run_count > 0 && self.runs[self.last & 15].join(lane, bounds, length_m) {
            return;
        }
        self.add_elsewhere(lane, bounds, length_m);
    }

    fn add_elsewhere(&mut self, lane: usize, bounds: &Aabb, length_m: f32) {
        for i in (0..self.run_count).rev().take(OFFERS) {
            if i != self.last && self.runs[i].join(lane, bounds, length_m) {
                self.last = i;
                return;
            }
        }
        // A block has sixteen lanes, so there is always a blank run; one whose polygons are gone is used again.
        let blank =
            self.runs[..self.run_count].iter().position(|run| run.mask == 0).unwrap_or(self.run_count);
        let i = blank.min(15);
        self.runs[i] = OpenRun { mask: 1 << lane, bounds: *bounds, length_m };
        self.run_count = self.run_count.max(i + 1);
        self.last = i;
    }

    /// Takes a polygon out that was gathered here.
    pub(super) fn remove(&mut self, lane: usize) {
        self.lanes &= !(1 << lane);
        for run in &mut self.runs[..self.run_count] {
            if run.mask >> lane & 1 == 1 {
                run.mask &= !(1 << lane);
                run.bounds = self.boxes.around(u32::from(run.mask));
            }
        }
    }

    /// The runs gathered so far, with their boxes.
    pub(super) fn runs(&self) -> impl Iterator<Item = (Run, Aabb)> + '_ {
        self.runs[..self.run_count].iter().filter(|run| run.mask != 0).map(|run| {
            let base = self.block * 16;
            let filed = if run.mask.is_power_of_two() {
                Run { first: base + run.mask.trailing_zeros(), mask: 1, exact: true }
            } else {
                Run { first: base, mask: run.mask, exact: false }
            };
            (filed, run.bounds)
        })
    }

    /// The polygons gathered in runs of several.
    pub(super) fn shared_lanes(&self) -> u16 {
        let several = self.runs[..self.run_count].iter().filter(|run| run.mask.count_ones() > 1);
        several.fold(0, |lanes, run| lanes | run.mask)
    }

    /// Nothing is open any more.
    pub(super) fn close(&mut self) {
        self.begin(NONE, 0);
    }
}

impl OpenRun {
    /// Takes the polygon if it lies close enough.
    #[inline]
    fn join(&mut self, lane: usize, bounds: &Aabb, length_m: f32) -> bool {
        let union = self.bounds.union(bounds);
        let sum_m = self.length_m + length_m;
        // A sum that overflows joins nothing it should not: NaN compares false, infinity is a huge run anyway.
        if self.mask == 0 || union.extent().max_element() > sum_m * RUN_STRETCH {
            return false;
        }
        self.bounds = union;
        self.length_m = sum_m;
        self.mask |= 1 << lane;
        true
    }
}
