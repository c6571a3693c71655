//! Indexes that grow, shrink, are emptied and grow again, far beyond the size of the small scenes. At every step they are
//! valid and find what the reference finds.

use super::{
    Pair,
    scenes::{around, frusta, scattered},
    subjects::subjects,
};
use glam::Vec3;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_testkit::boxes::Rng;

fn for_every_index(frusta_of: &[Aabb], mut test: impl FnMut(&mut Pair<'_>)) {
    let frusta: Vec<Frustum> = frusta(frusta_of).into_iter().step_by(3).collect();
    let config = IndexConfig { capacity: 64, ..IndexConfig::default() };
    for subject in &subjects() {
        test(&mut Pair::new(subject, &config, &frusta, subject.name.to_owned()));
    }
}

/// Inserts `boxes` from id `first` on, a few in each commit.
fn fill(pair: &mut Pair<'_>, first: usize, boxes: &[Aabb]) {
    for (n, some) in boxes.chunks(97).enumerate() {
        for (i, bounds) in some.iter().enumerate() {
            pair.insert(first + n * 97 + i, bounds);
        }
        pair.index.commit();
    }
}

fn erase(pair: &mut Pair<'_>, ids: std::ops::Range<usize>) {
    for (n, id) in ids.enumerate() {
        pair.remove(id);
        if n % 13 == 0 {
            pair.index.commit();
        }
    }
    // These commits leave time for upkeep.
    (0..40).for_each(|_| pair.index.commit());
}

#[test]
fn emptied_and_filled_again_with_fewer_as_many_and_more() {
    let root = IndexConfig::default().root;
    let boxes = scattered(5000, &root, 0.03, 31);
    for_every_index(&boxes[..100], |pair| {
        for count in [300, 300, 5, 257, 5000, 0, 16, 4097] {
            fill(pair, 0, &boxes[..count]);
            pair.check(&format!("filled with {count}"));
            pair.clear();
            pair.check(&format!("emptied of {count}"));
            // A late id comes first.
            pair.insert(count, &boxes[0]);
            pair.check("one, after emptying");
            pair.remove(count);
            pair.check("and none");
        }
    });
}

/// A model that lies in one corner of the modelling volume, then everywhere, then beyond it, and back.
#[test]
fn grown_shrunk_and_grown_again() {
    let root = IndexConfig::default().root;
    let corner = scattered(900, &around(root.min + Vec3::splat(0.3), 0.2), 0.004, 32);
    let everywhere = scattered(500, &root, 0.02, 33);
    let outside = scattered(400, &around(root.center(), 60.0), 0.05, 34);
    let (first_every, first_outside) = (2000, 4000);
    for_every_index(&everywhere[..100], |pair| {
        fill(pair, 0, &corner);
        pair.check("in a corner");
        for round in 0..3 {
            fill(pair, first_every, &everywhere);
            pair.check(&format!("everywhere, round {round}"));
            fill(pair, first_outside, &outside);
            pair.check(&format!("outside, round {round}"));
            erase(pair, first_outside..first_outside + outside.len());
            pair.check(&format!("back inside, round {round}"));
            erase(pair, first_every..first_every + everywhere.len());
            pair.check(&format!("back in the corner, round {round}"));
            // Each polygon requires another level. The ids belong to different blocks, and a last one closes the block
            // before it.
            for (i, by) in [0.5, 1.0, 2.0, 3.5, 20.0, 400.0, 0.0].into_iter().enumerate() {
                pair.insert(6000 + i * 16, &around(root.min + Vec3::splat(0.3 + by), 0.01));
                pair.check(&format!("grown by {by} m, round {round}"));
            }
            (0..7).for_each(|i| pair.remove(6000 + i * 16));
            (0..40).for_each(|_| pair.index.commit());
        }
        erase(pair, 0..corner.len());
        pair.check("nothing");
        fill(pair, 0, &corner);
        pair.check("in the corner again");
        pair.clear();
        fill(pair, 0, &everywhere);
        pair.check("everywhere after emptying");
    });
}

#[test]
fn shrunk_to_a_part_at_random_and_grown_again() {
    let root = IndexConfig::default().root;
    for_every_index(&scattered(60, &root, 0.1, 35), |pair| {
        let mut random = Rng(36);
        let mut inserted = Vec::new();
        let mut next = 0;
        for round in 0..12 {
            let middle = random.point(&root);
            let room = around(middle, [0.05, 0.4, 3.0, 50.0][random.below(4)]);
            for bounds in scattered(random.below(500), &room, 0.01, 37 + round) {
                pair.insert(next, &bounds);
                inserted.push(next);
                next += 1;
            }
            pair.check(&format!("round {round}, grown"));
            let keep = random.below(100);
            inserted.retain(|&id| {
                let kept = random.below(100) < keep;
                if !kept {
                    pair.remove(id);
                }
                kept
            });
            (0..40).for_each(|_| pair.index.commit());
            pair.check(&format!("round {round}, {keep} per cent kept"));
        }
    });
}

#[test]
fn ids_beyond_the_limit_are_refused_and_cost_nothing() {
    let bounds = around(Vec3::ONE, 0.1);
    let beyond = [PolygonId::LIMIT, PolygonId::LIMIT + 1, u32::MAX - 1, u32::MAX].map(PolygonId);
    for_every_index(&[bounds], |pair| {
        let before = pair.index.bytes();
        for id in beyond {
            let place = pair.place.clone();
            assert_eq!(pair.index.insert(id, &bounds), Err(IndexError::IdBeyondLimit(id)), "{place}");
            assert_eq!(pair.twin.index.insert(id, &bounds), Err(IndexError::IdBeyondLimit(id)));
            let bad = pair.index.insert(id, &Aabb::EMPTY);
            assert_eq!(bad, Err(IndexError::IdBeyondLimit(id)), "{place}: the box does not matter");
            assert_eq!(pair.index.update(id, &bounds), Err(IndexError::Unknown(id)), "{place}");
            assert_eq!(pair.index.remove(id), Err(IndexError::Unknown(id)), "{place}");
        }
        assert_eq!(pair.index.bytes(), before, "{}: memory", pair.place);
        pair.check("refused");
        pair.insert(7, &bounds);
        pair.check("one that is not");
    });
}

/// Such an id takes at most a few megabytes, except in the two rivals that are arrays up to the highest id.
#[test]
fn the_last_id_below_the_limit_is_inserted() {
    let bounds = around(Vec3::ONE, 0.1);
    let last = PolygonId(PolygonId::LIMIT - 1);
    for subject in &subjects() {
        if ["brute-simd", "time-order"].contains(&subject.name) {
            continue;
        }
        let mut index = (subject.make)(&IndexConfig { capacity: 0, ..IndexConfig::default() });
        index.insert(last, &bounds).expect("it is below the limit");
        index.commit();
        index.validate().expect(subject.name);
        let mut found = Vec::new();
        index.box_query(&bounds, &mut found);
        assert_eq!(found, [last], "{}", subject.name);
        assert!(index.bytes() < 32 << 20, "{}: {} bytes", subject.name, index.bytes());
        index.remove(last).expect("it is inserted");
        assert!(index.is_empty(), "{}", subject.name);
    }
}
