//! Blocks of sixteen ids with the boxes of their polygons, in any order: the storage of the plain list, and of moving
//! blocks. Sixteen blocks form a group. The boxes around the blocks of a group are stored together, so that a query
//! tests sixteen blocks at once.

use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
    polygon::{BLOCK, PolygonId, bits::bits_of},
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
    /// For each group, 1 for each block whose box in `around` is out of date. A change only writes a byte, and does not
    /// wait for the write of the change before.
    changed: Vec<[u8; BLOCK]>,
    /// Largest number of blocks so far, for [`Rows::bytes`]. The system has not committed the memory of further blocks.
    most: usize,
    round: Round,
    /// Whether most blocks were narrow in the last round.
    are_narrow: bool,
}

/// A round of [`Rows::refresh_some`] over all groups.
#[derive(Clone, Copy, Debug)]
struct Round {
    /// The next group.
    group: usize,
    /// Number of blocks whose boxes this round has computed.
    measured: usize,
    /// Number of these blocks that are at most half as long as `bounds`.
    narrow: usize,
    /// The box around the blocks measured in this round.
    bounds: Wide,
    /// Number of commits until the round begins.
    pause: u32,
    /// Whether the round begins without a pause, so that blocks may be unchanged.
    follows: bool,
}

impl Round {
    const NONE: Self =
        Self { group: 0, measured: 0, narrow: 0, bounds: Wide::EMPTY, pause: 0, follows: false };
}

/// Number of commits of a round. If it is larger, more blocks have changed since they were measured, so that queries
/// test their polygons one by one.
const ROUND: usize = 16;

/// Number of commits without a round after a round that had no effect.
const PAUSE: u32 = 64;

impl Rows {
    /// Empty rows with room for `most` blocks. Only the memory of the first `blocks` is written to.
    pub(super) fn with_room_for(blocks: usize, most: usize) -> Self {
        let groups = blocks.div_ceil(BLOCK);
        let mut rows = Self {
            numbers: vec![0; blocks],
            lanes: vec![0; blocks],
            boxes: vec![Boxes::EMPTY; blocks],
            around: vec![Boxes::EMPTY; groups],
            changed: vec![[0; BLOCK]; groups],
            most: blocks,
            round: Round::NONE,
            are_narrow: false,
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
        (self.round, self.are_narrow) = (Round::NONE, false);
    }

    /// Memory held, bytes. Room that was never written to does not count, because the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        let groups = self.most.div_ceil(BLOCK);
        self.most * (size_of::<u32>() + size_of::<u16>())
            + groups * BLOCK
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

    /// Whether the boxes around most blocks are small, as those of drawn strokes.
    #[inline(always)]
    pub(super) fn are_narrow(&self) -> bool {
        self.are_narrow
    }

    /// Number of groups of sixteen blocks.
    pub(super) fn groups(&self) -> usize {
        self.around.len()
    }

    /// The boxes around the blocks of a group, and the blocks whose boxes are out of date.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> (&Boxes<BLOCK>, u16) {
        (&self.around[group], self.changed(group))
    }

    /// The up-to-date boxes around the blocks of a group.
    pub(super) fn around_each(&self, group: usize) -> Boxes<BLOCK> {
        let mut around = self.around[group];
        for lane in bits_of(u64::from(self.changed(group))) {
            around.set(lane, &self.measure(group * BLOCK + lane));
        }
        around
    }

    /// The box around the block at position `at` of [`Rows::blocks`].
    pub(super) fn around(&self, at: usize) -> Aabb {
        if self.changed[at / BLOCK][at % BLOCK] == 1 {
            self.measure(at)
        } else {
            self.around[at / BLOCK].get(at % BLOCK)
        }
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
            self.changed.push([0; BLOCK]);
        }
        self.mark_changed(at);
        at
    }

    /// The blocks of a group whose boxes in `around` are out of date.
    #[inline(always)]
    fn changed(&self, group: usize) -> u16 {
        // The product moves the lowest bit of each byte to the highest byte.
        let eight = |bytes: u64| bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56;
        let bytes = u128::from_le_bytes(self.changed[group]);
        (eight(bytes as u64) | eight((bytes >> 64) as u64) << 8) as u16
    }

    /// Marks the box around a block as out of date.
    #[inline(always)]
    pub(super) fn mark_changed(&mut self, at: usize) {
        self.changed[at / BLOCK][at % BLOCK] = 1;
    }

    /// Sets new boxes of polygons of a block, up to the first polygon that is not in it or the first invalid box. Returns
    /// the mask of the lanes and the number of the boxes set. The loop is in a function of its own, so that its variables
    /// stay in registers.
    #[inline(never)]
    pub(super) fn set_first(&mut self, at: usize, updates: &[(PolygonId, Aabb)]) -> (u16, usize) {
        let (there, number, boxes) = (self.lanes[at], self.numbers[at], &mut self.boxes[at]);
        let (mut moved, mut count) = (0, 0);
        for (id, bounds) in updates {
            let lane = id.index() % BLOCK;
            let is_there = id.0 / BLOCK as u32 == number && there >> lane & 1 == 1;
            if !(is_there && Wide::from_box(bounds).is_valid()) {
                break;
            }
            boxes.set(lane, bounds);
            moved |= 1 << lane;
            count += 1;
        }
        self.mark_changed(at);
        (moved, count)
    }

    /// For each block: the mask of its polygons, their boxes, and whether the box around it is out of date.
    pub(super) fn columns(&mut self) -> (&[u16], &mut [Boxes<BLOCK>], &mut [u8]) {
        (&self.lanes, &mut self.boxes, self.changed.as_flattened_mut())
    }

    /// Removes a block; the last block moves to its position.
    pub(super) fn swap_remove(&mut self, at: usize) {
        let last = self.len() - 1;
        self.numbers.swap_remove(at);
        self.lanes.swap_remove(at);
        self.boxes.swap_remove(at);
        self.mark_changed(at);
        self.around[last / BLOCK].set(last % BLOCK, &Aabb::EMPTY);
        self.changed[last / BLOCK][last % BLOCK] = 0;
        let groups = last.div_ceil(BLOCK);
        self.around.truncate(groups);
        self.changed.truncate(groups);
    }

    /// Computes the boxes around the changed blocks of a group; returns the number of these blocks.
    pub(super) fn refresh(&mut self, group: usize) -> usize {
        let changed = self.changed(group);
        for lane in bits_of(u64::from(changed)) {
            let bounds = self.measure(group * BLOCK + lane);
            self.around[group].set(lane, &bounds);
        }
        self.changed[group] = [0; BLOCK];
        changed.count_ones() as usize
    }

    /// Computes the boxes around the changed blocks of some groups. Pauses after a round if nearly all blocks had
    /// changed, or if most blocks are not narrow.
    pub(super) fn refresh_some(&mut self) {
        if self.round.pause > 0 {
            self.round.pause -= 1;
            return;
        }
        for _ in 0..self.groups().div_ceil(ROUND) {
            let Round { group, measured, narrow, mut bounds, follows, .. } = self.round;
            if group >= self.groups() {
                let is_rested = !follows || 2 * measured < self.len();
                self.are_narrow = 4 * narrow >= measured;
                let follows = is_rested && self.are_narrow;
                self.round = Round { pause: if follows { 0 } else { PAUSE }, follows, ..Round::NONE };
                return;
            }
            let changed = self.changed(group);
            for lane in bits_of(u64::from(changed)) {
                let around = self.measure(group * BLOCK + lane);
                bounds = bounds.union(Wide::from_box(&around));
                if 2.0 * Wide::from_box(&around).length() < bounds.length() {
                    self.around[group].set(lane, &around);
                    self.changed[group][lane] = 0;
                    self.round.narrow += 1;
                }
            }
            self.round.measured += changed.count_ones() as usize;
            (self.round.group, self.round.bounds) = (group + 1, bounds);
        }
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
