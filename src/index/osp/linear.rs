//! The linear form: a plain list of few blocks. A query reads the mask of every block, and the boxes of blocks
//! that it cannot exclude. If the box around all blocks is
//! inside the frustum, the query tests no polygon. Boxes around the blocks, in groups of sixteen, exclude blocks
//! outside the frustum. Insertions, moves and removals write only one box or mask.

use super::{
    answer::Answer,
    block_table::BlockTable,
    movers::Movers,
    rows::Rows,
    tuning::{LINEAR_BLOCKS, RUN_STRETCH},
};
use crate::{
    index::{
        WorkCounts,
        simd::{Kernel, PlaneSet, PreparedPlane, Wide, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::{BLOCK, PolygonId, bits::bits_of},
};

/// The blocks of the list. A block that becomes empty stays until the commit, because its polygons are often replaced.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    rows: Rows,
    table: BlockTable,
    /// Upper bound of the blocks' numbers.
    highest: u32,
    /// Whether a block has changed since the last round of [`Linear::refresh`] began.
    is_changed: bool,
    /// Whether a polygon was moved or removed since the last round began, so that `bounds` may be too large.
    is_loose: bool,
    /// Whether a block may be empty.
    has_empty: bool,
    /// Number of commits with changes since the last round ended.
    commits: u32,
    /// Value of `commits` at which the next round begins.
    wait: u32,
    /// Box that contains all polygons.
    bounds: Wide,
    round: Round,
}

/// A round of [`Linear::refresh`] over all groups, a few groups in each commit.
#[derive(Clone, Copy, Debug)]
struct Round {
    /// The next group; 0 between two rounds.
    group: usize,
    /// Number of blocks whose boxes this round has computed.
    refreshed: usize,
    /// Whether this round also computes the box around everything.
    is_loose: bool,
    /// If `is_loose`: the box around the finished groups and around all boxes set during this round.
    bounds: Wide,
}

impl Round {
    const NONE: Self = Self { group: 0, refreshed: 0, is_loose: false, bounds: Wide::EMPTY };
}

/// Number of commits with changes before a round computes the boxes around changed blocks. It is more than one, because
/// polygons being drawn change again in the next frame.
const WAIT: u32 = 4;
/// The same number after a round that computed boxes of more than one in [`MANY`] blocks. Such boxes are soon out of date.
const LONG_WAIT: u32 = 64;
const MANY: usize = 8;

/// Number of groups with changed blocks whose boxes a commit computes.
const GROUPS_A_COMMIT: usize = 1;

/// Number of blocks in the sample that decides whether polygons are scattered.
const SAMPLED_BLOCKS: usize = 8;
/// Each sampled polygon is compared with this number of polygons before it, because the ids of strokes that are drawn at
/// the same time alternate.
const COMPARED_BEFORE: usize = 4;

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
        Self {
            rows: Rows::with_room_for(blocks, most),
            table: BlockTable::with_room_for(blocks, most),
            highest: 0,
            is_changed: false,
            is_loose: false,
            has_empty: false,
            commits: 0,
            wait: WAIT,
            bounds: Wide::EMPTY,
            round: Round::NONE,
        }
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.table.clear();
        (self.is_changed, self.is_loose, self.has_empty) = (false, false, false);
        (self.highest, self.commits, self.wait, self.bounds) = (0, 0, WAIT, Wide::EMPTY);
        self.round = Round::NONE;
    }

    /// Moves all blocks to `movers`. Returns `false`, without effect, if `movers` is not empty.
    pub(super) fn move_to(&mut self, movers: &mut Movers) -> bool {
        let is_given = movers.len() == 0;
        if is_given {
            movers.take_rows(&mut self.rows);
            self.clear();
        }
        is_given
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.rows.bytes() + self.table.bytes()
    }

    pub(super) fn rows(&self) -> &Rows {
        &self.rows
    }

    /// The rows, for a swap of empty ones.
    pub(super) fn rows_mut(&mut self) -> &mut Rows {
        &mut self.rows
    }

    /// Whether most polygons of a sample lie apart from the polygons just before them. Returns `false` if the sampled
    /// blocks are less than half full, because the list would be long for its contents.
    pub(super) fn is_scattered(&self) -> bool {
        let (mut polygons, mut apart, mut blocks) = (0, 0, 0);
        for at in (0..self.len()).step_by(self.len().div_ceil(SAMPLED_BLOCKS).max(1)) {
            let (_, lanes, boxes) = self.rows.block(at);
            let is_there = |lane: &usize| lanes >> lane & 1 == 1;
            for lane in (0..BLOCK).filter(is_there) {
                let bounds = Wide::from_box(&boxes.get(lane));
                let mut before = (lane.saturating_sub(COMPARED_BEFORE)..lane).filter(is_there);
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

    /// A box around all polygons.
    pub(super) fn around(&self) -> Aabb {
        self.bounds.to_box()
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Upper bound of all ids.
    pub(super) fn ids_end(&self) -> usize {
        if self.len() == 0 { 0 } else { (self.highest as usize + 1) * BLOCK }
    }

    /// The position of a block.
    #[inline]
    fn find(&self, number: u32) -> Option<usize> {
        let numbers = &self.rows.numbers;
        // Blocks of drawn polygons mostly have consecutive numbers, so this position is tried first.
        let likely = number.wrapping_sub(*numbers.first()?) as usize;
        if numbers.get(likely) == Some(&number) {
            return Some(likely);
        }
        self.table.find(numbers, number)
    }

    /// The position of a polygon's block, and the polygon's lane; `None` if the polygon is not in the list.
    #[inline]
    fn place(&self, id: u32) -> Option<(usize, usize)> {
        let (at, lane) = (self.find(id / 16)?, id as usize % BLOCK);
        (self.rows.lanes[at] >> lane & 1 == 1).then_some((at, lane))
    }

    /// Whether a polygon is in the list.
    pub(super) fn holds(&self, id: u32) -> bool {
        self.place(id).is_some()
    }

    /// The box of a polygon.
    pub(super) fn bounds(&self, id: u32) -> Option<Aabb> {
        self.place(id).map(|(at, lane)| self.rows.boxes[at].get(lane))
    }

    /// Inserts a polygon with a valid box, unless the list would have more than `most` blocks.
    #[inline(always)]
    pub(super) fn insert(&mut self, id: u32, bounds: &Aabb, most: usize) -> Inserted {
        let (number, lane) = (id / 16, id as usize % BLOCK);
        let at = match self.find(number) {
            Some(at) => at,
            None if self.len() >= most && !self.drop_empty() => return Inserted::Full,
            None => self.push(number),
        };
        if self.rows.lanes[at] >> lane & 1 == 1 {
            return Inserted::Present;
        }
        self.rows.lanes[at] |= 1 << lane;
        self.rows.boxes[at].set(lane, bounds);
        self.contain(Wide::from_box(bounds));
        self.mark_changed(at);
        Inserted::Done
    }

    /// Enlarges the box around all polygons, and the box of the current round.
    #[inline(always)]
    fn contain(&mut self, bounds: Wide) {
        self.bounds = self.bounds.union(bounds);
        if self.round.group > 0 {
            self.round.bounds = self.round.bounds.union(bounds);
        }
    }

    fn push(&mut self, number: u32) -> usize {
        self.highest = self.highest.max(number);
        self.is_changed = true;
        self.table.push(number);
        self.rows.push(number)
    }

    /// Sets a new box of a polygon; returns `false` if it is not in the list or the box is invalid.
    #[inline]
    pub(super) fn update(&mut self, id: u32, bounds: &Aabb) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        let wide = Wide::from_box(bounds);
        if !wide.is_valid() {
            return false;
        }
        self.rows.boxes[at].set(lane, bounds);
        self.contain(wide);
        self.is_loose = true;
        self.mark_changed(at);
        true
    }

    /// Sets new boxes in order, up to the first polygon that is not in the list or the first invalid box. Returns the
    /// number of boxes set.
    pub(super) fn update_first(&mut self, updates: &[(PolygonId, Aabb)]) -> usize {
        let (mut all, mut count, mut last) = (Wide::EMPTY, 0, 0);
        // Without a loop for each block, no branch depends on how many polygons of a block move.
        for (id, bounds) in updates {
            let wide = Wide::from_box(bounds);
            let (number, lane) = (id.0 / 16, id.index() % BLOCK);
            let is_last = self.rows.numbers.get(last) == Some(&number);
            let Some(at) = (if is_last { Some(last) } else { self.find(number) }) else { break };
            if self.rows.lanes[at] >> lane & 1 == 0 || !wide.is_valid() {
                break;
            }
            last = at;
            self.rows.boxes[at].set(lane, bounds);
            all = all.union(wide);
            self.mark_changed(at);
            count += 1;
        }
        self.is_loose |= count > 0;
        self.contain(all);
        count
    }

    /// Removes a polygon; returns `false` if it is not in the list.
    #[inline]
    pub(super) fn remove(&mut self, id: u32) -> bool {
        let Some((at, lane)) = self.place(id) else { return false };
        self.rows.lanes[at] &= !(1 << lane);
        self.is_loose = true;
        self.has_empty |= self.rows.lanes[at] == 0;
        self.mark_changed(at);
        true
    }

    /// Removes the empty blocks. Returns whether there were any.
    #[inline(never)]
    fn drop_empty(&mut self) -> bool {
        let before = self.len();
        if std::mem::take(&mut self.has_empty) {
            for at in (0..before).rev() {
                if self.rows.lanes[at] != 0 {
                    continue;
                }
                self.table.swap_remove(&self.rows.numbers, at);
                self.rows.swap_remove(at);
                // The current round would miss the last block, which moves to this position.
                self.round = Round::NONE;
            }
        }
        self.len() < before
    }

    #[inline]
    fn mark_changed(&mut self, at: usize) {
        self.rows.mark_changed(at);
        self.is_changed = true;
    }

    /// Ends a batch of changes. After some commits with changes, a round of [`Linear::refresh`] begins.
    #[inline]
    pub(super) fn commit(&mut self) {
        if self.has_empty {
            self.drop_empty();
        }
        if self.is_changed || self.round.group > 0 {
            self.commits += 1;
            if self.commits >= self.wait {
                self.refresh();
            }
        }
    }

    /// Computes the boxes around the changed blocks of the next groups, and at the end of a round the box around everything.
    #[inline(never)]
    fn refresh(&mut self) {
        if self.round.group == 0 {
            self.round = Round { is_loose: std::mem::take(&mut self.is_loose), ..Round::NONE };
            self.is_changed = false;
        }
        let round = &mut self.round;
        let mut left = GROUPS_A_COMMIT;
        while left > 0 && round.group < self.rows.groups() {
            let count = self.rows.refresh(round.group);
            if round.is_loose {
                let around = self.rows.group(round.group).0.around(0xFFFF);
                round.bounds = round.bounds.union(Wide::from_box(&around));
            }
            round.refreshed += count;
            left -= usize::from(count > 0);
            round.group += 1;
        }
        if round.group == self.rows.groups() {
            (self.wait, self.commits, round.group) = (WAIT, 0, 0);
            if round.is_loose {
                self.bounds = round.bounds;
                if round.refreshed > self.rows.len() / MANY {
                    self.wait = LONG_WAIT;
                }
            }
        }
    }

    /// Checks the invariants; for tests.
    pub(super) fn check(&self, polygons: usize) -> Result<(), String> {
        let counted: usize = self.rows.lanes.iter().map(|lanes| lanes.count_ones() as usize).sum();
        if counted != polygons {
            return Err(format!("{counted} polygons in blocks, {polygons} counted"));
        }
        self.rows.check()?;
        for (at, (number, lanes, boxes)) in self.rows.blocks().enumerate() {
            if self.find(number) != Some(at) || lanes == 0 && !self.has_empty {
                return Err(format!("block {number} is there twice or is empty"));
            }
            if !self.bounds.contains(Wide::from_box(&boxes.around(u32::from(lanes)))) {
                return Err(format!("block {number} lies outside the box around everything"));
            }
        }
        // The current round will examine the groups from `round.group` on, so changes there do not need `is_changed`.
        let unseen = if self.round.group > 0 { self.round.group } else { self.rows.groups() };
        let is_changed = (0..unseen).any(|group| self.rows.group(group).1 != 0);
        if is_changed && !self.is_changed {
            return Err("a changed block that no commit sees".to_owned());
        }
        Ok(())
    }
}

/// The frustum query of the linear form.
pub(super) struct LinearQuery<'a, A> {
    pub(super) linear: &'a Linear,
    /// Number of polygons in the list.
    pub(super) polygons: usize,
    pub(super) frustum: &'a Frustum,
    pub(super) answer: A,
}

impl<A: Answer> WithKernel for LinearQuery<'_, A> {
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
            let (planes, count) = if linear.len() > UNTESTED_BLOCKS {
                // Planes that do not cut the box around everything cut no polygon.
                PlaneSet::new(frustum).cutting(&bounds)
            } else if is_inside(frustum, &bounds) {
                (PlaneSet::new(frustum).planes, 0)
            } else {
                (PlaneSet::new(frustum).planes, 6)
            };
            if count == 0 {
                for (number, lanes, _) in linear.rows.blocks() {
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

/// Whether a box lies wholly on the inner side of every plane; stops at the first plane that excludes this.
#[inline(always)]
fn is_inside(frustum: &Frustum, bounds: &Aabb) -> bool {
    frustum.planes().iter().all(|plane| plane.signed_distance(plane.negative_vertex(bounds)) >= 0.0)
}

impl Linear {
    /// Tests the polygons of all blocks that are not behind a plane. It does not compute which planes cut a block,
    /// because this costs as much as testing the polygons. It tests the blocks of a group first only if enough blocks
    /// lie behind a plane. Every [`SAMPLE`]th group is tested to estimate this. `work.boxes` includes all polygons
    /// beforehand.
    #[inline(always)]
    fn test_each<K: Kernel, A: Answer, const N: usize>(
        &self,
        kernel: K,
        planes: &[PreparedPlane; N],
        answer: &mut A,
        work: &mut WorkCounts,
    ) {
        // The polygons of a long list are scattered, so hardly any block lies behind a plane.
        let rows = &self.rows;
        let is_long = rows.numbers.len() > LINEAR_BLOCKS;
        let mut is_worth_it = !is_long && rows.numbers.len() > UNTESTED_BLOCKS;
        for (group, numbers) in rows.numbers.chunks(BLOCK).enumerate() {
            let from = group * BLOCK;
            let to = from + numbers.len();
            let mut behind = 0;
            if is_worth_it || !is_long && group != 0 && group % SAMPLE == 0 {
                work.nodes += 1;
                work.boxes += numbers.len() as u64;
                let (around, changed) = rows.group(group);
                behind = kernel.behind_any(planes, around) & !u32::from(changed);
                is_worth_it = behind.count_ones() >= LEAST_BEHIND;
            }
            let (lanes, boxes) = (&rows.lanes[from..to], &rows.boxes[from..to]);
            let there = !(u32::MAX << numbers.len());
            if behind & there == 0 {
                for ((&number, &lanes), boxes) in numbers.iter().zip(lanes).zip(boxes) {
                    let seen = u32::from(lanes) & !kernel.behind_any(planes, boxes);
                    answer.run(kernel, number * 16, seen);
                }
                continue;
            }
            // A loop over bits has fewer branches that depend on the view than a test of each block.
            work.boxes -=
                bits_of((behind & there).into()).map(|i| u64::from(lanes[i].count_ones())).sum::<u64>();
            for i in bits_of((there & !behind).into()) {
                let seen = u32::from(lanes[i]) & !kernel.behind_any(planes, &boxes[i]);
                answer.run(kernel, numbers[i] * 16, seen);
            }
        }
    }
}

/// In a list of at most this number of blocks, polygons are tested without a test of their blocks, except in samples.
const UNTESTED_BLOCKS: usize = 32;

/// Every `SAMPLE`th group is always tested for blocks behind a plane.
const SAMPLE: usize = 4;

/// If a group has at least this number of blocks behind a plane, the blocks of the next group are tested, too.
const LEAST_BEHIND: u32 = 3;
