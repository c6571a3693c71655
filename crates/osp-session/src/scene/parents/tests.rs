//! Updates give the parents of all active groupings, applied in order to groups without parents.

use rand_pcg::{Pcg64, rand_core::Rng};

use super::*;
use crate::recording::GroupId;

#[derive(Default)]
struct Case {
    groups: Groups,
    parents: GroupParents,
    made: Vec<(usize, Option<usize>)>,
    active: BTreeSet<u64>,
}

impl Case {
    fn new(count: usize) -> Self {
        let mut case = Self::default();
        for group in 0..count {
            case.groups.find_or_make(GroupId(group as u32), None).expect("a new group");
        }
        case
    }

    /// Makes a grouping; `None` if it is refused.
    fn group(&mut self, group: usize, parent: Option<usize>) -> Option<u64> {
        self.parents.settle(&mut self.groups);
        self.groups.find_or_make(self.groups.id(group), parent)?;
        let place = self.made.len() as u64;
        self.parents.add(place, group, self.groups.parent(group), parent);
        self.groups.set_parent(group, parent);
        self.made.push((group, parent));
        self.active.insert(place);
        Some(place)
    }

    fn set_state(&mut self, place: u64, state: State) {
        match state {
            State::Active => self.active.insert(place),
            State::Undone => self.active.remove(&place),
        };
        let (group, parent) = self.made[place as usize];
        self.parents.set_state(&mut self.groups, place, group, parent, state);
    }

    fn all_parents(&mut self) -> Vec<Option<usize>> {
        self.parents.settle(&mut self.groups);
        (0..self.groups.len()).map(|group| self.groups.parent(group)).collect()
    }

    fn check(&mut self, of: &str) {
        let parents = self.all_parents();
        let mut anew = Self::new(self.groups.len());
        for &place in &self.active {
            let (group, parent) = self.made[place as usize];
            assert_eq!(
                self.parents.holds(place),
                anew.groups.try_hang(group, parent),
                "{of}: grouping {place}"
            );
        }
        assert_eq!(parents, anew.all_parents(), "{of}");
    }
}

#[test]
fn what_is_turned_step_by_step_is_as_if_all_was_hung_anew() {
    for seed in 0..100 {
        let mut random = Pcg64::new(seed, 3);
        let mut below = |count: usize| (random.next_u64() % count as u64) as usize;
        let count = [3, 12, 40, 160][seed as usize % 4];
        let mut case = Case::new(count);
        // Chains of about thirty groups: any two of them together have nearly the largest length.
        for group in 1..count {
            case.group(group, (group % 30 > 0).then(|| group - 1)).expect("no circle");
        }
        for step in 0..150 {
            let place = below(case.made.len()) as u64;
            match below(4) {
                0 => _ = case.group(below(count), [None, Some(below(count))][below(8).min(1)]),
                _ if case.active.contains(&place) => case.set_state(place, State::Undone),
                _ => case.set_state(place, State::Active),
            }
            if below(3) == 0 {
                case.check(&format!("seed {seed}, step {step}"));
            }
        }
    }
}

#[test]
fn a_grouping_that_is_taken_back_leaves_the_group_where_it_found_it() {
    let mut case = Case::new(4);
    let places = [(0, Some(2)), (0, None), (2, Some(0))].map(|(group, parent)| case.group(group, parent));
    let [_, elsewhere, over] = places.map(|place| place.expect("no circle"));
    case.parents.forget(over);
    case.set_state(elsewhere, State::Undone);
    assert_eq!(case.all_parents()[0], None);
    let last = case.group(0, Some(3)).expect("no circle");
    case.set_state(last, State::Undone);
    assert_eq!(case.all_parents()[0], None);
}

/// Forgotten groupings make others outdated. The result does not depend on the frames in which undo and redo follow.
#[test]
fn what_is_outdated_is_settled_with_the_next_undo() {
    for in_one_frame in [true, false] {
        let mut case = Case::new(3);
        let made = [(1, Some(0)), (0, Some(2)), (0, None), (2, Some(0)), (2, Some(1)), (0, None)];
        let places = made.map(|(group, parent)| case.group(group, parent).expect("no circle"));
        let [_, forgotten, turned, over, elsewhere, _] = places;
        case.parents.forget(over);
        case.parents.forget(forgotten);
        for (place, state) in
            [(elsewhere, State::Undone), (turned, State::Undone), (elsewhere, State::Active)]
        {
            case.set_state(place, state);
            if !in_one_frame {
                case.parents.settle(&mut case.groups);
            }
        }
        assert_eq!(case.all_parents(), [None, Some(0), Some(1)]);
    }
}
