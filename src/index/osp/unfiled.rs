//! The polygons of the store that are not in the tree, group by group.

use super::{
    shelf::{Around, BLOCKS, Shelf},
    store::Store,
};
use crate::{
    index::simd::{Boxes, lanes_of},
    math::Aabb,
};

/// A group with polygons that are not in the tree.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    store: &'a Store,
    shelf: &'a Shelf,
    entry: usize,
    group: usize,
}

impl<'a> Group<'a> {
    /// A group of the shelf at an entry of the directory.
    pub(super) fn new(store: &'a Store, entry: usize, group: usize) -> Self {
        Self { store, shelf: store.shelf_at(entry), entry, group }
    }

    /// Some of the blocks with polygons that are not in the tree: number, these polygons, and the boxes.
    pub(super) fn blocks(self, these: u16) -> impl Iterator<Item = (u32, u16, &'a Boxes<16>)> + Clone {
        lanes_of(these).map(move |lane| self.block(lane))
    }

    /// One of these blocks.
    #[inline(always)]
    pub(super) fn block(self, lane: usize) -> (u32, u16, &'a Boxes<16>) {
        let Self { store, shelf, entry, group } = self;
        let block = group * 16 + lane;
        let lanes = shelf.live[block] & !shelf.filed[block];
        ((entry * BLOCKS + block) as u32, lanes, store.boxes_of(shelf, block))
    }

    /// The boxes around the blocks of the group.
    #[inline(always)]
    pub(super) fn around(self) -> &'a Around {
        &self.shelf.groups[self.group]
    }

    /// A box around these blocks, which may be larger than needed; `None` if it is out of date.
    pub(super) fn bounds(self) -> Option<Aabb> {
        let around = self.around();
        (around.stale & around.unfiled == 0).then(|| around.boxes.around(around.unfiled.into()))
    }
}
