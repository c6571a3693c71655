use super::{PolygonId, bits, marks};

/// Number of polygons of a block: sixteen consecutive numbers, from a multiple of sixteen on.
pub const BLOCK: usize = 16;

/// The set allocates masks for a multiple of this number of blocks, as the indexes do.
const PAGE: usize = 256;

/// Number of blocks in 64 polygons; divides [`PAGE`].
const WORD: usize = 4;

/// Largest number of entries reserved for `listed` at first. If it is larger, a single large number takes more
/// memory.
const MOST_LISTED: usize = 1 << 22;

/// Number of entries that an index may write behind a list.
const BEHIND: usize = 512;

/// A set of polygons as blocks of sixteen consecutive numbers, each with a mask. A query fills the set, occlusion culling
/// clears hidden polygons, and a renderer orders and draws the rest. None of these steps lists numbers.
///
/// A frame's set is cleared and filled again without allocation once it has room for the highest number. It takes a bit for
/// each number up to the highest. Iterating and clearing take time proportional to the span from the lowest to the highest
/// block that was set.
#[derive(Clone, Debug, Default)]
pub struct VisibleBlocks {
    masks: Vec<u16>,
    /// Lower bound of the numbers of blocks with a set bit.
    begin: usize,
    /// Exclusive upper bound of the numbers of blocks with a set bit.
    end: usize,
    len: usize,
    /// Working memory for indexes that list numbers.
    listed: Vec<PolygonId>,
}

/// Largest number of listed polygons that a new set reserves memory for.
const MOST_RESERVED: usize = 1 << 20;

impl VisibleBlocks {
    /// An empty set.
    pub const fn new() -> Self {
        Self { masks: Vec::new(), begin: 0, end: 0, len: 0, listed: Vec::new() }
    }

    /// An empty set with room for numbers below `ids`, or [`PolygonId::LIMIT`] if that is less.
    pub fn with_capacity(ids: usize) -> Self {
        let mut set = Self::new();
        let ids = ids.min(PolygonId::LIMIT as usize);
        set.masks_for(ids);
        // In a browser, reserved memory counts as used.
        if !cfg!(target_family = "wasm") {
            set.listed.reserve(ids.min(MOST_RESERVED) + BEHIND);
        }
        set
    }

    /// Removes all polygons; keeps the memory.
    pub fn clear(&mut self) {
        self.masks[self.begin..self.end].fill(0);
        (self.begin, self.end, self.len) = (0, 0, 0);
    }

    /// Makes this set a copy of another set; keeps the memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.clear();
        if other.end > self.masks.len() {
            self.masks.resize(other.masks.len(), 0);
        }
        let span = other.begin..other.end;
        self.masks[span.clone()].copy_from_slice(&other.masks[span]);
        (self.begin, self.end, self.len) = (other.begin, other.end, other.len);
    }

    /// Number of polygons in the set.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether a polygon is in the set.
    pub fn contains(&self, id: PolygonId) -> bool {
        self.mask(id.index() / BLOCK) >> (id.index() % BLOCK) & 1 == 1
    }

    /// The polygons of a block as a mask; bit 0 stands for number `block * 16`.
    pub fn mask(&self, block: usize) -> u16 {
        self.masks.get(block).copied().unwrap_or(0)
    }

    /// Adds a polygon. Returns whether the set has changed. Numbers from [`PolygonId::LIMIT`] on are not added.
    pub fn insert(&mut self, id: PolygonId) -> bool {
        let before = self.len;
        self.insert_block(id.index() / BLOCK, 1 << (id.index() % BLOCK));
        self.len > before
    }

    /// Adds polygons of a block, except numbers from [`PolygonId::LIMIT`] on.
    pub fn insert_block(&mut self, block: usize, mask: u16) {
        if mask == 0 {
            return;
        }
        if block >= self.masks.len() {
            if block >= PolygonId::LIMIT as usize / BLOCK {
                return;
            }
            self.masks_for((block + 1) * BLOCK);
        }
        self.note_span(block, block + 1);
        let there = &mut self.masks[block];
        self.len += (mask & !*there).count_ones() as usize;
        *there |= mask;
    }

    /// Adds the polygons of another set.
    pub fn add(&mut self, other: &Self) {
        let span = other.begin..other.end;
        let (mut added, there) = (0, &mut self.masks_for(span.end * BLOCK)[span.clone()]);
        for (there, mask) in there.iter_mut().zip(&other.masks[span.clone()]) {
            added += (mask & !*there).count_ones() as usize;
            *there |= mask;
        }
        self.note_filled(span, added);
    }

    /// Removes polygons of a block.
    pub fn remove_block(&mut self, block: usize, mask: u16) {
        if let Some(there) = self.masks.get_mut(block) {
            self.len -= (mask & *there).count_ones() as usize;
            *there &= !mask;
        }
    }

    /// The blocks that are not empty, in order, as pairs of number and mask, for [`ids_of`] or a GPU. Bit `i` of block `b`
    /// stands for polygon `b * 16 + i`.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, u16)> + Clone + '_ {
        let masks = self.masks[self.begin..self.end].iter().enumerate();
        masks.filter(|(_, mask)| **mask != 0).map(|(at, mask)| (self.begin + at, *mask))
    }

    /// The number of the first polygon, and the masks of 64 polygons at a time, including empty blocks in between.
    pub fn words(&self) -> (usize, &[[u16; WORD]]) {
        let (begin, end) = (self.begin / WORD * WORD, self.end.next_multiple_of(WORD));
        (begin * BLOCK, self.masks[begin..end].as_chunks().0)
    }

    /// The polygons, in order of their numbers.
    pub fn ids(&self) -> impl Iterator<Item = PolygonId> + Clone + '_ {
        self.blocks().flat_map(|(block, mask)| ids_of(block, mask))
    }

    /// The polygons as a list, in order of their numbers.
    pub fn to_vec(&self) -> Vec<PolygonId> {
        let mut ids = Vec::with_capacity(self.len);
        ids.extend(self.ids());
        ids
    }

    /// For an index: the masks of all blocks, with room for numbers below `ids`. Set bits by OR, then call
    /// [`VisibleBlocks::note_filled`] with the range of the set blocks.
    #[doc(hidden)]
    pub fn masks_for(&mut self, ids: usize) -> &mut [u16] {
        let blocks = ids.div_ceil(BLOCK);
        if blocks > self.masks.len() {
            let more = (self.masks.len() + self.masks.len() / 2).min(PolygonId::LIMIT as usize / BLOCK);
            let room = blocks.max(more);
            self.masks.resize(room.next_multiple_of(PAGE), 0);
        }
        &mut self.masks
    }

    /// For an index: records that `polygons` polygons were added to these blocks.
    #[doc(hidden)]
    pub fn note_filled(&mut self, blocks: std::ops::Range<usize>, polygons: usize) {
        if !blocks.is_empty() {
            self.note_span(blocks.start, blocks.end);
            self.len += polygons;
        }
    }

    /// Fills the set from an index that returns a list of numbers. `list` appends the numbers to a list whose memory
    /// is kept from frame to frame. `set_all` adds the listed numbers to the set by [`VisibleBlocks::set_all`].
    pub(crate) fn fill_by_list<R>(
        &mut self,
        list: impl FnOnce(&mut Vec<PolygonId>) -> R,
        set_all: impl FnOnce(&mut Self, &[PolygonId]),
    ) -> R {
        let room = (self.masks.len() * BLOCK).min(MOST_LISTED);
        self.with_list(room, |set, ids| {
            let result = list(ids);
            set_all(set, ids);
            result
        })
    }

    /// Passes an empty list with room for `room` numbers to `with`. The list is kept from frame to frame.
    pub(crate) fn with_list<R>(
        &mut self,
        room: usize,
        with: impl FnOnce(&mut Self, &mut Vec<PolygonId>) -> R,
    ) -> R {
        let mut ids = std::mem::take(&mut self.listed);
        ids.clear();
        ids.reserve(room + BEHIND);
        let result = with(self, &mut ids);
        self.listed = ids;
        result
    }

    /// Adds polygons. No polygon may occur twice or be in the set already. The function is inlined, so that it is
    /// compiled for the caller's instruction set.
    #[inline(always)]
    pub(crate) fn set_all(&mut self, ids: &[PolygonId]) {
        let (low, high) = marks::low_and_high(ids);
        if ids.is_empty() {
            return;
        }
        if high >= PolygonId::LIMIT {
            // This happens only with an index that accepts numbers from the limit on, which no index of this crate does.
            self.extend(ids.iter().copied());
            return;
        }
        marks::mark(self.masks_for(high as usize + 1), ids);
        self.note_filled(low as usize / BLOCK..high as usize / BLOCK + 1, ids.len());
    }

    fn note_span(&mut self, begin: usize, end: usize) {
        if self.end == 0 {
            (self.begin, self.end) = (begin, end);
        } else {
            (self.begin, self.end) = (self.begin.min(begin), self.end.max(end));
        }
    }
}

/// The polygons of a block and its mask, in order. Bit `i` of the mask stands for number `block * 16 + i`.
pub fn ids_of(block: usize, mask: u16) -> impl Iterator<Item = PolygonId> + Clone {
    bits::bits_of(u64::from(mask)).map(move |bit| PolygonId((block * BLOCK + bit) as u32))
}

impl Extend<PolygonId> for VisibleBlocks {
    fn extend<I: IntoIterator<Item = PolygonId>>(&mut self, ids: I) {
        for id in ids {
            self.insert(id);
        }
    }
}

impl FromIterator<PolygonId> for VisibleBlocks {
    fn from_iter<I: IntoIterator<Item = PolygonId>>(ids: I) -> Self {
        let mut set = Self::new();
        set.extend(ids);
        set
    }
}

/// Equal if they contain the same polygons.
impl PartialEq for VisibleBlocks {
    fn eq(&self, other: &Self) -> bool {
        self.len == other.len && self.blocks().eq(other.blocks())
    }
}

impl Eq for VisibleBlocks {}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_the_set_of_what_was_added(
            frames in prop::collection::vec(prop::collection::vec(0u32..3000, 0..200), 1..5),
        ) {
            let mut set = VisibleBlocks::new();
            for frame in frames {
                set.clear();
                prop_assert!(set.is_empty() && set.ids().next().is_none());
                let mut plain = BTreeSet::new();
                for id in frame {
                    prop_assert_eq!(set.insert(PolygonId(id)), plain.insert(PolygonId(id)));
                }
                prop_assert_eq!(set.len(), plain.len());
                prop_assert!(set.ids().eq(plain.iter().copied()));
                let mut copy: VisibleBlocks = [PolygonId(70), PolygonId(2500)].into_iter().collect();
                copy.copy_from(&set);
                prop_assert_eq!(&copy, &set);
                prop_assert!(copy.ids().eq(set.ids()));
                prop_assert_eq!(set.to_vec().into_iter().collect::<VisibleBlocks>(), set.clone());
                prop_assert!((0..3100).map(PolygonId).all(|id| set.contains(id) == plain.contains(&id)));
                let bits: u32 = set.blocks().map(|(_, mask)| mask.count_ones()).sum();
                prop_assert_eq!(bits as usize, set.len());
            }
        }
    }
}
