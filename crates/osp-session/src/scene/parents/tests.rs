//! Incremental updates give the same parents as a full rebuild.

use rand_pcg::{Pcg64, rand_core::Rng};

use super::*;
use crate::recording::GroupId;

/// A full rebuild: resets all groups to their base parents, then applies the groupings in order.
#[derive(Clone, Default)]
struct Anew {
    groups: Groups,
    active: BTreeMap<u64, Grouping>,
    undone: BTreeMap<u64, Grouping>,
}

#[derive(Clone, Copy)]
struct Grouping {
    group: usize,
    before: Option<usize>,
    parent: Option<usize>,
    holds: bool,
    /// Whether a forgotten grouping has made the group's parent final.
    is_settled: bool,
}

impl Anew {
    fn later(&self, place: u64) -> impl Iterator<Item = &Grouping> {
        let later = self.active.range((Excluded(place), Unbounded)).map(|(_, grouping)| grouping);
        later.filter(|grouping| !grouping.is_settled)
    }

    fn set_state(&mut self, place: u64, state: State) {
        let (from, to) = match state {
            State::Undone => (&mut self.active, &mut self.undone),
            State::Active => (&mut self.undone, &mut self.active),
        };
        let Some(mut grouping) = from.remove(&place) else { return };
        if grouping.is_settled {
            to.insert(place, grouping);
            return;
        }
        let group = grouping.group;
        if state == State::Active {
            let found = self.later(place).find(|later| later.group == group).map(|later| later.before);
            grouping.before = found.unwrap_or(self.groups.parent(group));
        }
        let mut base = None;
        if grouping.before == grouping.parent {
            grouping.holds = true;
        } else if self
            .later(place)
            .any(|later| later.group == group || !later.holds || later.before != later.parent)
        {
            let mut first = BTreeMap::new();
            let own = (state == State::Undone).then_some((&place, &grouping));
            let mut all: Vec<_> = self.active.iter().chain(own).collect();
            all.sort_by_key(|(place, _)| **place);
            for (_, grouping) in all.into_iter().filter(|(_, grouping)| !grouping.is_settled) {
                first.entry(grouping.group).or_insert(grouping.before);
            }
            first.entry(group).or_insert(grouping.before);
            base = Some(first);
        } else if state == State::Undone {
            self.groups.try_hang(group, grouping.before);
        } else {
            grouping.holds = self.groups.try_hang(group, grouping.parent);
        }
        match state {
            State::Undone => self.undone.insert(place, grouping),
            State::Active => self.active.insert(place, grouping),
        };
        let Some(base) = base else { return };
        base.keys().for_each(|&group| self.groups.set_parent(group, None));
        for (&group, &parent) in &base {
            self.groups.try_hang(group, parent);
        }
        for grouping in self.active.values_mut().filter(|grouping| !grouping.is_settled) {
            grouping.before = self.groups.parent(grouping.group);
            grouping.holds = self.groups.try_hang(grouping.group, grouping.parent);
        }
    }

    fn forget(&mut self, place: u64) {
        let Some(forgotten) = self.active.remove(&place) else { return };
        let is_settled = forgotten.holds && !forgotten.is_settled;
        let earlier = self.active.range_mut(..place).chain(self.undone.range_mut(..place));
        for (_, grouping) in earlier.filter(|(_, grouping)| grouping.group == forgotten.group) {
            grouping.is_settled |= is_settled;
        }
    }
}

struct Both {
    anew: Anew,
    groups: Groups,
    parents: GroupParents,
    next: u64,
}

impl Both {
    fn new(count: u32) -> Self {
        let mut anew = Anew::default();
        for group in 0..count {
            anew.groups.find_or_make(GroupId(group), None).expect("a new group");
        }
        Self { groups: anew.groups.clone(), anew, parents: GroupParents::default(), next: 0 }
    }

    /// Makes a grouping; `None` if it is refused.
    fn group(&mut self, group: usize, parent: Option<usize>) -> Option<u64> {
        self.parents.settle(&mut self.groups);
        let id = self.groups.id(group);
        let can = self.groups.find_or_make(id, parent).is_some();
        assert_eq!(self.anew.groups.find_or_make(id, parent).is_some(), can);
        can.then(|| {
            let (place, before) = (self.next, self.groups.parent(group));
            self.next += 1;
            self.parents.add(place, group, before, parent);
            self.groups.set_parent(group, parent);
            self.anew.groups.set_parent(group, parent);
            let grouping = Grouping { group, before, parent, holds: true, is_settled: false };
            self.anew.active.insert(place, grouping);
            place
        })
    }

    fn set_state(&mut self, place: u64, state: State) {
        let from = if state == State::Undone { &self.anew.active } else { &self.anew.undone };
        let Some(&grouping) = from.get(&place) else { return };
        if !grouping.is_settled {
            self.parents.set_state(&mut self.groups, place, grouping.group, grouping.parent, state);
        }
        self.anew.set_state(place, state);
    }

    fn forget(&mut self, place: u64) {
        self.parents.settle(&mut self.groups);
        let Some(&grouping) = self.anew.active.get(&place) else { return };
        if !grouping.is_settled {
            self.parents.forget(&self.groups, place, grouping.group, grouping.parent);
        }
        self.anew.forget(place);
    }

    fn compare(&mut self, of: &str) {
        self.parents.settle(&mut self.groups);
        for group in 0..self.groups.len() {
            assert_eq!(self.groups.parent(group), self.anew.groups.parent(group), "{of}: group {group}");
        }
        let mut count = 0;
        for (&place, grouping) in self.anew.active.iter().filter(|(_, grouping)| !grouping.is_settled) {
            assert_eq!(self.parents.holds(place, grouping.group), grouping.holds, "{of}: grouping {place}");
            count += 1;
        }
        assert_eq!(self.parents.count, count, "{of}");
        let is_left = self.parents.lines.iter().any(Option::is_some);
        assert!(count > 0 || !is_left || !self.parents.is_up_to_date(), "{of}: nothing is kept of nothing");
    }
}

struct Dice(Pcg64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count.max(1) as u64) as usize
    }
}

/// Applies groupings of `count` groups, and undoes and redoes them in random order, as several authors do.
fn play(seed: u64, count: usize, steps: usize, forgets: bool) -> Both {
    let mut dice = Dice(Pcg64::new(u128::from(seed), 3));
    let mut both = Both::new(count as u32);
    let is_deep = dice.below(2) == 0;
    // Largest number of active groupings, and number of undos and redos between two comparisons of the groups.
    let (most, pause) = (1 + dice.below(60), 1 + dice.below(4));
    for step in 0..steps {
        let active: Vec<u64> = both.anew.active.keys().copied().collect();
        let undone: Vec<u64> = both.anew.undone.keys().copied().collect();
        match dice.below(if forgets { 11 } else { 10 }) {
            0..=4 if active.len() < most => {
                let group = dice.below(count);
                // Some tests have long chains, others a random graph.
                let parent = match dice.below(8) {
                    0 => None,
                    1..=4 if is_deep => (group > 0).then(|| group - 1),
                    _ => Some(dice.below(count)),
                };
                both.group(group, parent);
            }
            0..=7 if !active.is_empty() => both.set_state(active[dice.below(active.len())], State::Undone),
            8..=9 if !undone.is_empty() => both.set_state(undone[dice.below(undone.len())], State::Active),
            10 if !active.is_empty() => both.forget(active[dice.below(active.len())]),
            _ => {}
        }
        if dice.below(pause) == 0 {
            both.compare(&format!("seed {seed}, step {step}"));
        }
    }
    both.compare(&format!("seed {seed}, at the end"));
    both
}

#[test]
fn what_is_turned_step_by_step_is_as_if_all_was_hung_anew() {
    for seed in 0..300 {
        play(seed, [3, 6, 12, 40][seed as usize % 4], 200, false);
    }
}

#[test]
fn the_same_where_groupings_are_forgotten() {
    for seed in 0..600 {
        play(seed, [3, 6, 12, 40][seed as usize % 4], 200, true);
    }
}

/// In chains of up to 64 groups, both methods refuse the same groupings.
#[test]
fn the_same_where_chains_become_too_long() {
    for seed in 0..60u64 {
        let mut both = Both::new(160);
        let mut dice = Dice(Pcg64::new(u128::from(seed), 5));
        // Chains of about thirty groups: any two of them together have nearly the largest length.
        for group in 1..160usize {
            let parent = (!group.is_multiple_of(28 + seed as usize % 8)).then(|| group - 1);
            both.group(group, parent);
        }
        for step in 0..150 {
            match dice.below(3) {
                0 => {
                    let parent = Some(dice.below(160));
                    both.group(dice.below(160), parent);
                }
                1 => {
                    let places: Vec<u64> = both.anew.active.keys().copied().collect();
                    both.set_state(places[dice.below(places.len())], State::Undone);
                }
                _ => {
                    let places: Vec<u64> = both.anew.undone.keys().copied().collect();
                    if !places.is_empty() {
                        both.set_state(places[dice.below(places.len())], State::Active);
                    }
                }
            }
            both.compare(&format!("seed {seed}, step {step}"));
        }
    }
}

#[test]
fn a_grouping_that_is_taken_back_leaves_the_group_where_it_found_it() {
    let mut both = Both::new(4);
    both.group(0, Some(2));
    let elsewhere = both.group(0, None).expect("no circle");
    let over = both.group(2, Some(0)).expect("no circle");
    both.forget(over);
    both.set_state(elsewhere, State::Undone);
    both.compare("taken back");
    assert_eq!(both.groups.parent(0), None);
    let last = both.group(0, Some(3)).expect("no circle");
    both.set_state(last, State::Undone);
    both.compare("where it was found");
    assert_eq!(both.groups.parent(0), None);
}

/// The effect of forgotten groupings is processed at the next undo, even if further undo and redo follow in the frame.
#[test]
fn what_is_outdated_is_settled_with_the_next_undo() {
    let mut both = Both::new(3);
    both.group(1, Some(0)).expect("no circle");
    let forgotten = both.group(0, Some(2)).expect("no circle");
    let turned = both.group(0, None).expect("no circle");
    let over = both.group(2, Some(0)).expect("no circle");
    let elsewhere = both.group(2, Some(1)).expect("no circle");
    both.group(0, None).expect("no circle");
    both.forget(over);
    both.forget(forgotten);
    both.set_state(elsewhere, State::Undone);
    both.set_state(turned, State::Undone);
    both.set_state(elsewhere, State::Active);
    both.compare("in one frame");
}
