//! Tests of the arrangements that a log stores, and of queries.

use glam::Vec3;
use rand_pcg::{Pcg64, rand_core::Rng};

use super::*;
use crate::scene::edit::Grouping;

fn named<T: Copy>(strokes: impl IntoIterator<Item = u32>, of: T) -> Vec<Named<T>> {
    strokes.into_iter().map(|stroke| Named { stroke, of }).collect()
}

fn moved(strokes: impl IntoIterator<Item = u32>) -> Arrangement {
    Arrangement::Move(named(strokes, Translation { by: Vec3::X, before: Vec3::ZERO }))
}

fn assigned(strokes: impl IntoIterator<Item = u32>) -> Arrangement {
    Arrangement::Assign { layer: 1, strokes: named(strokes, 0) }
}

fn grouped(group: usize, strokes: impl IntoIterator<Item = u32>) -> Arrangement {
    let names = group.is_multiple_of(2).then(|| [None, Some("a name".to_owned())]);
    Arrangement::Group(Box::new(Grouping {
        group,
        members: named(strokes, None),
        new_parent: Some(None),
        names,
    }))
}

fn placed(group: usize) -> Arrangement {
    let to = Transform { p: Vec3::X, q: glam::Quat::IDENTITY, s: 1.0 };
    Arrangement::Place { group, before: to, to }
}

/// Checks that the index has exactly the properties that arrangements set.
fn check(log: &Log, of: &str) {
    let mut index = BTreeSet::new();
    for (state, arrangements) in [(State::Active, &log.active), (State::Undone, &log.undone)] {
        for (&at, what) in arrangements {
            let of_strokes = !log.broad.contains(&(state, at));
            assert!(!of_strokes || what.named() as usize <= MOST_INDEXED, "{of}: {at} has too many strokes");
            for_each_key(what, of_strokes, |key| _ = index.insert((state, key, at)));
        }
    }
    assert_eq!(log.index, index, "{of}");
    let is_there = |&(state, at): &(State, u64)| match state {
        State::Active => log.active.contains_key(&at),
        State::Undone => log.undone.contains_key(&at),
    };
    assert!(log.broad.iter().all(is_there), "{of}: {:?}", log.broad);
}

#[test]
fn nothing_is_left_of_what_is_forgotten() {
    for seed in 0..40 {
        let mut dice = Pcg64::new(seed, 7);
        let mut below = |count: usize| (dice.next_u64() % count as u64) as usize;
        let mut log = Log::default();
        for step in 0..150 {
            let of = format!("seed {seed}, step {step}");
            let active: Vec<u64> = log.active.keys().copied().collect();
            let undone: Vec<u64> = log.undone.keys().copied().collect();
            let first = below(5) as u32;
            let strokes =
                first..first + if below(6) == 0 { MOST_INDEXED as u32 + 2 } else { 1 + below(3) as u32 };
            match below(9) {
                0 => _ = log.add(moved(strokes)),
                1 => _ = log.add(assigned(strokes)),
                2 => _ = log.add(grouped(below(4), strokes)),
                3 => _ = log.add(placed(below(4))),
                4 if !active.is_empty() => {
                    let at = active[below(active.len())];
                    let what = log.take(at);
                    log.put(at, what, State::Undone);
                }
                5 if !undone.is_empty() => {
                    let at = undone[below(undone.len())];
                    let what = log.take(at);
                    log.put(at, what, State::Active);
                }
                6 if !undone.is_empty() => log.remove(undone[below(undone.len())]),
                7 if !active.is_empty() => _ = log.forget(active[below(active.len())], below(2) == 0),
                _ => {}
            }
            check(&log, &of);
        }
        for at in 0..log.next {
            if log.active.contains_key(&at) { _ = log.forget(at, true) } else { log.remove(at) }
        }
        check(&log, "at the end");
        assert!(log.index.is_empty() && log.broad.is_empty());
    }
}
