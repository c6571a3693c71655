#![expect(unsafe_code, reason = "boxes in use are looked up without a check; it pays in queries")]
//! The boxes of all polygons, by id. Sixteen consecutive ids are a block, sixteen blocks a group, sixteen groups a shelf.
//! The box around each block, group and shelf lies beside it, so that a query can walk the polygons in the order of
//! their ids (`in_order.rs`). A new box of a polygon is one write, and marks the boxes above as stale. They are computed
//! again when the block has come to rest.
//!
//! A polygon is *filed* if the tree holds it, too. The store also maps a filed polygon to its run in the tree.

mod insertion;

use insertion::Open;

use super::{
    pool::{NONE, Pool},
    shelf::{Around, BLOCKS, DETAILED, GROUPS, IDS_A_SHELF, Place, Shelf},
    unfiled::Group,
};
use crate::{
    index::{
        IndexError,
        simd::{Boxes, Wide, lanes_of, prefetch_lines},
    },
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

#[derive(Clone, Debug)]
pub(super) struct Store {
    /// Number of each shelf, by `id / IDS_A_SHELF`; [`NONE`] without polygons.
    directory: Vec<u32>,
    /// Boxes around sixteen entries of the directory each.
    pub(super) tops: Vec<Around>,
    shelves: Pool<Shelf>,
    /// The boxes of the polygons of a block. The lanes of unused ids are unspecified.
    exact: Pool<Boxes<16>>,
    /// The places of the polygons of a block with several runs.
    details: Pool<[Place; 16]>,
    len: usize,
    filed: usize,
    /// Number of blocks with a polygon, and with one that is not filed.
    blocks: usize,
    unfiled_blocks: usize,
    /// Number of groups that were wide when they were measured last.
    wide_groups: usize,
    open: Open,
}

/// A block of the store: its shelf, and its position in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    pub(super) shelf: u32,
    pub(super) block: usize,
}

impl Store {
    /// A store with room for `polygons` polygons with consecutive ids, and for `most_blocks` blocks in total.
    pub(super) fn with_room_for(polygons: usize, most_blocks: usize) -> Self {
        let shelves = polygons.div_ceil(IDS_A_SHELF);
        let entries = shelves.max(1024);
        Self {
            directory: Vec::with_capacity(entries),
            tops: Vec::with_capacity(entries / 16),
            // In a browser, reserved memory counts as used.
            shelves: Pool::with_room_for(shelves).and_room_for(if cfg!(target_family = "wasm") {
                0
            } else {
                most_blocks.min(1024)
            }),
            exact: Pool::with_room_for(polygons / BLOCK).and_room_for(most_blocks),
            details: Pool::with_room_for(polygons.min(4096) / BLOCK).and_room_for(2 * most_blocks),
            len: 0,
            filed: 0,
            blocks: 0,
            unfiled_blocks: 0,
            wide_groups: 0,
            open: Open::NONE,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Number of polygons in the tree.
    pub(super) fn filed(&self) -> usize {
        self.filed
    }

    /// Number of polygons that are not in the tree.
    pub(super) fn unfiled(&self) -> usize {
        self.len - self.filed
    }

    /// Number of blocks with a polygon.
    pub(super) fn blocks(&self) -> usize {
        self.blocks
    }

    /// Number of shelves with polygons.
    pub(super) fn shelf_count(&self) -> usize {
        self.shelves.live() as usize
    }

    /// Number of blocks with a polygon that is not filed.
    pub(super) fn unfiled_blocks(&self) -> usize {
        self.unfiled_blocks
    }

    /// Whether most blocks have a polygon that is not filed.
    pub(super) fn is_mostly_unfiled(&self) -> bool {
        2 * self.unfiled_blocks > self.blocks
    }

    /// Whether most polygons lie apart from those with the next ids, so that most groups are wide.
    pub(super) fn are_scattered(&self) -> bool {
        2 * BLOCK * self.wide_groups > self.blocks
    }

    /// Upper bound of all ids.
    pub(super) fn ids_end(&self) -> usize {
        self.directory.len() * IDS_A_SHELF
    }

    /// The position of a block, if its shelf has polygons.
    #[inline(always)]
    pub(super) fn at(&self, block: u32) -> Option<At> {
        let (number, at) = (block as usize / BLOCKS, block as usize % BLOCKS);
        let &shelf = self.directory.get(number)?;
        (shelf != NONE).then_some(At { shelf, block: at })
    }

    /// The shelf with a number.
    #[inline(always)]
    pub(super) fn shelf(&self, number: u32) -> &Shelf {
        &self.shelves[number]
    }

    #[inline(always)]
    pub(super) fn shelf_mut(&mut self, number: u32) -> &mut Shelf {
        &mut self.shelves[number]
    }

    /// The shelf of an entry of the directory that is used in `tops`.
    #[inline(always)]
    pub(super) fn shelf_at(&self, entry: usize) -> &Shelf {
        &self.shelves[self.directory[entry]]
    }

    /// The boxes of a block that has a polygon.
    #[inline(always)]
    pub(super) fn boxes_of(&self, shelf: &Shelf, block: usize) -> &Boxes<16> {
        self.boxes(shelf.boxes[block])
    }

    /// The boxes of the first `blocks` blocks of a group, which all have polygons, if they lie in a row.
    #[inline(always)]
    pub(super) fn row(&self, shelf: &Shelf, group: usize, blocks: usize) -> Option<&[Boxes<16>]> {
        let numbers = &shelf.boxes[group * 16..][..blocks];
        let first = *numbers.first()?;
        let steps =
            numbers.iter().zip(0..).fold(0, |steps, (number, i)| steps | number.wrapping_sub(first) ^ i);
        if steps != 0 { None } else { self.exact.row(first, blocks) }
    }

    /// The exact boxes with this number, without a check of the number.
    ///
    /// # Safety
    /// `number` belongs to a block that has a polygon.
    #[inline(always)]
    pub(super) unsafe fn known_boxes(&self, number: u32) -> &Boxes<16> {
        // SAFETY: a block has boxes as long as it has a polygon; `validate` checks this.
        unsafe { self.exact.known(number) }
    }

    /// The exact boxes with this number.
    pub(super) fn boxes(&self, number: u32) -> &Boxes<16> {
        &self.exact[number]
    }

    /// The number of a block's boxes; [`NONE`] if it has no polygon.
    pub(super) fn number(&self, block: u32) -> u32 {
        self.at(block).map_or(NONE, |at| self.shelves[at.shelf].boxes[at.block])
    }

    /// The polygons of a block that are in the tree.
    #[inline]
    pub(super) fn filed_lanes(&self, block: u32) -> u16 {
        self.at(block).map_or(0, |at| self.shelves[at.shelf].filed[at.block])
    }

    /// The box of a polygon.
    pub(super) fn bounds(&self, id: PolygonId) -> Option<Aabb> {
        let (at, lane) = (self.at(id.0 / 16)?, id.index() % BLOCK);
        let shelf = &self.shelves[at.shelf];
        let is_live = shelf.live[at.block] >> lane & 1 == 1;
        is_live.then(|| self.exact[shelf.boxes[at.block]].get(lane))
    }

    /// Makes an entry of a block that has no shelf or no polygon.
    #[inline(never)]
    fn make(&mut self, block: u32) -> At {
        let (number, at) = (block as usize / BLOCKS, block as usize % BLOCKS);
        if number >= self.directory.len() {
            self.directory.resize(number + 1, NONE);
            self.tops.resize(number / 16 + 1, Around::EMPTY);
        }
        if self.directory[number] == NONE {
            self.directory[number] = self.shelves.take();
        }
        let shelf = self.directory[number];
        if self.shelves[shelf].live[at] == 0 {
            self.shelves[shelf].boxes[at] = self.exact.take();
            self.blocks += 1;
        }
        At { shelf, block: at }
    }

    /// The position of a block, if it has polygons.
    #[inline(always)]
    pub(super) fn at_live(&self, block: u32) -> Option<At> {
        self.at(block).filter(|at| self.shelves[at.shelf].live[at.block] != 0)
    }

    /// Sets new boxes of polygons of a block, none of which is in the tree. Marks them as moved, and the boxes above as
    /// stale. Calls `refuse` with the errors of refused updates. Returns the number of boxes set.
    #[inline(always)]
    pub(super) fn set(
        &mut self,
        at: At,
        updates: &[(PolygonId, Aabb)],
        mut refuse: impl FnMut(IndexError),
    ) -> usize {
        let shelf = &mut self.shelves[at.shelf];
        let (live, boxes) = (shelf.live[at.block], &mut self.exact[shelf.boxes[at.block]]);
        let (mut moved, mut count) = (0, 0);
        for (id, bounds) in updates {
            let lane = id.index() % BLOCK;
            if live >> lane & 1 == 0 {
                refuse(IndexError::Unknown(*id));
            } else if !Wide::from_box(bounds).is_valid() {
                refuse(IndexError::InvalidBounds(*id));
            } else {
                boxes.set(lane, bounds);
                (moved, count) = (moved | 1 << lane, count + 1);
            }
        }
        let (group, bit) = (at.block / 16, 1 << (at.block % 16));
        shelf.moved[at.block] |= moved;
        if moved == 0 || shelf.groups[group].stale & bit != 0 {
            return count;
        }
        shelf.groups[group].loose |= bit;
        shelf.groups[group].stale |= bit;
        shelf.top.stale |= 1 << group;
        let entry = updates.first().map_or(0, |(id, _)| id.index() / IDS_A_SHELF);
        self.tops[entry / 16].stale |= 1 << (entry % 16);
        count
    }

    /// Sets the valid box of a polygon that has moved of late: it is not in the tree, and its block is marked already.
    /// Returns false, without effect, for other polygons.
    #[inline(always)]
    pub(super) fn write(&mut self, id: PolygonId, bounds: &Aabb) -> bool {
        let (block, lane) = (id.0 / 16, id.index() % BLOCK);
        let Some(at) = self.at(block) else { return false };
        let is_open = self.is_open(block);
        let shelf = &mut self.shelves[at.shelf];
        let (group, bit) = (at.block / 16, 1 << (at.block % 16));
        let is_marked = shelf.groups[group].stale & shelf.waiting[group] & bit != 0;
        let is_free = (shelf.live[at.block] & !shelf.filed[at.block]) >> lane & 1 == 1;
        if !is_marked || !is_free || is_open {
            return false;
        }
        shelf.moved[at.block] |= 1 << lane;
        self.exact[shelf.boxes[at.block]].set(lane, bounds);
        true
    }

    /// Corrects the bits above a block after its polygons have changed.
    fn note(&mut self, at: At, block: u32) {
        let shelf = &mut self.shelves[at.shelf];
        let (live, filed) = (shelf.live[at.block], shelf.filed[at.block]);
        let (group, entry) = (at.block / 16, block as usize / BLOCKS);
        let top = &mut self.tops[entry / 16];
        let of_group = &mut shelf.groups[group];
        let change = of_group.note(at.block % 16, live != 0, live != filed);
        self.unfiled_blocks = self.unfiled_blocks.wrapping_add_signed(change);
        shelf.top.note(group, of_group.used != 0, of_group.unfiled != 0);
        top.note(entry % 16, shelf.top.used != 0, shelf.top.unfiled != 0);
    }

    /// Removes a polygon that is not in the tree; `None` if it is not there. The caller lets the block wait.
    pub(super) fn remove(&mut self, id: PolygonId) -> Option<At> {
        let (block, lane) = (id.0 / 16, id.index() % BLOCK);
        let at = self.at(block)?;
        let shelf = &mut self.shelves[at.shelf];
        if shelf.live[at.block] >> lane & 1 == 0 {
            return None;
        }
        debug_assert!(shelf.filed[at.block] >> lane & 1 == 0, "the tree holds the polygon");
        shelf.live[at.block] &= !(1 << lane);
        shelf.moved[at.block] &= !(1 << lane);
        self.len -= 1;
        if shelf.live[at.block] == 0 {
            self.exact.give(std::mem::replace(&mut shelf.boxes[at.block], NONE));
            shelf.resting[at.block / 16] &= !(1 << (at.block % 16));
            self.blocks -= 1;
        }
        shelf.groups[at.block / 16].loose |= 1 << (at.block % 16);
        if shelf.live[at.block] == shelf.filed[at.block] {
            self.note(at, block);
        }
        Some(at)
    }

    /// Releases a shelf without polygons, unless a block of it still waits for an examination.
    pub(super) fn drop_shelf(&mut self, at: At, block: u32) {
        let shelf = &self.shelves[at.shelf];
        if shelf.top.used == 0 && shelf.waiting == [0; 16] {
            self.shelves.give(at.shelf);
            let entry = block as usize / BLOCKS;
            self.directory[entry] = NONE;
            let top = &mut self.tops[entry / 16];
            top.note(entry % 16, false, false);
            top.stale &= !(1 << (entry % 16));
        }
    }

    /// Records that polygons of a block are in the tree now.
    pub(super) fn file(&mut self, block: u32, lanes: u16) {
        let Some(at) = self.at(block) else { return };
        self.shelves[at.shelf].filed[at.block] |= lanes;
        self.filed += lanes.count_ones() as usize;
        self.note(at, block);
    }

    /// Records that a polygon is no longer in the tree.
    pub(super) fn unfile(&mut self, id: u32) {
        let block = id / 16;
        let Some(at) = self.at(block) else { return };
        let shelf = &mut self.shelves[at.shelf];
        shelf.filed[at.block] &= !(1 << (id % 16));
        self.filed -= 1;
        if shelf.filed[at.block] == 0 {
            let place = std::mem::replace(&mut shelf.place[at.block], NONE);
            if place != NONE && place & DETAILED != 0 {
                self.details.give(place & !DETAILED);
            }
        }
        self.note(at, block);
    }

    /// Records that no polygon is in the tree.
    pub(super) fn unfile_all(&mut self) {
        for entry in 0..self.directory.len() {
            if self.directory[entry] == NONE {
                continue;
            }
            let shelf = &mut self.shelves[self.directory[entry]];
            (shelf.filed, shelf.place) = ([0; BLOCKS], [NONE; BLOCKS]);
            for group in &mut shelf.groups {
                group.unfiled = group.used;
            }
            shelf.top.unfiled = shelf.top.used;
        }
        for top in &mut self.tops {
            top.unfiled = top.used;
        }
        self.details.clear();
        (self.filed, self.unfiled_blocks) = (0, self.blocks);
    }

    /// Marks all blocks with unfiled polygons as waiting, and no block as resting. Calls `out` with those that did not
    /// wait before.
    pub(super) fn let_all_wait(&mut self, mut out: impl FnMut(u32)) {
        for (entry, &number) in self.directory.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let shelf = &mut self.shelves[number];
            for group in 0..16 {
                for lane in lanes_of(shelf.groups[group].unfiled & !shelf.waiting[group]) {
                    out((entry * BLOCKS + group * 16 + lane) as u32);
                }
                shelf.waiting[group] |= shelf.groups[group].unfiled;
                shelf.resting[group] = 0;
            }
        }
    }

    /// Computes the box around a block again if it may be too large or stale, and the boxes above. Returns how many.
    pub(super) fn refit(&mut self, at: At, block: u32) -> u64 {
        let shelf = &mut self.shelves[at.shelf];
        let (group, lane) = (at.block / 16, at.block % 16);
        let around = &mut shelf.groups[group];
        if around.loose >> lane & 1 == 0 {
            if lane == 15 {
                let bounds = around.boxes.around(around.used.into());
                self.wide_groups = self.wide_groups.wrapping_add_signed(around.measure(&bounds));
            }
            return 0;
        }
        let live = shelf.live[at.block];
        let bounds = match live {
            0 => Aabb::EMPTY,
            _ => self.exact[shelf.boxes[at.block]].around(live.into()),
        };
        around.boxes.set(lane, &bounds);
        around.loose &= !(1 << lane);
        around.stale &= !(1 << lane);
        if around.stale != 0 {
            return 1;
        }
        let bounds = around.boxes.around(around.used.into());
        self.wide_groups = self.wide_groups.wrapping_add_signed(around.measure(&bounds));
        shelf.top.boxes.set(group, &bounds);
        shelf.top.stale &= !(1 << group);
        if shelf.top.stale != 0 {
            return 2;
        }
        let entry = block as usize / BLOCKS;
        let top = &mut self.tops[entry / 16];
        top.boxes.set(entry % 16, &shelf.top.boxes.around(shelf.top.used.into()));
        top.stale &= !(1 << (entry % 16));
        3
    }

    /// A box around all polygons.
    pub(super) fn around(&self) -> Aabb {
        let mut all = Aabb::EMPTY;
        for (at, top) in self.tops.iter().enumerate() {
            all = all.union(&top.boxes.around((top.used & !top.stale).into()));
            for entry in lanes_of(top.used & top.stale) {
                let shelf = self.shelf_at(at * 16 + entry);
                all = all.union(&shelf.top.boxes.around((shelf.top.used & !shelf.top.stale).into()));
                for group in lanes_of(shelf.top.used & shelf.top.stale) {
                    for block in lanes_of(shelf.groups[group].used).map(|lane| group * 16 + lane) {
                        let lanes = shelf.live[block].into();
                        all = all.union(&self.boxes_of(shelf, block).around(lanes));
                    }
                }
            }
        }
        all
    }

    /// The shelves with polygons that are not in the tree, and the boxes around their groups.
    pub(super) fn unfiled_shelves(&self) -> impl Iterator<Item = (usize, &Around)> {
        let tops = self.tops.iter().enumerate();
        let entries = tops.flat_map(|(at, top)| lanes_of(top.unfiled).map(move |lane| at * 16 + lane));
        entries.map(|entry| (entry, &self.shelf_at(entry).top))
    }

    /// The groups with polygons that are not in the tree.
    pub(super) fn unfiled_groups(&self) -> impl Iterator<Item = Group<'_>> {
        self.unfiled_shelves().flat_map(move |(entry, top)| {
            lanes_of(top.unfiled).map(move |group| self.group(entry * GROUPS + group))
        })
    }

    /// The group with this number, in a shelf with polygons.
    #[inline(always)]
    pub(super) fn group(&self, number: usize) -> Group<'_> {
        let (entry, group) = (number / GROUPS, number % GROUPS);
        Group::new(self, entry, group)
    }

    /// The shelves, ascending by id: the number of the first block, and the shelf.
    pub(super) fn shelves(&self) -> impl Iterator<Item = (u32, &Shelf)> {
        let used = self.directory.iter().enumerate().filter(|&(_, &number)| number != NONE);
        used.map(|(entry, &number)| ((entry * BLOCKS) as u32, &self.shelves[number]))
    }

    /// The place of the run that contains a polygon; `None` if no polygon of its block is in the tree.
    #[inline]
    pub(super) fn place(&self, id: u32) -> Option<Place> {
        let at = self.at(id / 16)?;
        match self.shelves[at.shelf].place[at.block] {
            NONE => None,
            place if place & DETAILED != 0 => Some(self.details[place & !DETAILED][id as usize % 16]),
            place => Some(place),
        }
    }

    /// Sets the place of the run that contains the polygons `mask` of a block.
    pub(super) fn set_place(&mut self, block: u32, mask: u16, place: Place) {
        let Some(At { shelf, block: at }) = self.at(block) else { return };
        let shelf = &mut self.shelves[shelf];
        let (old, filed) = (shelf.place[at], shelf.filed[at]);
        if old == NONE || filed & !mask == 0 {
            shelf.place[at] = place;
            if old != NONE && old & DETAILED != 0 {
                self.details.give(old & !DETAILED);
            }
            return;
        }
        let detail = if old & DETAILED != 0 {
            old & !DETAILED
        } else {
            let detail = self.details.take();
            self.details[detail] = [old; 16];
            shelf.place[at] = detail | DETAILED;
            detail
        };
        let places = &mut self.details[detail];
        for lane in lanes_of(mask) {
            places[lane] = place;
        }
    }

    /// Prefetches the detail that [`Store::set_place`] reads, if the block has one.
    #[inline]
    pub(super) fn prefetch_detail(&self, block: u32) {
        if let Some(At { shelf, block }) = self.at(block) {
            let place = self.shelves[shelf].place[block];
            if place != NONE && place & DETAILED != 0 {
                prefetch_lines::<1, _>(self.details.place(place & !DETAILED));
            }
        }
    }

    /// Makes room for this number of further polygons. Called between two frames.
    pub(super) fn make_room(&mut self, polygons: usize) {
        let shelves = polygons.div_ceil(IDS_A_SHELF);
        self.shelves.make_room(shelves);
        self.details.make_room(polygons / BLOCK);
        self.exact.make_room(polygons / BLOCK);
        if self.directory.capacity() - self.directory.len() < shelves {
            self.directory.reserve(self.directory.len().max(1024));
            self.tops.reserve(self.tops.len().max(64));
        }
    }

    pub(super) fn clear(&mut self) {
        self.directory.clear();
        self.tops.clear();
        self.shelves.clear();
        self.exact.clear();
        self.details.clear();
        (self.len, self.filed) = (0, 0);
        (self.blocks, self.unfiled_blocks, self.wide_groups) = (0, 0, 0);
        self.open = Open::NONE;
    }

    /// Memory held, bytes; as in [`Pool::bytes`], room that was never written to does not count.
    pub(super) fn bytes(&self) -> usize {
        self.directory.len() * size_of::<u32>()
            + self.tops.len() * size_of::<Around>()
            + self.shelves.bytes()
            + self.exact.bytes()
            + self.details.bytes()
    }
}
