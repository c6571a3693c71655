//! Divides the polygons of a block into runs of neighbours.

use super::{layout::Run, pool::NONE, tuning::RUN_STRETCH};
use crate::index::simd::{Boxes, Wide, lanes_of};

/// The runs of a block.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    pub(super) runs: [(Run, Wide); 16],
    pub(super) count: usize,
}

impl Default for Gathered {
    fn default() -> Self {
        Self { runs: [(Run::NONE, Wide::EMPTY); 16], count: 0 }
    }
}

/// Number of latest runs that a polygon may join. It is more than one, because the ids of strokes that are drawn at the
/// same time, such as mirrored strokes, alternate.
const JOINABLE_RUNS: usize = 4;

/// If no polygon has joined one of the first runs of this number, later polygons begin new runs without a test.
const TESTED_RUNS: usize = 6;

impl Gathered {
    #[inline]
    fn add(&mut self, (block, store): (u32, u32), mask: u16, bounds: Wide) {
        let skip = mask.trailing_zeros();
        let run = Run {
            first: block * 16 + skip,
            store: if mask.is_power_of_two() { NONE } else { store },
            mask: mask >> skip,
        };
        self.runs[self.count % 16] = (run, bounds);
        self.count += 1;
    }

    /// Divides the polygons `lanes` of a block into runs, in the order of their ids. A polygon joins the run of its
    /// predecessor if this run is close, otherwise one of the last few runs. If none of these runs is close, it begins a
    /// new run. `block` is the number of the block, and of its boxes in the store.
    pub(super) fn gather(&mut self, block: (u32, u32), lanes: u16, boxes: &Boxes<16>) {
        self.count = 0;
        let mut run = OpenRun::NONE;
        let mut breaks = 0;
        for lane in lanes_of(lanes) {
            let bounds = Wide::from_box(&boxes.get(lane));
            if !run.join(lane, bounds) {
                if run.mask != 0 {
                    self.add(block, run.mask, run.bounds);
                }
                breaks += 1;
                // Few runs mean consecutive strokes. Many runs may mean that the ids of strokes alternate.
                if breaks > JOINABLE_RUNS {
                    self.gather_alternating(block, lanes, boxes);
                    return;
                }
                run = OpenRun { mask: 1 << lane, bounds, length_m: bounds.length() };
            }
        }
        if run.mask != 0 {
            self.add(block, run.mask, run.bounds);
        }
    }

    /// Does the same as [`Gathered::gather`] for strokes whose ids alternate.
    fn gather_alternating(&mut self, block: (u32, u32), lanes: u16, boxes: &Boxes<16>) {
        let mut open = [OpenRun::NONE; 16];
        let (mut count, mut joined_count) = (0, 0);
        for lane in lanes_of(lanes) {
            let bounds = Wide::from_box(&boxes.get(lane));
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
        self.count = 0;
        for run in &open[..count] {
            self.add(block, run.mask, run.bounds);
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
