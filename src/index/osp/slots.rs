//! The slots of the polygons in the flat rows: the group and lane with the box of each id.

use crate::polygon::{BLOCK, PolygonId};

/// Marks a slot in a group that belongs to a single block.
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

    #[inline(always)]
    pub(super) const fn next(self) -> Self {
        Self(self.0 + 1)
    }
}

/// The slot of each id, in chunks of zeros. The system commits the memory of a chunk at the first write.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots {
    /// For each id `group * 16 + lane + 1`, with [`OWN`] in groups of one block; 0 for a polygon that is not in the rows.
    chunks: Vec<Box<[u32]>>,
}

impl Slots {
    /// Number of ids of a chunk. Some systems write the zeros of smaller chunks at once, not on first use.
    const CHUNK: usize = 1 << 16;

    pub(super) fn with_room_for(ids: usize) -> Self {
        let mut chunks = Vec::with_capacity(PolygonId::LIMIT as usize / Self::CHUNK);
        chunks.extend((0..ids.div_ceil(Self::CHUNK)).map(|_| Self::chunk()));
        Self { chunks }
    }

    fn chunk() -> Box<[u32]> {
        vec![0; Self::CHUNK].into_boxed_slice()
    }

    #[inline(always)]
    pub(super) fn get(&self, id: PolygonId) -> Option<Slot> {
        let chunk = self.chunks.get(id.index() / Self::CHUNK)?;
        let slot = *chunk.get(id.index() % Self::CHUNK)?;
        (slot != 0).then(|| Slot(slot - 1))
    }

    pub(super) fn set(&mut self, id: PolygonId, slot: Option<Slot>) {
        let number = id.index() / Self::CHUNK;
        if number >= self.chunks.len() {
            self.chunks.resize_with(number + 1, Box::default);
        }
        let chunk = &mut self.chunks[number];
        if chunk.is_empty() {
            *chunk = Self::chunk();
        }
        chunk[id.index() % Self::CHUNK] = slot.map_or(0, |slot| slot.0 + 1);
    }

    /// Sets the slots of a block that has a group of its own.
    pub(super) fn set_block(&mut self, block: u32, lanes: u16, group: usize) {
        // The first call creates the chunk that contains the whole block.
        let first = PolygonId(block * BLOCK as u32);
        self.set(first, None);
        let chunk = &mut self.chunks[first.index() / Self::CHUNK];
        let slots = &mut chunk[first.index() % Self::CHUNK..][..BLOCK];
        // Without a branch, sixteen slots are computed at once.
        for (lane, slot) in slots.iter_mut().enumerate() {
            *slot = if lanes >> lane & 1 == 1 { Slot::own(group, lane).0 + 1 } else { 0 };
        }
    }

    /// Clears the slots of ids below `end`.
    pub(super) fn clear(&mut self, end: usize) {
        let mut left = end;
        for chunk in &mut self.chunks {
            let here = left.min(chunk.len());
            chunk[..here].fill(0);
            left = left.saturating_sub(Self::CHUNK);
        }
    }

    /// Memory of the list of chunks, bytes; the chunks themselves do not count.
    pub(super) fn bytes(&self) -> usize {
        self.chunks.len() * size_of::<Box<[u32]>>()
    }
}
