//! What the store consists of: shelves, groups and blocks of consecutive ids, and the boxes around them.

use super::pool::{NONE, Pooled};
use crate::{
    index::simd::{Boxes, lanes_of},
    math::Aabb,
    polygon::BLOCK,
};

/// Number of blocks of a shelf.
pub(super) const BLOCKS: usize = 256;
/// Number of groups of a shelf.
pub(super) const GROUPS: usize = 16;
/// Number of ids of a shelf.
pub(super) const IDS_A_SHELF: usize = BLOCKS * BLOCK;

/// Flag of a [`Place`] that holds the number of a detail in the store.
pub(super) const DETAILED: u32 = 1 << 31;

/// The place of a run: its page's number times 16, plus its lane.
pub(super) type Place = u32;

/// Boxes around sixteen blocks, groups or shelves, with a bit for each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    pub(super) boxes: Boxes<16>,
    /// Those with a polygon.
    pub(super) used: u16,
    /// Those with a polygon that is not filed.
    pub(super) unfiled: u16,
    /// Those whose box is out of date. Then the box around this entry is out of date, too.
    pub(super) stale: u16,
    /// Those whose box may be too large, and the stale ones. Only used for blocks.
    pub(super) loose: u16,
    /// Whether most boxes are nearly as large as the box around them, so that a test of them decides little. Only used
    /// for blocks.
    pub(super) is_wide: bool,
}

impl Around {
    pub(super) const EMPTY: Self =
        Self { boxes: Boxes::EMPTY, used: 0, unfiled: 0, stale: 0, loose: 0, is_wide: false };

    /// Sets or clears the bit of a lane in `used` and `unfiled`. Returns the change of the number of unfiled lanes.
    #[inline]
    pub(super) fn note(&mut self, lane: usize, is_used: bool, is_unfiled: bool) -> isize {
        let bit = 1 << (lane % 16);
        let change = isize::from(is_unfiled) - isize::from(self.unfiled & bit != 0);
        self.used = self.used & !bit | u16::from(is_used) << (lane % 16);
        self.unfiled = self.unfiled & !bit | u16::from(is_unfiled) << (lane % 16);
        change
    }

    /// Sets `is_wide`: whether the mean longest edge of the boxes is at least half of the longest edge of the box around
    /// them. Returns the change of the number of wide groups.
    pub(super) fn measure(&mut self, bounds: &Aabb) -> isize {
        let longest = |bounds: &Aabb| bounds.extent().max_element();
        let sum: f32 = lanes_of(self.used).map(|lane| longest(&self.boxes.get(lane))).sum();
        let was_wide = self.is_wide;
        // Not true for an empty group, whose boxes have no extent.
        self.is_wide = self.used != 0 && 2.0 * sum >= longest(bounds) * self.used.count_ones() as f32;
        isize::from(self.is_wide) - isize::from(was_wide)
    }
}

/// 4,096 consecutive ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shelf {
    /// For each block, its polygons.
    pub(super) live: [u16; BLOCKS],
    /// For each block, its polygons in the tree.
    pub(super) filed: [u16; BLOCKS],
    /// For each block, the polygons that were inserted or moved since the block was last examined.
    pub(super) moved: [u16; BLOCKS],
    /// For each block, the place of its only run; or `DETAILED` with the number of its detail; or [`NONE`].
    pub(super) place: [u32; BLOCKS],
    /// For each block with a polygon, the number of its boxes.
    pub(super) boxes: [u32; BLOCKS],
    /// For each group, the boxes around its blocks.
    pub(super) groups: [Around; 16],
    /// The boxes around the groups.
    pub(super) top: Around,
    /// For each group, the blocks that wait for an examination.
    pub(super) waiting: [u16; 16],
    /// For each group, the blocks that did not move between their last two examinations.
    pub(super) resting: [u16; 16],
}

impl Pooled for Shelf {
    const BLANK: Self = Self {
        live: [0; BLOCKS],
        filed: [0; BLOCKS],
        moved: [0; BLOCKS],
        place: [NONE; BLOCKS],
        boxes: [NONE; BLOCKS],
        groups: [Around::EMPTY; 16],
        top: Around::EMPTY,
        waiting: [0; 16],
        resting: [0; 16],
    };
    const SHIFT: u32 = 2;
}

/// The place of each polygon of a block with more than one run.
impl Pooled for [Place; 16] {
    const BLANK: Self = [NONE; 16];
}

/// The boxes of a block's polygons. The lanes of unused ids are unspecified.
impl Pooled for Boxes<16> {
    const BLANK: Self = Self::EMPTY;
}
