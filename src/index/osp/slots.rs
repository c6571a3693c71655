//! The slots of the polygons in the flat rows: the group and lane with the box of each id.

use crate::polygon::{BLOCK, PolygonId};

/// Flag of a slot in a group that belongs to a single block.
const OWN: u32 = 1 << 31;

/// The group and lane of a moving polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot(u32);

impl Slot {
    pub(super) fn own(group: usize, lane: usize) -> Self {
        Self((group * BLOCK + lane) as u32 | OWN)
    }

    pub(super) fn shared(group: usize, lane: usize) -> Self {
        Self((group * BLOCK + lane) as u32)
    }

    #[inline(always)]
    pub(super) const fn is_own(self) -> bool {
        self.0 & OWN != 0
    }

    #[inline(always)]
    pub(super) const fn group(self) -> usize {
        (self.0 & !OWN) as usize / BLOCK
    }

    #[inline(always)]
    pub(super) const fn lane(self) -> usize {
        self.0 as usize % BLOCK
    }

    /// The slot at a wrapping distance.
    #[inline(always)]
    pub(super) const fn after(self, by: u32) -> Self {
        Self(self.0.wrapping_add(by))
    }
}

/// The slots of ids in shared groups, and the groups that belong to single blocks. A chunk is allocated as zeros, so
/// the system commits its memory only at the first write.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots {
    /// A chunk begins with the slots of its ids: `group * 16 + lane + 1`, or 0 for a polygon that is not in a shared
    /// group. It ends with the groups that belong to its blocks: `group + 1`, or 0 for a block without such a group.
    chunks: Vec<Box<[u32]>>,
    /// For each chunk, the number of its entries that are not 0.
    used: Vec<u32>,
    /// The first chunks are kept when no entry is in use. Others are freed, because the ids of a long session grow.
    kept: usize,
    /// Upper bound of the ids so far whose entries were written to.
    ids_end: usize,
}

impl Slots {
    /// Number of ids of a chunk. For smaller chunks, some systems write the zeros immediately instead of at the first
    /// use.
    const CHUNK: usize = 1 << 16;

    pub(super) fn with_room_for(ids: usize) -> Self {
        let mut chunks = Vec::with_capacity(PolygonId::LIMIT as usize / Self::CHUNK);
        chunks.extend((0..ids.div_ceil(Self::CHUNK)).map(|_| Self::chunk()));
        Self { used: vec![0; chunks.len()], kept: chunks.len(), ids_end: 0, chunks }
    }

    fn chunk() -> Box<[u32]> {
        vec![0; Self::CHUNK + Self::CHUNK / BLOCK].into_boxed_slice()
    }

    /// The slot of a polygon in a shared group.
    #[inline(always)]
    pub(super) fn shared(&self, id: PolygonId) -> Option<Slot> {
        let chunk = self.chunks.get(id.index() / Self::CHUNK)?;
        let slot = *chunk.get(id.index() % Self::CHUNK)?;
        (slot != 0).then(|| Slot(slot - 1))
    }

    /// Number of polygons of a block in shared groups.
    #[inline]
    pub(super) fn shared_in_block(&self, block: usize) -> usize {
        let slots = self.chunks.get(block / (Self::CHUNK / BLOCK)).and_then(|chunk| {
            let first = block % (Self::CHUNK / BLOCK) * BLOCK;
            chunk.get(first..first + BLOCK)
        });
        slots.map_or(0, |slots| slots.iter().filter(|&&slot| slot != 0).count())
    }

    /// The group that belongs to a block.
    #[inline(always)]
    pub(super) fn own_group(&self, block: usize) -> Option<usize> {
        let chunk = self.chunks.get(block / (Self::CHUNK / BLOCK))?;
        let group = *chunk.get(Self::CHUNK + block % (Self::CHUNK / BLOCK))?;
        (group != 0).then(|| group as usize - 1)
    }

    /// Sets the slot of a polygon in a shared group.
    pub(super) fn set_shared(&mut self, id: PolygonId, slot: Option<Slot>) {
        let entry = slot.map_or(0, |slot| slot.0 + 1);
        self.set(id.index() / Self::CHUNK, id.index() % Self::CHUNK, entry);
        self.ids_end = self.ids_end.max(id.index() + 1);
    }

    /// Sets the group that belongs to a block.
    pub(super) fn set_own_group(&mut self, block: usize, group: Option<usize>) {
        let (chunk, at) = (block / (Self::CHUNK / BLOCK), block % (Self::CHUNK / BLOCK));
        self.set(chunk, Self::CHUNK + at, group.map_or(0, |group| group as u32 + 1));
        self.ids_end = self.ids_end.max((block + 1) * BLOCK);
    }

    fn set(&mut self, number: usize, at: usize, entry: u32) {
        if number >= self.chunks.len() {
            self.chunks.resize_with(number + 1, Box::default);
            self.used.resize(number + 1, 0);
        }
        let chunk = &mut self.chunks[number];
        if chunk.is_empty() {
            if entry == 0 {
                return;
            }
            *chunk = Self::chunk();
        }
        let old = std::mem::replace(&mut chunk[at], entry);
        let used = &mut self.used[number];
        *used = *used + u32::from(entry != 0) - u32::from(old != 0);
        if *used == 0 && number >= self.kept {
            *chunk = Box::default();
        }
    }

    /// Clears the slots of ids below `end`, and the groups of their blocks.
    pub(super) fn clear(&mut self, end: usize) {
        self.chunks[self.kept..].fill_with(Box::default);
        self.used.fill(0);
        for (number, chunk) in self.chunks[..self.kept].iter_mut().enumerate() {
            let here = end.saturating_sub(number * Self::CHUNK).min(Self::CHUNK);
            chunk[..here].fill(0);
            chunk[Self::CHUNK..][..here.div_ceil(BLOCK)].fill(0);
        }
    }

    /// Memory held, bytes, without memory that was never written to.
    pub(super) fn bytes(&self) -> usize {
        let more = self.chunks[self.kept..].iter().map(|chunk| size_of_val(&**chunk)).sum::<usize>();
        self.ids_end.min(self.kept * Self::CHUNK) * size_of::<u32>() + more
    }
}
