//! Inserts polygons into the store.

use super::{At, Store};
use crate::{
    index::{
        osp::{
            pool::NONE,
            shelf::{Around, BLOCKS},
        },
        simd::Wide,
    },
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

/// The block of the last insertion. From its second new polygon on, the boxes above are behind, and marked as stale. They
/// are widened once, when the block is closed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    /// Number of the block; [`NONE`] if no block is open.
    block: u32,
    at: At,
    is_behind: bool,
    /// Whether the block's box was stale before.
    was_stale: bool,
    /// The box around the polygons that the boxes above may not contain.
    bounds: Wide,
}

impl Open {
    pub(super) const NONE: Self = Self {
        block: NONE,
        at: At { shelf: NONE, block: 0 },
        is_behind: false,
        was_stale: false,
        bounds: Wide::EMPTY,
    };
}

impl Store {
    /// Whether this block is open.
    #[inline(always)]
    pub(in crate::index::osp) fn is_open(&self, block: u32) -> bool {
        self.open.block == block
    }

    /// Inserts a polygon with a valid box into a block that is not open, and opens this block; `None` if it is there.
    #[inline(always)]
    pub(in crate::index::osp) fn open(&mut self, id: PolygonId, bounds: &Aabb) -> Option<At> {
        if self.open.is_behind {
            self.close();
        }
        let (block, lane) = (id.0 / 16, id.index() % BLOCK);
        let at = match self.at_live(block) {
            Some(at) if self.shelves[at.shelf].live[at.block] >> lane & 1 == 1 => return None,
            Some(at) => at,
            None => self.make(block),
        };
        let was_unfiled = self.shelves[at.shelf].groups[at.block / 16].unfiled >> (at.block % 16) & 1 == 1;
        self.unfiled_blocks += usize::from(!was_unfiled);
        for (around, lane) in self.above(block, at) {
            around.boxes.grow(lane, bounds);
            if !was_unfiled {
                around.used |= 1 << lane;
                around.unfiled |= 1 << lane;
            }
        }
        (self.open.block, self.open.at) = (block, at);
        self.add(at, lane, bounds);
        Some(at)
    }

    /// Inserts a polygon with a valid box into the open block. Returns false if it is there.
    #[inline(always)]
    pub(in crate::index::osp) fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> bool {
        let (at, lane) = (self.open.at, id.index() % BLOCK);
        if self.shelves[at.shelf].live[at.block] >> lane & 1 == 1 {
            return false;
        }
        if !self.open.is_behind {
            self.fall_behind();
        }
        self.open.bounds = self.open.bounds.union(Wide::from_box(bounds));
        self.add(at, lane, bounds);
        true
    }

    /// Adds a polygon to a block.
    #[inline(always)]
    fn add(&mut self, at: At, lane: usize, bounds: &Aabb) {
        let shelf = &mut self.shelves[at.shelf];
        shelf.live[at.block] |= 1 << lane;
        shelf.moved[at.block] |= 1 << lane;
        self.exact[shelf.boxes[at.block]].set(lane, bounds);
        self.len += 1;
    }

    /// Marks the boxes above the open block as stale.
    #[inline(never)]
    fn fall_behind(&mut self) {
        let Open { block, at, .. } = self.open;
        let was_stale = self.shelves[at.shelf].groups[at.block / 16].stale >> (at.block % 16) & 1 == 1;
        for (around, lane) in self.above(block, at) {
            around.stale |= 1 << lane;
        }
        (self.open.is_behind, self.open.was_stale, self.open.bounds) = (true, was_stale, Wide::EMPTY);
    }

    /// The boxes around a block's group, shelf and sixteen shelves, with the lanes of the block, group and shelf.
    #[inline(always)]
    fn above(&mut self, block: u32, at: At) -> [(&mut Around, usize); 3] {
        let (shelf, entry) = (&mut self.shelves[at.shelf], block as usize / BLOCKS);
        let group = at.block / 16;
        [
            (&mut shelf.groups[group], at.block % 16),
            (&mut shelf.top, group),
            (&mut self.tops[entry / 16], entry % 16),
        ]
    }

    /// Closes this block if it is open.
    #[inline]
    pub(in crate::index::osp) fn close_if(&mut self, block: u32) {
        if self.is_open(block) {
            self.close();
        }
    }

    /// Closes the open block, if there is one: widens the boxes above if they are behind.
    pub(in crate::index::osp) fn close(&mut self) {
        let Open { block, at, is_behind, was_stale, bounds } = self.open;
        (self.open.block, self.open.is_behind) = (NONE, false);
        if !is_behind {
            return;
        }
        let (bounds, mut is_stale) = (bounds.to_box(), was_stale);
        for (around, lane) in self.above(block, at) {
            around.boxes.grow(lane, &bounds);
            around.stale &= !(u16::from(!is_stale) << lane);
            is_stale = around.stale != 0;
        }
    }
}
