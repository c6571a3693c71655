//! Blocks of sixteen ids with the boxes of their polygons, in any order: the storage of the plain list, and of the blocks
//! that move. Groups of sixteen blocks have the boxes around each block, so a query excludes sixteen blocks at once.

use crate::{
    index::simd::Boxes,
    math::Aabb,
    polygon::{BLOCK, bits::bits_of},
};

/// Blocks in any order.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Number of each block, `id / 16`.
    pub(super) numbers: Vec<u32>,
    /// For each block, the mask of its polygons.
    pub(super) lanes: Vec<u16>,
    /// For each block, the boxes of its polygons; unused lanes are unspecified.
    pub(super) boxes: Vec<Boxes<BLOCK>>,
    /// For each group of sixteen blocks, the box around each block. It is out of date if the block is in `changed`.
    around: Vec<Boxes<BLOCK>>,
    /// For each group, the mask of the blocks whose box in `around` is out of date.
    changed: Vec<u16>,
    /// Largest number of blocks so far. The system commits memory only when the memory is written to.
    most: usize,
}

impl Rows {
    /// Empty rows with room for `most` blocks. Only the memory of the first `blocks` is written to.
    pub(super) fn with_room_for(blocks: usize, most: usize) -> Self {
        let groups = blocks.div_ceil(BLOCK);
        let mut rows = Self {
            numbers: vec![0; blocks],
            lanes: vec![0; blocks],
            boxes: vec![Boxes::EMPTY; blocks],
            around: vec![Boxes::EMPTY; groups],
            changed: vec![0; groups],
            most: blocks,
        };
        std::hint::black_box(&mut rows).clear();
        // In a browser, reserved memory counts as used.
        if !cfg!(target_family = "wasm") {
            rows.reserve(most);
        }
        rows
    }

    fn reserve(&mut self, blocks: usize) {
        self.numbers.reserve(blocks);
        self.lanes.reserve(blocks);
        self.boxes.reserve(blocks);
        self.around.reserve(blocks.div_ceil(BLOCK));
        self.changed.reserve(blocks.div_ceil(BLOCK));
    }

    pub(super) fn clear(&mut self) {
        self.numbers.clear();
        self.lanes.clear();
        self.boxes.clear();
        self.around.clear();
        self.changed.clear();
    }

    /// If the rows are empty and once had more than `most` blocks, frees their boxes and reserves the same room again.
    pub(super) fn give_boxes_back(&mut self, most: usize) {
        if self.numbers.is_empty() && self.most > most {
            self.boxes = Vec::with_capacity(self.boxes.capacity());
            self.most = 0;
        }
    }

    /// Memory held, bytes. Room that was never written to does not count, because the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        let groups = self.most.div_ceil(BLOCK);
        self.most * (size_of::<u32>() + size_of::<u16>())
            + groups * size_of::<u16>()
            + (self.most + groups) * size_of::<Boxes<BLOCK>>()
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// The blocks: number, mask of polygons, boxes.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (u32, u16, &Boxes<BLOCK>)> {
        let blocks = self.numbers.iter().zip(&self.lanes).zip(&self.boxes);
        blocks.map(|((&number, &lanes), boxes)| (number, lanes, boxes))
    }

    /// The block at position `at` of [`Rows::blocks`].
    pub(super) fn block(&self, at: usize) -> (u32, u16, &Boxes<BLOCK>) {
        (self.numbers[at], self.lanes[at], &self.boxes[at])
    }

    /// Number of groups of sixteen blocks.
    pub(super) fn groups(&self) -> usize {
        self.around.len()
    }

    /// The boxes around the blocks of a group, and the blocks whose boxes are out of date.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> (&Boxes<BLOCK>, u16) {
        (&self.around[group], self.changed[group])
    }

    /// The boxes around the blocks of a group.
    pub(super) fn around_each(&self, group: usize) -> Boxes<BLOCK> {
        let mut around = self.around[group];
        for lane in bits_of(u64::from(self.changed[group])) {
            around.set(lane, &self.measure(group * BLOCK + lane));
        }
        around
    }

    /// The box around the block at position `at` of [`Rows::blocks`].
    pub(super) fn around(&self, at: usize) -> Aabb {
        let is_changed = self.changed[at / BLOCK] >> (at % BLOCK) & 1 == 1;
        if is_changed { self.measure(at) } else { self.around[at / BLOCK].get(at % BLOCK) }
    }

    fn measure(&self, at: usize) -> Aabb {
        self.boxes[at].around(u32::from(self.lanes[at]))
    }

    /// Adds a block without polygons; returns its position.
    #[inline(never)]
    pub(super) fn push(&mut self, number: u32) -> usize {
        let at = self.len();
        self.most = self.most.max(at + 1);
        self.numbers.push(number);
        self.lanes.push(0);
        self.boxes.push(Boxes::EMPTY);
        if at.is_multiple_of(BLOCK) {
            self.around.push(Boxes::EMPTY);
            self.changed.push(0);
        }
        self.mark_changed(at);
        at
    }

    /// Marks the box around a block as out of date. Returns `false` if it was marked before.
    #[inline(always)]
    pub(super) fn mark_changed(&mut self, at: usize) -> bool {
        let changed = &mut self.changed[at / BLOCK];
        // Without this test, a change of a block would wait for the write of the previous change.
        let is_new = *changed >> (at % BLOCK) & 1 == 0;
        if is_new {
            *changed |= 1 << (at % BLOCK);
        }
        is_new
    }

    /// Removes a block; the last block takes its position.
    pub(super) fn swap_remove(&mut self, at: usize) {
        let last = self.len() - 1;
        self.numbers.swap_remove(at);
        self.lanes.swap_remove(at);
        self.boxes.swap_remove(at);
        self.mark_changed(at);
        self.around[last / BLOCK].set(last % BLOCK, &Aabb::EMPTY);
        self.changed[last / BLOCK] &= !(1 << (last % BLOCK));
        let groups = last.div_ceil(BLOCK);
        self.around.truncate(groups);
        self.changed.truncate(groups);
    }

    /// Computes the boxes around the blocks of a group that have changed; returns their number.
    pub(super) fn refresh(&mut self, group: usize) -> usize {
        let changed = std::mem::take(&mut self.changed[group]);
        for lane in bits_of(u64::from(changed)) {
            let bounds = self.measure(group * BLOCK + lane);
            self.around[group].set(lane, &bounds);
        }
        changed.count_ones() as usize
    }

    /// Checks the invariants; for tests.
    pub(super) fn check(&self) -> Result<(), String> {
        let blocks = self.len();
        let groups = blocks.div_ceil(BLOCK);
        if (self.lanes.len(), self.boxes.len(), self.around.len(), self.changed.len())
            != (blocks, blocks, groups, groups)
        {
            return Err(format!("{blocks} blocks with other numbers of boxes"));
        }
        for (at, (number, lanes, boxes)) in self.blocks().enumerate() {
            let bounds = boxes.around(u32::from(lanes));
            if lanes == 0 {
                return Err(format!("block {number} is empty"));
            }
            if !self.around(at).contains(&bounds) {
                return Err(format!(
                    "the box around block {number} is {:?}, without {bounds:?}",
                    self.around(at)
                ));
            }
        }
        let unused = self.around.last().map_or(Aabb::EMPTY, |last| {
            let used = (1 << ((blocks + BLOCK - 1) % BLOCK + 1)) - 1;
            last.around(0xFFFF & !used)
        });
        if unused != Aabb::EMPTY { Err(format!("{unused:?} is around no block")) } else { Ok(()) }
    }
}
