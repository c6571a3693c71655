#![expect(unsafe_code, reason = "exact boxes are looked up without a check; it pays in queries")]

use super::{
    heat::Heat,
    open::OpenBlock,
    pool::{NONE, Pool, Pooled},
};
use crate::index::simd::{Boxes, prefetch, prefetch_lines};

/// Map from ids to places in the tree. Sixteen consecutive ids are a block, and 256 blocks are a shelf. A shelf without
/// polygons is used again, so memory does not grow with ids that only increase.
#[derive(Clone, Debug)]
pub(super) struct IdMap {
    /// Number of each shelf, by `id / IDS_A_SHELF`; [`NONE`] without polygons.
    directory: Vec<u32>,
    shelves: Pool<Shelf>,
    /// The places of each polygon, for blocks with more than one run.
    details: Pool<Detail>,
    /// Boxes of the polygons in runs of several polygons.
    stores: Pool<Exact>,
    /// Number of blocks with a polygon.
    blocks: usize,
}

/// Number of ids of a shelf.
const IDS_A_SHELF: usize = 4096;
const BLOCKS: usize = IDS_A_SHELF / 16;

/// With fewer blocks than this, polygons never count as scattered.
const SURE_BLOCKS: usize = 256;

/// If fewer than one in this number of blocks has runs of several polygons, the polygons count as scattered.
const SCATTERED: usize = 4;

/// Flag of a [`Place`] that holds the number of a [`Detail`].
const DETAILED: u32 = 1 << 31;

/// The place of a run: its page's number times 16, plus its lane.
pub(super) type Place = u32;

#[derive(Clone, Copy, Debug)]
struct Shelf {
    /// For each block, a mask of its ids in the tree.
    in_tree: [u16; BLOCKS],
    /// For each block, the place of its only run; or `DETAILED` with the number of its detail; or [`NONE`].
    place: [u32; BLOCKS],
    /// For each block, the number of its [`Exact`] boxes, or [`NONE`].
    store: [u32; BLOCKS],
    /// For each block, counts of recent moves.
    heat: [Heat; BLOCKS],
    /// Number of blocks with a polygon; in a free shelf, the next free shelf.
    live: u32,
    /// One more than the highest number of a block that has ever had a polygon.
    end: u32,
}

impl Pooled for Shelf {
    const BLANK: Self = Self {
        in_tree: [0; BLOCKS],
        place: [NONE; BLOCKS],
        store: [NONE; BLOCKS],
        heat: [Heat::NONE; BLOCKS],
        live: 0,
        end: 0,
    };

    fn next_free(&self) -> u32 {
        self.live
    }

    fn set_next_free(&mut self, next: u32) {
        self.live = next;
    }
}

#[derive(Clone, Copy, Debug)]
struct Detail {
    places: [Place; 16],
}

impl Pooled for Detail {
    const BLANK: Self = Self { places: [NONE; 16] };

    fn next_free(&self) -> u32 {
        self.places[0]
    }

    fn set_next_free(&mut self, next: u32) {
        self.places[0] = next;
    }
}

/// The boxes of a block's polygons. The lanes of unused ids and of polygons that have a run of their own are unspecified.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Exact {
    boxes: Boxes<16>,
}

impl Pooled for Exact {
    const BLANK: Self = Self { boxes: Boxes::EMPTY };

    fn next_free(&self) -> u32 {
        self.boxes.rows[0][0].to_bits()
    }

    fn set_next_free(&mut self, next: u32) {
        self.boxes.rows[0][0] = f32::from_bits(next);
    }
}

impl IdMap {
    /// A map with room for `polygons` polygons with consecutive ids, and for `most_blocks` blocks in total.
    pub(super) fn with_room_for(polygons: usize, most_blocks: usize) -> Self {
        let shelves = polygons.div_ceil(IDS_A_SHELF);
        Self {
            directory: Vec::with_capacity(shelves.max(1024)),
            shelves: Pool::with_room_for(shelves),
            // If the last polygons of a growing stroke are replaced, nearly every block has several runs. If blocks have
            // fewer polygons than expected and polygons are scattered, only more details are needed.
            details: Pool::with_room_for(polygons / 16 + polygons.min(4096) / 16)
                .and_room_for(2 * most_blocks),
            stores: Pool::with_room_for(polygons / 16).and_room_for(most_blocks),
            blocks: 0,
        }
    }

    #[inline]
    fn split(block: u32) -> (usize, usize) {
        (block as usize / BLOCKS, block as usize % BLOCKS)
    }

    #[inline]
    fn shelf(&self, block: u32) -> Option<(&Shelf, usize)> {
        let (shelf, at) = Self::split(block);
        match self.directory.get(shelf) {
            Some(&number) if number != NONE => Some((&self.shelves[number], at)),
            _ => None,
        }
    }

    #[inline]
    fn shelf_mut(&mut self, block: u32) -> Option<(&mut Shelf, usize)> {
        let (shelf, at) = Self::split(block);
        match self.directory.get(shelf) {
            Some(&number) if number != NONE => Some((&mut self.shelves[number], at)),
            _ => None,
        }
    }

    /// The mask of the ids of a block that are in the tree.
    #[inline]
    pub(super) fn in_tree(&self, block: u32) -> u16 {
        self.shelf(block).map_or(0, |(shelf, at)| shelf.in_tree[at])
    }

    /// Counts a move of a block's polygons; returns whether they move in frame after frame.
    #[inline]
    pub(super) fn is_hot(&mut self, block: u32, clock: u8) -> bool {
        self.shelf_mut(block).is_some_and(|(shelf, at)| shelf.heat[at].note(clock))
    }

    /// Sets the ids of a block that are still in use. Releases the block's entries if `in_tree` is 0.
    pub(super) fn set_in_tree(&mut self, block: u32, in_tree: u16) {
        let (number, at) = Self::split(block);
        if self.directory.get(number).is_none_or(|&shelf| shelf == NONE) {
            return;
        }
        let shelf_number = self.directory[number];
        let shelf = &mut self.shelves[shelf_number];
        shelf.in_tree[at] = in_tree;
        if in_tree != 0 {
            return;
        }
        shelf.live -= 1;
        self.blocks -= 1;
        let (place, store) = (shelf.place[at], shelf.store[at]);
        (shelf.place[at], shelf.store[at]) = (NONE, NONE);
        if place != NONE && place & DETAILED != 0 {
            self.details.give(place & !DETAILED);
        }
        if store != NONE {
            self.stores.give(store);
        }
        if self.shelves[shelf_number].live == 0 {
            self.shelves.give(shelf_number);
            self.directory[number] = NONE;
        }
    }

    /// Prefetches the entries that [`IdMap::set_place`] reads first.
    #[inline]
    pub(super) fn prefetch(&self, block: u32) {
        if let Some((shelf, at)) = self.shelf(block) {
            prefetch(&raw const shelf.place[at]);
            prefetch(&raw const shelf.in_tree[at]);
        }
    }

    /// Prefetches a block's exact boxes, if it has any.
    #[inline]
    pub(super) fn prefetch_boxes(&self, block: u32) {
        prefetch_lines::<6, _>(self.stores.place(self.store(block)));
    }

    /// Prefetches the detail that [`IdMap::set_place`] reads, if the block has one.
    #[inline]
    pub(super) fn prefetch_detail(&self, block: u32) {
        if let Some((shelf, at)) = self.shelf(block)
            && shelf.place[at] != NONE
            && shelf.place[at] & DETAILED != 0
        {
            prefetch(self.details.place(shelf.place[at] & !DETAILED));
        }
    }

    /// The place of the run that contains a polygon; `None` if the polygon is not in the tree.
    #[inline]
    pub(super) fn place(&self, id: u32) -> Option<Place> {
        let (shelf, at) = self.shelf(id / 16)?;
        match shelf.place[at] {
            NONE => None,
            place if place & DETAILED != 0 => Some(self.details[place & !DETAILED].places[id as usize % 16]),
            place => Some(place),
        }
    }

    /// Sets the place of the run that contains the polygons `mask` of a block.
    pub(super) fn set_place(&mut self, block: u32, mask: u16, place: Place) {
        let Some((shelf, at)) = self.shelf_mut(block) else { return };
        let (old, in_tree) = (shelf.place[at], shelf.in_tree[at]);
        if old == NONE || in_tree & !mask == 0 {
            if old != NONE && old & DETAILED != 0 {
                let detail = old & !DETAILED;
                shelf.place[at] = place;
                self.details.give(detail);
            } else {
                shelf.place[at] = place;
            }
            return;
        }
        let detail = if old & DETAILED != 0 {
            old & !DETAILED
        } else {
            let detail = self.details.take();
            self.details[detail].places = [old; 16];
            if let Some((shelf, at)) = self.shelf_mut(block) {
                shelf.place[at] = detail | DETAILED;
            }
            detail
        };
        let places = &mut self.details[detail].places;
        let mut left = mask;
        while left != 0 {
            places[left.trailing_zeros() as usize] = place;
            left &= left - 1;
        }
    }

    /// The exact boxes with this number.
    pub(super) fn boxes(&self, store: u32) -> &Boxes<16> {
        &self.stores[store].boxes
    }

    pub(super) fn boxes_mut(&mut self, store: u32) -> &mut Boxes<16> {
        &mut self.stores[store].boxes
    }

    /// The exact boxes with this number, without a check of the number.
    ///
    /// # Safety
    /// `store` belongs to a run in the tree.
    #[inline(always)]
    pub(super) unsafe fn known_boxes(&self, store: u32) -> &Boxes<16> {
        // SAFETY: a store is in use as long as a run of several polygons needs it; `validate` checks this.
        unsafe { &self.stores.known(store).boxes }
    }

    /// Sets the ids that are in use in the block of `open`, at least one. Stores the exact boxes of the polygons
    /// `shared`, if there are any. Returns the number of these boxes, or [`NONE`].
    pub(super) fn note_block(&mut self, open: &OpenBlock, shared: u16) -> u32 {
        let (number, at) = Self::split(open.block());
        if number >= self.directory.len() {
            self.directory.resize(number + 1, NONE);
        }
        if self.directory[number] == NONE {
            self.directory[number] = self.shelves.take();
        }
        let shelf = &mut self.shelves[self.directory[number]];
        let is_new = shelf.in_tree[at] == 0;
        shelf.live += u32::from(is_new);
        self.blocks += usize::from(is_new);
        shelf.in_tree[at] = open.present();
        shelf.end = shelf.end.max(at as u32 + 1);
        if shared == 0 {
            return NONE;
        }
        if shelf.store[at] == NONE {
            shelf.store[at] = self.stores.take();
            self.stores[shelf.store[at]].boxes = *open.rows();
            return shelf.store[at];
        }
        let to = &mut self.stores[shelf.store[at]].boxes;
        let mut left = shared;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            to.set(lane, &open.bounds(lane));
            left &= left - 1;
        }
        shelf.store[at]
    }

    /// Releases a block's exact boxes if all its runs have one polygon.
    pub(super) fn drop_boxes(&mut self, block: u32) {
        let Some((shelf, at)) = self.shelf_mut(block) else { return };
        let store = std::mem::replace(&mut shelf.store[at], NONE);
        if store != NONE {
            self.stores.give(store);
        }
    }

    /// Number of entries that [`IdMap::shelves`] reads, including those of the directory.
    pub(super) fn entries(&self) -> usize {
        self.directory.len() + self.shelves.live() as usize * BLOCKS
    }

    /// The ids in use, ascending, as shelves: the first id of each shelf, and the masks of its blocks.
    #[inline(always)]
    pub(super) fn shelves(&self) -> impl Iterator<Item = (u32, &[u16])> + '_ {
        let used = self.directory.iter().enumerate().filter(|&(_, &number)| number != NONE);
        used.map(|(i, &number)| {
            let shelf = &self.shelves[number];
            ((i * IDS_A_SHELF) as u32, &shelf.in_tree[..(shelf.end as usize).min(BLOCKS)])
        })
    }

    /// Upper bound of all ids.
    pub(super) fn ids_end(&self) -> usize {
        self.directory.len() * IDS_A_SHELF
    }

    /// Number of blocks with a polygon.
    #[inline]
    pub(super) fn blocks(&self) -> usize {
        self.blocks
    }

    /// The number of a block's exact boxes; [`NONE`] if it has no such boxes.
    pub(super) fn store(&self, block: u32) -> u32 {
        self.shelf(block).map_or(NONE, |(shelf, at)| shelf.store[at])
    }

    /// Makes room for this number of further polygons. Called between two frames.
    pub(super) fn make_room(&mut self, polygons: usize) {
        self.shelves.make_room(polygons.div_ceil(IDS_A_SHELF));
        self.details.make_room(polygons / 16);
        self.stores.make_room(polygons / 16);
        let shelves = polygons.div_ceil(IDS_A_SHELF);
        if self.directory.capacity() - self.directory.len() < shelves {
            self.directory.reserve(self.directory.len().max(1024));
        }
    }

    /// Whether most polygons have a run of their own.
    pub(super) fn are_scattered(&self) -> bool {
        self.blocks >= SURE_BLOCKS && (self.stores.live() as usize) < self.blocks / SCATTERED
    }

    pub(super) fn clear(&mut self) {
        self.directory.clear();
        self.shelves.clear();
        self.details.clear();
        self.stores.clear();
        self.blocks = 0;
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.directory.capacity() * size_of::<u32>()
            + self.shelves.bytes()
            + self.details.bytes()
            + self.stores.bytes()
    }
}
