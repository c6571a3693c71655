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
        simd::{Boxes, Kernel, PlaneSet, PreparedPlane, Wide, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::{BLOCK, PolygonId, bits::bits_of},
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
    /// For each group of sixteen blocks, the box around each block. It is out of date if the block is in `changed`.
    around: Vec<Boxes<BLOCK>>,
    /// For each group, the blocks that have changed since [`Linear::refresh`].
    changed: Vec<u16>,
    is_changed: bool,
    /// Whether `bounds` may be too large.
    is_loose: bool,
    /// Number of commits since a block has changed, and their number before [`Linear::refresh`].
    commits: u32,
    wait: u32,
    /// Largest number of blocks so far. The system commits memory only when the memory is written to.
    most: usize,
    /// Box that contains all polygons.
    bounds: Wide,
}

/// Number of commits after which the boxes around changed blocks are computed. It is more than one, because polygons being
/// drawn change again in the next frame. It is larger if most blocks have changed, because their boxes are soon out of date.
const WAIT: u32 = 4;
const LONG_WAIT: u32 = 64;

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
            changed: vec![0; groups],
            is_changed: false,
            is_loose: false,
            commits: 0,
            wait: WAIT,
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
            linear.changed.reserve(most.div_ceil(BLOCK));
        }
        linear
    }

    pub(super) fn clear(&mut self) {
        self.numbers.clear();
        self.lanes.clear();
        self.boxes.clear();
        self.around.clear();
        self.changed.clear();
        (self.is_changed, self.is_loose) = (false, false);
        (self.highest, self.commits, self.wait, self.bounds) = (0, 0, WAIT, Wide::EMPTY);
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
    pub(super) fn around_each(&self, group: usize) -> Boxes<BLOCK> {
        let mut around = self.around[group];
        for lane in bits_of(u64::from(self.changed[group])) {
            around.set(lane, &self.measure(group * BLOCK + lane));
        }
        around
    }

    /// The box around the block at position `at` of [`Linear::blocks`].
    pub(super) fn around(&self, at: usize) -> Aabb {
        let is_changed = self.changed[at / BLOCK] >> (at % BLOCK) & 1 == 1;
        if is_changed { self.measure(at) } else { self.around[at / BLOCK].get(at % BLOCK) }
    }

    fn measure(&self, at: usize) -> Aabb {
        self.boxes[at].around(u32::from(self.lanes[at]))
    }

    /// Upper bound of all ids.
    pub(super) fn ids_end(&self) -> usize {
        if self.numbers.is_empty() { 0 } else { (self.highest as usize + 1) * BLOCK }
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

    /// Inserts a polygon with a valid box, unless the list would have more than `most` blocks.
    #[inline(always)]
    pub(super) fn insert(&mut self, id: u32, bounds: &Aabb, most: usize) -> Inserted {
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
        self.boxes[at].set(lane, bounds);
        self.bounds = self.bounds.union(Wide::from_box(bounds));
        self.mark_changed(at);
        Inserted::Done
    }

    #[inline(never)]
    fn add_block(&mut self, number: u32) -> usize {
        let at = self.len();
        self.most = self.most.max(at + 1);
        self.numbers.push(number);
        self.highest = self.highest.max(number);
        self.lanes.push(0);
        self.boxes.push(Boxes::EMPTY);
        if at.is_multiple_of(BLOCK) {
            self.around.push(Boxes::EMPTY);
            self.changed.push(0);
        }
        at
    }

    /// Sets a new box of a polygon; returns `false` if it is not in the list or the box is invalid.
    #[inline]
    pub(super) fn update(&mut self, id: u32, bounds: &Aabb) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        let wide = Wide::from_box(bounds);
        if !wide.is_valid() {
            return false;
        }
        self.boxes[at].set(lane, bounds);
        self.bounds = self.bounds.union(wide);
        self.is_loose = true;
        self.mark_changed(at);
        true
    }

    /// Sets new boxes of polygons of one block, in order. Returns `false` at the first polygon that is not in the list or
    /// whose new box is invalid; earlier boxes stay set.
    #[inline]
    pub(super) fn update_block(&mut self, number: u32, updates: &[(PolygonId, Aabb)]) -> bool {
        let Some(at) = self.find(number) else { return false };
        let (there, boxes) = (self.lanes[at], &mut self.boxes[at]);
        let mut is_right = true;
        for (id, bounds) in updates {
            let (lane, wide) = (id.index() % BLOCK, Wide::from_box(bounds));
            is_right = there >> lane & 1 == 1 && wide.is_valid();
            if !is_right {
                break;
            }
            boxes.set(lane, bounds);
            self.bounds = self.bounds.union(wide);
        }
        self.is_loose = true;
        self.mark_changed(at);
        is_right
    }

    /// Removes a polygon; returns `false` if it is not in the list.
    #[inline]
    pub(super) fn remove(&mut self, id: u32) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        self.lanes[at] &= !(1 << lane);
        self.is_loose = true;
        if self.lanes[at] == 0 {
            self.remove_block(at)
        } else {
            self.mark_changed(at)
        }
        true
    }

    #[inline]
    fn mark_changed(&mut self, at: usize) {
        let changed = &mut self.changed[at / BLOCK];
        // Changes of one block would otherwise wait for each other's writes.
        if *changed >> (at % BLOCK) & 1 == 0 {
            *changed |= 1 << (at % BLOCK);
            self.is_changed = true;
        }
    }

    /// Removes an empty block; the last block takes its position.
    fn remove_block(&mut self, at: usize) {
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

    /// Ends a batch of changes. After some commits it computes the boxes around the blocks that have changed.
    #[inline]
    pub(super) fn commit(&mut self) {
        if self.is_changed {
            self.commits += 1;
            if self.commits >= self.wait {
                self.refresh();
            }
        }
    }

    #[inline(never)]
    fn refresh(&mut self) {
        (self.is_changed, self.commits) = (false, 0);
        let mut count = 0;
        for group in 0..self.changed.len() {
            let changed = std::mem::take(&mut self.changed[group]);
            for lane in bits_of(u64::from(changed)) {
                let bounds = self.measure(group * BLOCK + lane);
                self.around[group].set(lane, &bounds);
            }
            count += changed.count_ones() as usize;
        }
        self.wait = if self.is_loose && count > self.len() / 2 { LONG_WAIT } else { WAIT };
        if std::mem::take(&mut self.is_loose) {
            let each = self.around.iter().map(|around| Wide::from_box(&around.around(0xFFFF)));
            self.bounds = each.fold(Wide::EMPTY, Wide::union);
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
        if (self.lanes.len(), self.boxes.len(), self.around.len(), self.changed.len())
            != (blocks, blocks, groups, groups)
        {
            return Err(format!("{blocks} blocks with other numbers of boxes"));
        }
        for (at, (number, lanes, boxes)) in self.blocks().enumerate() {
            let bounds = boxes.around(u32::from(lanes));
            if lanes == 0 || self.find(number) != Some(at) {
                return Err(format!("block {number} is empty or there twice"));
            }
            if !self.bounds.contains(Wide::from_box(&bounds)) {
                return Err(format!("block {number} lies outside the box around everything"));
            }
            if self.around(at) != bounds {
                return Err(format!(
                    "the box around block {number} is {:?}, not {bounds:?}",
                    self.around(at)
                ));
            }
        }
        if !self.is_changed && self.changed.iter().any(|&changed| changed != 0) {
            return Err("a changed block that no commit sees".to_owned());
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
    /// Number of polygons in the list.
    pub(super) polygons: usize,
    pub(super) frustum: &'a Frustum,
    pub(super) answer: A,
}

impl<A: Answer> WithKernel for Pass<'_, A> {
    type Output = (WorkCounts, A::Done);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        // As a local variable the answer stays in registers.
        let Self { linear, polygons, frustum, mut answer } = self;
        let mut work = WorkCounts::default();
        if polygons > 0 {
            let before = answer.count();
            work.nodes = 1;
            let bounds = linear.bounds.to_box();
            let (planes, count) = if linear.len() > FEW {
                // Planes that do not cut the box around everything cut no polygon.
                PlaneSet::new(frustum).cutting(&bounds)
            } else if is_inside(frustum, &bounds) {
                (PlaneSet::new(frustum).planes, 0)
            } else {
                (PlaneSet::new(frustum).planes, 6)
            };
            if count == 0 {
                for (number, lanes, _) in linear.blocks() {
                    answer.run(kernel, number * 16, u32::from(lanes));
                }
            } else {
                let [a, b, c, d, e, _] = planes;
                work.boxes = polygons as u64;
                match count {
                    ..=4 => linear.test_each(kernel, &[a, b, c, d], &mut answer, &mut work),
                    5 => linear.test_each(kernel, &[a, b, c, d, e], &mut answer, &mut work),
                    _ => linear.test_each(kernel, &planes, &mut answer, &mut work),
                }
                work.planes = work.boxes * count as u64;
            }
            (work.boxes, work.planes) = (work.boxes + 1, work.planes + 6);
            work.reported = (answer.count() - before) as u64;
            work.taken_whole = if count == 0 { work.reported } else { 0 };
        }
        (work, answer.finish())
    }
}

/// Whether a box lies wholly on the inner side of every plane; stops at the first plane that it does not pass.
#[inline(always)]
fn is_inside(frustum: &Frustum, bounds: &Aabb) -> bool {
    frustum.planes().iter().all(|plane| plane.signed_distance(plane.negative_vertex(bounds)) >= 0.0)
}

impl Linear {
    /// Tests the polygons of all blocks that are not behind a plane. It does not compute which planes cut a block, because
    /// this costs as much as testing the polygons. It tests the blocks of a group first only if enough blocks lie behind a
    /// plane. Every [`SAMPLE`]th group is tested to estimate this.
    /// `work` counts all polygons beforehand.
    #[inline(always)]
    fn test_each<K: Kernel, A: Answer, const N: usize>(
        &self,
        kernel: K,
        planes: &[PreparedPlane; N],
        answer: &mut A,
        work: &mut WorkCounts,
    ) {
        // The polygons of a long list are scattered, so hardly any block lies behind a plane.
        let is_long = self.numbers.len() > LINEAR_BLOCKS;
        let mut is_worth_it = !is_long && self.numbers.len() > FEW;
        for (group, numbers) in self.numbers.chunks(BLOCK).enumerate() {
            let from = group * BLOCK;
            let to = from + numbers.len();
            let mut behind = 0;
            if is_worth_it || !is_long && group != 0 && group % SAMPLE == 0 {
                work.nodes += 1;
                work.boxes += numbers.len() as u64;
                behind = kernel.behind_any(planes, &self.around[group]) & !u32::from(self.changed[group]);
                is_worth_it = behind.count_ones() >= WORTH_IT;
            }
            let blocks = numbers.iter().zip(&self.lanes[from..to]).zip(&self.boxes[from..to]);
            for (i, ((&number, &lanes), boxes)) in blocks.enumerate() {
                if behind >> i & 1 == 0 {
                    let seen = u32::from(lanes) & !kernel.behind_any(planes, boxes);
                    answer.run(kernel, number * 16, seen);
                } else {
                    work.boxes -= u64::from(lanes.count_ones());
                }
            }
        }
    }
}

/// In a list of at most this number of blocks, polygons are tested without a test of their blocks, except in samples.
const FEW: usize = 32;

/// Every `SAMPLE`th group is always tested for blocks behind a plane.
const SAMPLE: usize = 4;

/// If a group has at least this number of blocks behind a plane, the blocks of the next group are tested, too.
const WORTH_IT: u32 = 3;
