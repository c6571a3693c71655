//! Decides which polygons the tree holds.
//!
//! ```text
//! inserted ─> unfiled ──the block has not changed for some commits──> filed
//!                ^ ^───────────────a new box of one polygon────────────┘ │
//!                └──────many changes: all at once, until few change──────┘
//! ```
//!
//! Single blocks are filed only while queries would use the tree: filing doubles the time of an insertion. Unfiled
//! polygons are answered by the walk in the order of the ids (`in_order.rs`). A new box is a write and a mark.

use std::{
    collections::VecDeque,
    mem,
    sync::atomic::{AtomicU8, Ordering::Relaxed},
};

use super::{index::Osp, shelf::GROUPS, store::At};
use crate::{index::simd::lanes_of, math::Aabb, polygon::PolygonId};

/// Number of commits between two examinations of a block. With fewer commits, the pieces of a stroke that is being drawn
/// are filed and taken out again.
const WAIT: u32 = 32;

/// If a commit ends a batch of at least this many insertions, it files the blocks of this batch. An import is then paid by
/// its own commit.
const BATCH: u32 = 1024;

/// A commit files at least this number of runs, two for each insertion, and one for every [`RUNS_SHARE`] unfiled
/// polygons. So it takes at most a third longer than the walk over the unfiled polygons.
const RUNS_A_COMMIT: u32 = 8;
const RUNS_SHARE: usize = 500;

/// Factor by which a commit without insertions files more runs.
const IDLE: u32 = 2;

/// An edit of the tree, such as taking a polygon out, takes about as long as a test of this number of boxes. Up to one
/// edit a commit for so many polygons is few. The first [`SMALL`] polygons do not count, because a tree of few is hardly
/// faster than a walk over all. A hand that draws causes two or three edits a commit, which must be few.
const POLYGONS_AN_EDIT: usize = 1024;
const FEW_EDITS: u32 = 6;
const SMALL: usize = 4096;

/// All polygons leave the tree when the excess of edits reaches this multiple of the few edits. A commit counts with at
/// most [`MOST_OF_COMMIT`] times the edits that are few, so a single commit with many edits has little effect.
const MANY: u32 = 96;
const MOST_OF_COMMIT: u32 = 16;

/// All polygons leave the tree at once if a commit takes out more than one in this number.
const MOST: usize = 8;
/// The smallest tree for which this holds, in polygons.
const LEAST: usize = 1024;
/// Number of updates in the sample of a batch.
const SAMPLE: usize = 64;

/// Number of commits of a trial: twice [`WAIT`], so that each block is examined twice.
const TRIAL: u32 = 2 * WAIT;
/// Longest time without a tree before a trial may end it, in commits.
const LONGEST_PAUSE: u32 = 2048;
/// A pause is recent for this many times its length.
const NOT_LONG_AGO: u32 = 16;

/// After this number of commits with queries that would not use the tree, single blocks are not filed.
const UNWANTED_AFTER: u32 = 1024;

/// Before the first commit, by more than any pause.
const LONG_AGO: u32 = 1 << 31;

/// A block that waits for its next examination.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    block: u32,
    since: u32,
}

/// Whether queries since the last commit would use the tree; queries set it, on any thread.
#[derive(Debug, Default)]
pub(super) struct Demand(AtomicU8);

impl Demand {
    /// Without the tree is as good.
    pub(super) const NO: u8 = 1;
    pub(super) const YES: u8 = 2;

    #[inline]
    pub(super) fn note(&self, answer: u8) {
        if self.0.load(Relaxed) < answer {
            self.0.fetch_max(answer, Relaxed);
        }
    }
}

impl Clone for Demand {
    fn clone(&self) -> Self {
        Self(AtomicU8::new(self.0.load(Relaxed)))
    }
}

#[derive(Clone, Debug)]
pub(super) struct Residence {
    waiting: VecDeque<Waiting>,
    /// Number of polygons inserted since the last commit.
    pub(super) inserted: u32,
    /// Quarters of edits since the last commit. Taking a polygon out of a run of several is a quarter.
    quarters: u32,
    /// Sum of the edits beyond those that are few, in the last commits.
    excess: u32,
    /// Whether the model is so large that queries may use the tree.
    is_large: bool,
    /// Whether queries since the last commit would use the tree, and the number of commits since one would.
    pub(super) demand: Demand,
    unwanted: u32,
    /// Whether blocks that rest are filed: the model is large, and queries of late would use the tree.
    pub(super) is_tree_needed: bool,
    /// Whether no polygon is filed, because many change.
    is_paused: bool,
    /// The commit in which the pause began, and its least length.
    since: u32,
    pause: u32,
    /// During a pause: number of blocks that rest, and quarters of edits that a tree would have had in this trial.
    resting: usize,
    trial: u32,
    /// Whether each commit files all polygons.
    pub(super) is_eager: bool,
}

/// Largest number of edits of a commit that are few, for this number of polygons.
fn few_edits(polygons: usize) -> u32 {
    FEW_EDITS.max((polygons.saturating_sub(SMALL) / POLYGONS_AN_EDIT) as u32)
}

impl Residence {
    /// With room for `blocks` blocks.
    pub(super) fn with_room_for(blocks: usize) -> Self {
        Self {
            waiting: VecDeque::with_capacity(blocks),
            inserted: 0,
            quarters: 0,
            excess: 0,
            is_large: false,
            demand: Demand::default(),
            unwanted: 0,
            is_tree_needed: false,
            is_paused: false,
            since: LONG_AGO,
            pause: TRIAL,
            resting: 0,
            trial: 0,
            is_eager: false,
        }
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        let (waiting, is_eager) = (mem::take(&mut self.waiting), self.is_eager);
        *self = Self { waiting, is_eager, ..Self::with_room_for(0) };
    }

    pub(super) fn bytes(&self) -> usize {
        self.waiting.capacity() * size_of::<Waiting>()
    }
}

impl Osp {
    /// Lets a block wait for an examination, unless it does.
    #[inline(always)]
    pub(super) fn wait(&mut self, at: At, block: u32) {
        let waiting = &mut self.store.shelf_mut(at.shelf).waiting[at.block / 16];
        let bit = 1 << (at.block % 16);
        if *waiting & bit == 0 {
            *waiting |= bit;
            self.residence.waiting.push_back(Waiting { block, since: self.clock });
        }
    }

    /// Takes the polygons `lanes` of a block, which are filed, out of the tree.
    pub(super) fn take_out(&mut self, block: u32, lanes: u16) {
        let most = self.store.filed() / MOST;
        for lane in lanes_of(lanes) {
            if self.store.filed() >= LEAST && self.residence.quarters as usize / 4 > most {
                self.pause();
                return;
            }
            let was_alone = self.remove_from_run(block * 16 + lane as u32);
            self.residence.quarters += if was_alone { 4 } else { 1 };
            self.removals += 1;
            self.upkeep.inserted += 1;
        }
    }

    /// Whether a batch of updates moves a large part of the tree, by a sample.
    pub(super) fn moves_most(&self, updates: &[(PolygonId, Aabb)]) -> bool {
        let filed = self.store.filed();
        if filed < LEAST || updates.len() < filed / MOST {
            return false;
        }
        let sample = updates.iter().step_by(updates.len().div_ceil(SAMPLE));
        let is_filed = |id: &PolygonId| self.store.filed_lanes(id.0 / 16) >> (id.0 % 16) & 1 == 1;
        let (count, found) =
            sample.fold((0, 0), |(count, found), (id, _)| (count + 1, found + usize::from(is_filed(id))));
        updates.len() * found / count > filed / MOST
    }

    /// Takes all polygons out of the tree, until few change.
    #[inline(never)]
    pub(super) fn pause(&mut self) {
        let residence = &mut self.residence;
        let was_calm = self.clock.wrapping_sub(residence.since) > NOT_LONG_AGO * residence.pause;
        residence.pause = if was_calm { TRIAL } else { (2 * residence.pause).min(LONGEST_PAUSE) };
        (residence.is_paused, residence.since) = (true, self.clock);
        (residence.quarters, residence.excess, residence.trial, residence.resting) = (0, 0, 0, 0);
        self.upkeep.inserted += self.store.filed() as u64;
        self.store.unfile_all();
        self.flat.fill(0);
        self.clear_tree();
        self.let_all_wait();
    }

    /// Lets all blocks with unfiled polygons wait.
    fn let_all_wait(&mut self) {
        let (clock, waiting) = (self.clock, &mut self.residence.waiting);
        self.store.let_all_wait(|block| waiting.push_back(Waiting { block, since: clock }));
    }

    /// Work of a commit: counts edits, and examines blocks.
    pub(super) fn settle(&mut self) {
        let inserted = mem::take(&mut self.residence.inserted);
        self.note_edits();
        let (groups, most) = (self.store.shelf_count() * GROUPS, self.most_in_order());
        let residence = &mut self.residence;
        residence.is_large = groups > most || residence.is_large && 2 * groups > most;
        match mem::take(residence.demand.0.get_mut()) {
            Demand::YES => residence.unwanted = 0,
            asked => residence.unwanted = residence.unwanted.saturating_add(asked.into()),
        }
        let was_needed = residence.is_tree_needed;
        residence.is_tree_needed = residence.is_large && (residence.unwanted < UNWANTED_AFTER || most == 0);
        if residence.is_tree_needed && !was_needed {
            self.let_all_wait();
        }
        self.examine_some(inserted);
    }

    fn note_edits(&mut self) {
        let few = few_edits(self.store.len());
        let residence = &mut self.residence;
        let quarters = mem::take(&mut residence.quarters);
        if residence.is_paused {
            residence.trial += quarters;
            let paused = self.clock.wrapping_sub(residence.since);
            if paused > 0 && paused.is_multiple_of(TRIAL) {
                let trial = mem::take(&mut residence.trial);
                let is_calm = trial <= 4 * few;
                residence.is_paused = residence.resting < self.store.blocks() / 2
                    || trial > 4 * few * TRIAL
                    || !is_calm && paused < residence.pause;
            }
            return;
        }
        residence.excess = (residence.excess + (quarters / 4).min(MOST_OF_COMMIT * few)).saturating_sub(few);
        if residence.excess >= MANY * few {
            self.pause();
        }
    }

    /// Examines blocks that have waited. Those that have not changed get new boxes around them, and are filed.
    fn examine_some(&mut self, inserted: u32) {
        let Residence { waiting, is_eager, .. } = &mut self.residence;
        if inserted >= BATCH || *is_eager {
            // The blocks changed since the last commit wait at the end of the queue.
            let is_new = |of: &&Waiting| *is_eager || self.clock.wrapping_sub(of.since) == 1;
            let blocks = waiting.iter().rev().take_while(is_new).count();
            waiting.rotate_right(blocks);
            for _ in 0..blocks {
                let Some(Waiting { block, .. }) = self.residence.waiting.pop_front() else { return };
                self.examine(block, true);
            }
            return;
        }
        let mut runs = RUNS_A_COMMIT + 2 * inserted + (self.store.unfiled() / RUNS_SHARE) as u32;
        runs *= if inserted == 0 { IDLE } else { 1 };
        let mut blocks = 8 + inserted as usize + waiting.len() / WAIT as usize;
        while blocks > 0 && runs > 0 {
            let Some(&Waiting { block, since }) = self.residence.waiting.front() else { return };
            if self.clock.wrapping_sub(since) < WAIT {
                return;
            }
            self.residence.waiting.pop_front();
            blocks -= 1;
            runs = runs.saturating_sub(self.examine(block, false));
        }
    }

    /// Examines a block. Returns the number of runs that it has got in the tree.
    fn examine(&mut self, block: u32, is_batch: bool) -> u32 {
        let Some(at) = self.store.at(block) else { return 0 };
        let shelf = self.store.shelf_mut(at.shelf);
        let (group, bit) = (at.block / 16, 1 << (at.block % 16));
        shelf.waiting[group] &= !bit;
        let (live, filed) = (shelf.live[at.block], shelf.filed[at.block]);
        let moved = mem::take(&mut shelf.moved[at.block]);
        if moved == 0 || is_batch {
            self.upkeep.boxes += self.store.refit(at, block);
        }
        if live == 0 {
            self.store.drop_shelf(at, block);
            return 0;
        }
        if self.residence.is_paused && !self.residence.is_eager {
            let shelf = self.store.shelf_mut(at.shelf);
            let was_resting = shelf.resting[group] & bit != 0;
            shelf.resting[group] =
                if moved == 0 { shelf.resting[group] | bit } else { shelf.resting[group] & !bit };
            match (was_resting, moved == 0) {
                (true, false) => {
                    self.residence.trial += 2 * moved.count_ones();
                    self.residence.resting = self.residence.resting.saturating_sub(1);
                }
                (false, true) => self.residence.resting += 1,
                _ => {}
            }
        } else if moved == 0 || is_batch {
            let Residence { is_large, is_tree_needed, .. } = self.residence;
            return if is_tree_needed || is_large && is_batch { self.file(block, live & !filed) } else { 0 };
        }
        self.wait(at, block);
        0
    }

    /// Inserts polygons of a block into the tree. Returns the number of their runs.
    pub(super) fn file(&mut self, block: u32, lanes: u16) -> u32 {
        if lanes == 0 {
            return 0;
        }
        let mut gathered = self.gathered.take().unwrap_or_default();
        let number = self.store.number(block);
        gathered.gather((block, number), lanes, self.store.boxes(number));
        self.store.file(block, lanes);
        self.insert_runs(&gathered.runs[..gathered.count]);
        self.changes += 1;
        self.upkeep.inserted += u64::from(lanes.count_ones());
        let runs = gathered.count as u32;
        self.gathered = Some(gathered);
        runs
    }
}
