//! The linear form: a plain list of few blocks, which every query passes over completely. If the box around all blocks is
//! inside the frustum, the query tests no polygon. Boxes around the blocks, in groups of sixteen, exclude blocks outside
//! the frustum. Insertion, movement and removal write a box, and build nothing.

use super::{
    answer::Answer,
    movers::Movers,
    tuning::{LINEAR_BLOCKS, RUN_STRETCH},
};
use crate::{
    index::{
        WorkCounts,
        simd::{Boxes, Kernel, PlaneSet, Wide, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::{BLOCK, PolygonId},
};

/// A list of blocks of sixteen ids with the boxes of their polygons, in any order. No block is empty.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    /// Number of each block, `id / 16`.
    numbers: Vec<u32>,
    /// Upper bound of `numbers`.
    highest: u32,
    /// For each block, the mask of its polygons.
    lanes: Vec<u16>,
    /// For each block, the boxes of its polygons; unused lanes are unspecified.
    boxes: Vec<Boxes<BLOCK>>,
    /// For each group of sixteen blocks, the box around each block.
    around: Vec<Boxes<BLOCK>>,
    /// For each group, the blocks whose box may be too large.
    loose: Vec<u16>,
    is_loose: bool,
    /// Number of commits since a box may be too large.
    commits: u32,
    /// Largest number of blocks so far. The system commits memory only when the memory is written to.
    most: usize,
    /// Box around all polygons; it is too large if the boxes of blocks are.
    bounds: Wide,
}

/// Number of commits after which boxes are tightened. It is more than one, because polygons being drawn change again in the
/// next frame.
const COMMITS_BETWEEN: u32 = 16;

/// Number of blocks in the sample that decides whether polygons are scattered. Each sampled polygon is compared with the
/// `BEFORE` polygons before it, because strokes that are drawn at the same time take turns.
const ASKED: usize = 8;
const BEFORE: usize = 4;

/// Result of an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inserted {
    Done,
    /// The polygon is already in the list.
    Present,
    /// The polygon needs a new block, and the list is full.
    Full,
}

impl Linear {
    /// An empty list with room for `blocks` blocks, and for `most` if their polygons are scattered. The memory of the first
    /// `blocks` is written to here, so that no frame waits until the system commits it.
    pub(super) fn with_room_for(blocks: usize, most: usize) -> Self {
        let groups = blocks.div_ceil(BLOCK);
        let mut linear = Self {
            numbers: vec![0; blocks],
            highest: 0,
            lanes: vec![0; blocks],
            boxes: vec![Boxes::EMPTY; blocks],
            around: vec![Boxes::EMPTY; groups],
            loose: vec![0; groups],
            is_loose: false,
            commits: 0,
            most: blocks,
            bounds: Wide::EMPTY,
        };
        std::hint::black_box(&mut linear).clear();
        // In a browser, reserved memory counts as used.
        if !cfg!(target_family = "wasm") {
            linear.numbers.reserve(most);
            linear.lanes.reserve(most);
            linear.boxes.reserve(most);
            linear.around.reserve(most.div_ceil(BLOCK));
            linear.loose.reserve(most.div_ceil(BLOCK));
        }
        linear
    }

    pub(super) fn clear(&mut self) {
        self.numbers.clear();
        self.lanes.clear();
        self.boxes.clear();
        self.around.clear();
        self.loose.clear();
        (self.highest, self.is_loose, self.commits, self.bounds) = (0, false, 0, Wide::EMPTY);
    }

    /// Moves all blocks to the flat rows beside the tree. Returns `false` if the rows are not empty.
    pub(super) fn give_to(&mut self, movers: &mut Movers) -> bool {
        let is_given = movers.len() == 0;
        if is_given {
            self.most = movers.take_blocks(&mut self.numbers, &mut self.lanes, &mut self.boxes);
            self.clear();
        }
        is_given
    }

    /// Whether most polygons of a sample lie apart from the polygons just before them. Returns `false` if the sampled
    /// blocks are less than half full, because the list would be long for its contents.
    pub(super) fn is_scattered(&self) -> bool {
        let (mut polygons, mut apart, mut blocks) = (0, 0, 0);
        for at in (0..self.len()).step_by(self.len().div_ceil(ASKED).max(1)) {
            let (boxes, lanes) = (&self.boxes[at], self.lanes[at]);
            let is_there = |lane: &usize| lanes >> lane & 1 == 1;
            for lane in (0..BLOCK).filter(is_there) {
                let bounds = Wide::from_box(&boxes.get(lane));
                let mut before = (lane.saturating_sub(BEFORE)..lane).filter(is_there);
                let is_beside = before.any(|lane| {
                    let other = Wide::from_box(&boxes.get(lane));
                    bounds.union(other).length() <= (bounds.length() + other.length()) * RUN_STRETCH
                });
                (polygons, apart) = (polygons + 1, apart + usize::from(!is_beside));
            }
            blocks += 1;
        }
        2 * apart > polygons && 2 * polygons >= blocks * BLOCK
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

    /// Number of groups of sixteen blocks.
    pub(super) fn groups(&self) -> usize {
        self.around.len()
    }

    /// The block at position `at` of [`Linear::blocks`].
    pub(super) fn block(&self, at: usize) -> (u32, u16, &Boxes<BLOCK>) {
        (self.numbers[at], self.lanes[at], &self.boxes[at])
    }

    /// The boxes around the blocks of a group.
    pub(super) fn around_each(&self, group: usize) -> &Boxes<BLOCK> {
        &self.around[group]
    }

    /// The box around the block at position `at` of [`Linear::blocks`].
    pub(super) fn around(&self, at: usize) -> Aabb {
        self.around[at / BLOCK].get(at % BLOCK)
    }

    /// Upper bound of all ids.
    pub(super) fn ids_end(&self) -> usize {
        self.numbers.iter().max().map_or(0, |&last| (last as usize + 1) * BLOCK)
    }

    /// Memory held, bytes. Room that was never written to does not count, because the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        let groups = self.most.div_ceil(BLOCK);
        self.most * (size_of::<u32>() + size_of::<u16>())
            + groups * size_of::<u16>()
            + (self.most + groups) * size_of::<Boxes<BLOCK>>()
    }

    /// The position of a block.
    #[inline]
    fn find(&self, number: u32) -> Option<usize> {
        // The guess is that blocks have consecutive numbers, because drawn polygons have.
        let likely = number.wrapping_sub(*self.numbers.first()?) as usize;
        if self.numbers.get(likely) == Some(&number) {
            return Some(likely);
        }
        if number > self.highest {
            return None;
        }
        self.numbers.iter().rposition(|&other| other == number)
    }

    /// The position of a polygon's block, and the polygon's lane; `None` if the polygon is not in the list.
    #[inline]
    fn place(&self, id: u32) -> Option<(usize, usize)> {
        let (at, lane) = (self.find(id / 16)?, id as usize % BLOCK);
        (self.lanes[at] >> lane & 1 == 1).then_some((at, lane))
    }

    /// Whether a polygon is in the list.
    pub(super) fn holds(&self, id: u32) -> bool {
        self.place(id).is_some()
    }

    /// The box of a polygon.
    pub(super) fn bounds(&self, id: u32) -> Option<Aabb> {
        self.place(id).map(|(at, lane)| self.boxes[at].get(lane))
    }

    /// Inserts a polygon, unless the list would have more than `most` blocks.
    #[inline]
    pub(super) fn insert(&mut self, id: u32, bounds: Wide, most: usize) -> Inserted {
        let (number, lane) = (id / 16, id as usize % BLOCK);
        let at = match self.find(number) {
            Some(at) => at,
            None if self.len() >= most => return Inserted::Full,
            None => self.add_block(number),
        };
        if self.lanes[at] >> lane & 1 == 1 {
            return Inserted::Present;
        }
        self.lanes[at] |= 1 << lane;
        self.boxes[at].set_wide(lane, bounds);
        self.widen(at, &bounds.to_box());
        Inserted::Done
    }

    fn add_block(&mut self, number: u32) -> usize {
        let at = self.len();
        self.most = self.most.max(at + 1);
        self.numbers.push(number);
        self.highest = self.highest.max(number);
        self.lanes.push(0);
        self.boxes.push(Boxes::EMPTY);
        if at.is_multiple_of(BLOCK) {
            self.around.push(Boxes::EMPTY);
            self.loose.push(0);
        }
        at
    }

    /// Sets a new box of a polygon; returns `false` if it is not in the list or the box is invalid.
    #[inline]
    pub(super) fn update(&mut self, id: u32, bounds: &Aabb) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        if !Wide::from_box(bounds).is_valid() {
            return false;
        }
        self.boxes[at].set(lane, bounds);
        self.widen(at, bounds);
        self.mark_loose(at);
        true
    }

    /// Sets new boxes of polygons of one block, in order. Returns `false` at the first polygon that is not in the list or
    /// whose new box is invalid; earlier boxes stay set.
    #[inline]
    pub(super) fn update_block(&mut self, number: u32, updates: &[(PolygonId, Aabb)]) -> bool {
        let Some(at) = self.find(number) else { return false };
        let (there, boxes) = (self.lanes[at], &mut self.boxes[at]);
        let mut around = Wide::EMPTY;
        let mut is_right = true;
        for (id, bounds) in updates {
            let (lane, wide) = (id.index() % BLOCK, Wide::from_box(bounds));
            is_right = there >> lane & 1 == 1 && wide.is_valid();
            if !is_right {
                break;
            }
            boxes.set(lane, bounds);
            around = around.union(wide);
        }
        if around != Wide::EMPTY {
            self.widen(at, &around.to_box());
            self.mark_loose(at);
        }
        is_right
    }

    /// Removes a polygon; returns `false` if it is not in the list.
    #[inline]
    pub(super) fn remove(&mut self, id: u32) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        self.lanes[at] &= !(1 << lane);
        if self.lanes[at] == 0 {
            self.remove_block(at)
        } else {
            self.mark_loose(at)
        }
        true
    }

    /// Widens the boxes around a block so that they contain `bounds`.
    #[inline]
    fn widen(&mut self, at: usize, bounds: &Aabb) {
        // The box around everything contains the box around each block.
        if self.around[at / BLOCK].widen(at % BLOCK, bounds) {
            self.bounds = self.bounds.union(Wide::from_box(bounds));
        }
    }

    #[inline]
    fn mark_loose(&mut self, at: usize) {
        let loose = &mut self.loose[at / BLOCK];
        // Updates of one block would otherwise wait for each other's writes.
        if *loose >> (at % BLOCK) & 1 == 0 {
            *loose |= 1 << (at % BLOCK);
            self.is_loose = true;
        }
    }

    /// Removes an empty block; the last block takes its position.
    fn remove_block(&mut self, at: usize) {
        let last = self.len() - 1;
        self.numbers.swap_remove(at);
        self.lanes.swap_remove(at);
        self.boxes.swap_remove(at);
        let bounds = self.around(last);
        self.around[at / BLOCK].set(at % BLOCK, &bounds);
        if self.loose[last / BLOCK] >> (last % BLOCK) & 1 == 1 {
            self.mark_loose(at);
        }
        self.around[last / BLOCK].set(last % BLOCK, &Aabb::EMPTY);
        self.loose[last / BLOCK] &= !(1 << (last % BLOCK));
        let groups = last.div_ceil(BLOCK);
        self.around.truncate(groups);
        self.loose.truncate(groups);
        self.is_loose = true;
    }

    /// Ends a batch of changes. Every [`COMMITS_BETWEEN`] commits it tightens the boxes of blocks that have lost a polygon.
    #[inline]
    pub(super) fn commit(&mut self) {
        if self.is_loose {
            self.commits += 1;
            if self.commits >= COMMITS_BETWEEN {
                self.tighten();
            }
        }
    }

    #[inline(never)]
    fn tighten(&mut self) {
        (self.is_loose, self.commits, self.bounds) = (false, 0, Wide::EMPTY);
        for (group, loose) in self.loose.iter_mut().enumerate() {
            let mut left = std::mem::take(loose);
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let at = group * BLOCK + lane;
                // `at` exists, because removing a block clears its bit.
                self.around[group].set(lane, &self.boxes[at].around(u32::from(self.lanes[at])));
            }
            self.bounds = self.bounds.union(Wide::from_box(&self.around[group].around(0xFFFF)));
        }
    }

    /// Checks the invariants; for tests.
    pub(super) fn check(&self, polygons: usize) -> Result<(), String> {
        let counted: usize = self.lanes.iter().map(|lanes| lanes.count_ones() as usize).sum();
        if counted != polygons {
            return Err(format!("{counted} polygons in blocks, {polygons} counted"));
        }
        let blocks = self.len();
        let groups = blocks.div_ceil(BLOCK);
        if (self.lanes.len(), self.boxes.len(), self.around.len(), self.loose.len())
            != (blocks, blocks, groups, groups)
        {
            return Err(format!("{blocks} blocks with other numbers of boxes"));
        }
        for (at, (number, lanes, boxes)) in self.blocks().enumerate() {
            let bounds = boxes.around(u32::from(lanes));
            let loose = self.loose[at / BLOCK] >> (at % BLOCK) & 1 == 1;
            let around = self.around(at);
            if lanes == 0 || self.find(number) != Some(at) {
                return Err(format!("block {number} is empty or there twice"));
            }
            if !self.bounds.contains(Wide::from_box(&bounds)) {
                return Err(format!("block {number} lies outside the box around everything"));
            }
            if !(around == bounds || loose && self.is_loose && around.contains(&bounds)) {
                return Err(format!("the box around block {number} is {around:?}, not {bounds:?}"));
            }
        }
        let unused = self.around.last().map_or(Aabb::EMPTY, |last| {
            let used = (1 << ((blocks + BLOCK - 1) % BLOCK + 1)) - 1;
            last.around(0xFFFF & !used)
        });
        if unused != Aabb::EMPTY { Err(format!("{unused:?} is around no block")) } else { Ok(()) }
    }
}

/// The frustum query of the linear form.
pub(super) struct Pass<'a, A> {
    pub(super) linear: &'a Linear,
    pub(super) frustum: &'a Frustum,
    pub(super) answer: A,
}

impl<A: Answer> WithKernel for Pass<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> Self::Output {
        let mut work = WorkCounts::default();
        if !self.linear.numbers.is_empty() {
            let before = self.answer.count();
            (work.nodes, work.boxes) = (1, 1);
            let is_inside = is_inside(self.frustum, &self.linear.bounds.to_box());
            if is_inside {
                self.all(kernel)
            } else {
                self.each(kernel, &mut work)
            }
            work.planes = work.boxes * 6;
            work.reported = (self.answer.count() - before) as u64;
            work.taken_whole = if is_inside { work.reported } else { 0 };
        }
        (work, self.answer.finish())
    }
}

/// Whether a box lies wholly on the inner side of every plane; stops at the first plane that it does not pass.
#[inline(always)]
fn is_inside(frustum: &Frustum, bounds: &Aabb) -> bool {
    frustum.planes().iter().all(|plane| plane.signed_distance(plane.negative_vertex(bounds)) >= 0.0)
}

impl<A: Answer> Pass<'_, A> {
    /// Takes all blocks without a test.
    #[inline(always)]
    fn all<K: Kernel>(&mut self, kernel: K) {
        for (number, lanes, _) in self.linear.blocks() {
            self.answer.run(kernel, number * 16, u32::from(lanes));
        }
    }

    /// Tests the polygons of all blocks that are not behind a plane. It does not compute which planes cut a block, because
    /// this costs as much as testing the polygons. It tests the blocks of a group first only if enough blocks lie behind a
    /// plane. Every [`SAMPLE`]th group is tested to estimate this.
    #[inline(always)]
    fn each<K: Kernel>(&mut self, kernel: K, work: &mut WorkCounts) {
        let planes = PlaneSet::new(self.frustum);
        let Linear { numbers, lanes, boxes, around, .. } = self.linear;
        let mut tested = 0;
        if numbers.len() > LINEAR_BLOCKS {
            // The polygons of a long list are scattered, so hardly any block lies behind a plane.
            for ((&number, &lanes), boxes) in numbers.iter().zip(lanes).zip(boxes) {
                tested += self.look(kernel, &planes, number, lanes, boxes);
            }
            work.boxes += u64::from(tested);
            return;
        }
        let mut is_worth_it = numbers.len() > FEW;
        for (group, around) in around.iter().enumerate() {
            let from = group * BLOCK;
            let to = (from + BLOCK).min(numbers.len());
            let (numbers, lanes, boxes) = (&numbers[from..to], &lanes[from..to], &boxes[from..to]);
            let blocks = numbers.iter().zip(lanes).zip(boxes);
            if !is_worth_it && (group % SAMPLE != 0 || group == 0) {
                for ((&number, &lanes), boxes) in blocks {
                    tested += self.look(kernel, &planes, number, lanes, boxes);
                }
                continue;
            }
            work.nodes += 1;
            work.boxes += numbers.len() as u64;
            let behind = planes.behind_any(kernel, around);
            is_worth_it = behind.count_ones() >= WORTH_IT;
            for (i, ((&number, &lanes), boxes)) in blocks.enumerate() {
                if behind >> i & 1 == 0 {
                    tested += self.look(kernel, &planes, number, lanes, boxes);
                }
            }
        }
        work.boxes += u64::from(tested);
    }

    /// Tests the polygons of a block; returns their number. This is a method, because a closure would not be compiled for
    /// the kernel's instruction set.
    #[inline(always)]
    fn look<K: Kernel>(
        &mut self,
        kernel: K,
        planes: &PlaneSet,
        number: u32,
        lanes: u16,
        boxes: &Boxes<BLOCK>,
    ) -> u32 {
        let lanes = u32::from(lanes);
        self.answer.run(kernel, number * 16, lanes & !planes.behind_any(kernel, boxes));
        lanes.count_ones()
    }
}

/// In a list of at most this number of blocks, polygons are tested without a test of their blocks, except in samples.
const FEW: usize = 32;

/// Every `SAMPLE`th group is always tested for blocks behind a plane.
const SAMPLE: usize = 4;

/// If a group has at least this number of blocks behind a plane, the blocks of the next group are tested, too.
const WORTH_IT: u32 = 3;
