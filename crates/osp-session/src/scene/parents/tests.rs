use super::*;
use crate::recording::GroupId;

/// The parents of four groups after groupings, some of which are forgotten, and others undone and redone. `settles` is
/// whether each undo and redo has a frame of its own.
fn parents_after(
    made: &[(usize, Option<usize>)],
    forgotten: &[u64],
    turned: &[(u64, State)],
    settles: bool,
) -> Vec<Option<usize>> {
    let (mut groups, mut parents) = (Groups::default(), GroupParents::default());
    for group in 0..4 {
        groups.find_or_make(GroupId(group), None).expect("a new group");
    }
    for (&(group, parent), place) in made.iter().zip(0..) {
        groups.find_or_make(groups.id(group), parent).expect("no circle");
        parents.add(place, group, groups.parent(group), parent);
        groups.set_parent(group, parent);
    }
    forgotten.iter().for_each(|&place| parents.forget(place));
    for &(place, state) in turned {
        let (group, parent) = made[place as usize];
        parents.set_state(&mut groups, place, group, parent, state);
        if settles {
            parents.settle(&mut groups);
        }
    }
    parents.settle(&mut groups);
    (0..4).map(|group| groups.parent(group)).collect()
}

#[test]
fn what_forgotten_groupings_make_outdated_does_not_depend_on_frames() {
    for settles in [true, false] {
        let made = [(0, Some(2)), (0, None), (2, Some(0))];
        let parents = parents_after(&made, &[2], &[(1, State::Undone)], settles);
        assert_eq!(parents, [None, None, Some(0), None]);
        let made = [(1, Some(0)), (0, Some(2)), (0, None), (2, Some(0)), (2, Some(1)), (0, None)];
        let turned = [(4, State::Undone), (2, State::Undone), (4, State::Active)];
        assert_eq!(parents_after(&made, &[3, 1], &turned, settles), [None, Some(0), Some(1), None]);
    }
}
