//! Counts the changes of the tree that decide whether all polygons are kept in the flat rows (`to_rows.rs`).

use std::mem;

use super::{movers::Movers, tuning::RESTING_COMMITS};

/// Edits are few up to this number a commit, and up to one for every [`POLYGONS_AN_EDIT`] polygons of the tree. An edit
/// of the tree takes about as long as a test of this number of boxes. The first [`SMALL`] polygons do not count, because
/// a tree of few is hardly faster than rows. A hand that draws causes two or three edits a commit, which must be few.
const FEW_EDITS: u32 = 6;
const POLYGONS_AN_EDIT: u32 = 1024;
const SMALL: u32 = 4096;

/// All polygons go to the rows when the excess edits reach this multiple of the few edits. A set that moves in
/// each frame is in the rows before, because its blocks are hot.
const MANY: u32 = 96;
/// In this sum, a commit counts with at most this many times the edits that are few. So a single commit with many edits
/// has little effect, but every tenth commit has.
const MOST_OF_COMMIT: u32 = 16;

/// This many removals of drawn polygons take as long as one move of a run. A scattered polygon has a run of its own.
const REMOVALS_AN_EDIT: u32 = 4;

/// This many polygons that move to the rows, and return later, take as long as one move of a run, besides their removal.
const BEGUN_AN_EDIT: u32 = 2;

/// Number of edits if a scattered polygon in the tree begins to move: it moves to the rows when its block is hot. Drawn
/// polygons that begin to move share blocks.
const EDITS_A_MOVER: usize = 4;

/// Largest value of `Churn::wait`, in commits.
const LONGEST_WAIT: u32 = 4096;

/// A wait is recent for this many times its length after the polygons went to the rows.
const NOT_LONG_AGO: u32 = 16;

/// Polygons return after this number of consecutive commits with few changes, even if the wait is longer.
const LONGEST_CALM: u32 = 256;

/// Largest number of edits of a commit that are few, for this number of polygons.
fn few_edits(polygons: usize) -> u32 {
    FEW_EDITS.max((polygons as u32).saturating_sub(SMALL) / POLYGONS_AN_EDIT)
}

/// Number of edits that take as long as these removals of polygons.
fn edits_of(removals: u32, are_scattered: bool) -> u32 {
    if are_scattered { removals } else { removals / REMOVALS_AN_EDIT }
}

/// Measures the changes of the tree, or of the rows while they contain all polygons.
#[derive(Clone, Copy, Debug)]
pub(super) struct Churn {
    /// Number of runs moved since the last commit.
    pub(super) edits: u32,
    /// Number of polygons removed from runs or from kept rows since the last commit.
    pub(super) removals: u32,
    /// Number of polygons of the tree that moved to the rows since the last commit.
    pub(super) begun: u32,
    /// While the rows are kept: number of polygons inserted since the last commit.
    pub(super) inserted: u32,
    /// Sum of the edits beyond those that are few, in the last commits.
    excess: u32,
    /// Whether new polygons go to the rows, and none returns to the tree.
    pub(super) keeps_rows: bool,
    /// Number of the commit in which the polygons went to the rows.
    since: u32,
    /// Least number of commits from `since` until polygons return to the tree, unless few change.
    wait: u32,
    /// Number of consecutive commits in which few polygons were moved or removed in the rows.
    calm: u32,
    /// Number of updates of boxes up to the last commit.
    adjusted: u64,
    trial: Trial,
}

/// A trial of two halves, each of [`RESTING_COMMITS`] commits. It estimates how many edits each commit would have if all
/// polygons that rest were in the tree: the polygons that first move in the second half, and the removed polygons.
#[derive(Clone, Copy, Debug)]
struct Trial {
    commits: u32,
    /// Number of polygons that moved in the first half.
    moved: usize,
    /// Number of edits by removals in the second half.
    removed: usize,
    /// Number of polygons inserted. The rows count them as moved, but in a tree an insertion is no edit.
    inserted: usize,
}

impl Trial {
    const NONE: Self = Self { commits: 0, moved: 0, removed: 0, inserted: 0 };
}

impl Churn {
    pub(super) const NONE: Self = Self {
        edits: 0,
        removals: 0,
        begun: 0,
        inserted: 0,
        excess: 0,
        keeps_rows: false,
        since: 0,
        wait: RESTING_COMMITS,
        calm: 0,
        adjusted: 0,
        trial: Trial::NONE,
    };

    /// Begins to keep polygons in the rows. The wait is twice the last one if that ended not long ago. `adjusted` is the
    /// number of updates of boxes so far.
    pub(super) fn keep_rows(&mut self, clock: u32, adjusted: u64) {
        let was_calm = clock.wrapping_sub(self.since) > NOT_LONG_AGO * self.wait;
        let wait = if was_calm { RESTING_COMMITS } else { (2 * self.wait).min(LONGEST_WAIT) };
        *self = Self { keeps_rows: true, since: clock, wait, adjusted, ..Self::NONE };
    }

    /// Ends a commit's count of edits in a tree of `polygons` polygons. Returns whether all polygons should go to the rows.
    pub(super) fn note_edits(&mut self, polygons: usize, are_scattered: bool) -> bool {
        let few = few_edits(polygons);
        let edits = mem::take(&mut self.edits)
            + edits_of(mem::take(&mut self.removals), are_scattered)
            + mem::take(&mut self.begun) / BEGUN_AN_EDIT;
        let edits = edits.min(MOST_OF_COMMIT * few);
        self.excess = (self.excess + edits).saturating_sub(few);
        self.excess >= MANY * few
    }

    /// Does the same while all polygons are kept in the rows. Polygons may return to the tree after many calm commits. They
    /// may also return after the wait if a trial finds few edits and at least half of the polygons rest. Insertions do not
    /// count, because they cost as little in a tree.
    pub(super) fn note_kept(&mut self, clock: u32, adjusted: u64, rows: &mut Movers) {
        let are_scattered = !rows.own_rows().are_narrow();
        let few = few_edits(rows.len());
        let removed = mem::take(&mut self.removals);
        let changes = u64::from(mem::take(&mut self.edits) + removed) + adjusted
            - mem::replace(&mut self.adjusted, adjusted);
        self.calm = if changes <= few.into() { self.calm + 1 } else { 0 };
        if self.calm >= self.wait.min(LONGEST_CALM) {
            self.keeps_rows = false;
            return;
        }
        self.trial.commits += 1;
        self.trial.removed += edits_of(removed, are_scattered) as usize;
        self.trial.inserted += mem::take(&mut self.inserted) as usize;
        let moved = |trial: &Trial| rows.moved_count().saturating_sub(trial.inserted);
        if self.trial.commits == RESTING_COMMITS {
            (self.trial.moved, self.trial.removed) = (moved(&self.trial), 0);
        } else if self.trial.commits == 2 * RESTING_COMMITS {
            let moved = moved(&self.trial);
            let edits = moved.saturating_sub(self.trial.moved) + self.trial.removed;
            let edits = if are_scattered { EDITS_A_MOVER * edits } else { edits };
            self.keeps_rows = edits > (few * RESTING_COMMITS) as usize
                || moved > rows.len() / 2
                || clock.wrapping_sub(self.since) < self.wait;
            self.trial = Trial::NONE;
            rows.forget_moves();
        }
    }
}
