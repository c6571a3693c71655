//! Polygons that move in frame after frame are kept beside the tree, and come back when they rest: no answer changes.

use super::{config, linear::assert_all_same, tree};
use glam::Vec3;
use osp::{
    index::{Backend, BruteForce, IndexConfig, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::PolygonId,
};
use osp_testkit::boxes::{Rng, drawn, shuffled};
use proptest::prelude::{ProptestConfig, proptest};

/// Both indexes, and the boxes by number.
struct Pair {
    osp: Osp,
    reference: BruteForce,
    boxes: Vec<Aabb>,
    rng: Rng,
}

impl Pair {
    fn filled(boxes: Vec<Aabb>, osp: Osp, seed: u64) -> Self {
        let mut pair = Self { osp, reference: BruteForce::new(), boxes, rng: Rng(seed) };
        for id in 0..pair.boxes.len() {
            pair.both(|index, boxes| index.insert(PolygonId(id as u32), &boxes[id]));
            if id % 16 == 15 {
                pair.commit();
            }
        }
        pair.commit();
        pair
    }

    /// Does the same to both, which have to answer alike.
    fn both(&mut self, act: impl Fn(&mut dyn SpatialIndex, &[Aabb]) -> Result<(), IndexError>) {
        let expected = act(&mut self.reference, &self.boxes);
        assert_eq!(act(&mut self.osp, &self.boxes), expected);
    }

    fn commit(&mut self) {
        self.osp.commit();
        self.reference.commit();
    }

    /// A frame in which these move a little, told one by one or together.
    fn step(&mut self, ids: &[u32], is_each: bool) {
        let mut updates = Vec::new();
        for &id in ids {
            let by = self.rng.direction() * 0.05;
            let of = &mut self.boxes[id as usize];
            (of.min, of.max) = (of.min + by, of.max + by);
            updates.push((PolygonId(id), *of));
        }
        if is_each {
            updates.iter().for_each(|(id, bounds)| self.both(|index, _| index.update(*id, bounds)));
        } else {
            let (mut refused, mut expected) = (Vec::new(), Vec::new());
            self.reference.update_all(&updates, &mut expected);
            self.osp.update_all(&updates, &mut refused);
            assert_eq!(refused, expected);
        }
        self.commit();
    }

    fn check(&mut self) {
        let seed = self.rng.next();
        assert_all_same(&self.osp, &self.reference, &self.boxes, seed);
    }
}

/// Numbers that move: neighbours, some drawn by lot, or all.
fn moving(kind: usize, count: usize, rng: &mut Rng) -> Vec<u32> {
    match kind {
        0 => (count as u32 / 3..count as u32 / 3 + 200).collect(),
        1 => (0..count as u32).filter(|_| rng.below(12) == 0).collect(),
        2 => (0..count as u32).filter(|id| id % 16 < 9 && id % 5 != 0).collect(),
        _ => (0..count as u32).collect(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn what_moves_is_found_as_before_and_goes_back_when_it_rests(
        seed: u64,
        kind in 0..4_usize,
        is_shuffled: bool,
        is_each: bool,
        linear_blocks in proptest::sample::select(vec![0, 12]),
    ) {
        let count = 2_000;
        let mut boxes = drawn(count, seed);
        if is_shuffled {
            boxes = shuffled(boxes, seed);
        }
        let mut rng = Rng(seed);
        let ids = moving(kind, count, &mut rng);
        let mut pair = Pair::filled(boxes, tree(Backend::detect()).with_linear_blocks(linear_blocks), seed);
        for frame in 0..10 {
            pair.step(&ids, is_each);
            if frame % 3 == 0 {
                pair.check();
            }
        }
        assert!(pair.osp.moving() + 16 >= ids.len(), "{} of {} move", pair.osp.moving(), ids.len());
        // What moves is refused as anything else is, erased, and inserted again.
        for _ in 0..40 {
            let id = PolygonId(ids[pair.rng.below(ids.len())]);
            let bad = Aabb { min: Vec3::NAN, max: Vec3::ONE };
            pair.both(|index, _| index.update(id, &bad));
            pair.both(|index, boxes| index.insert(id, &boxes[id.index()]));
            pair.both(|index, _| index.remove(id));
            pair.both(|index, _| index.remove(id));
            pair.both(|index, boxes| index.update(id, &boxes[id.index()]));
            if pair.rng.below(2) == 0 {
                pair.both(|index, boxes| index.insert(id, &boxes[id.index()]));
            }
        }
        pair.commit();
        pair.check();
        // Some go on, the others rest.
        let going: Vec<u32> = ids.iter().copied().filter(|id| id % 7 == 0).collect();
        // A commit returns five runs, and what fills a hole behind the round waits for the next but one.
        for frame in 0..800 {
            let there: Vec<u32> =
                going.iter().copied().filter(|&id| pair.osp.bounds(PolygonId(id)).is_some()).collect();
            pair.step(&there, is_each);
            if frame % 200 == 0 {
                pair.check();
            }
        }
        assert!(pair.osp.moving() <= going.len(), "{} move, {} should", pair.osp.moving(), going.len());
        for _ in 0..500 {
            pair.commit();
        }
        assert_eq!(pair.osp.moving(), 0);
        pair.check();
    }
}

#[test]
fn a_frame_in_which_many_rest_returns_a_bounded_share() {
    let boxes = shuffled(drawn(8_000, 3), 4);
    let mut pair = Pair::filled(boxes, tree(Backend::detect()).with_linear_blocks(8), 5);
    let ids: Vec<u32> = (0..8_000).collect();
    for _ in 0..6 {
        pair.step(&ids, false);
    }
    assert!(pair.osp.moving() > 7_900);
    let mut before = pair.osp.moving();
    let mut frames = 0;
    while pair.osp.moving() > 0 {
        pair.commit();
        let now = pair.osp.moving();
        assert!(before - now <= 48, "{} went back in one frame", before - now);
        (before, frames) = (now, frames + 1);
        assert!(frames < 2_000, "all go back");
    }
    pair.check();
}

#[test]
fn what_moves_now_and_then_stays_in_the_tree() {
    let mut pair = Pair::filled(drawn(3_000, 1), tree(Backend::detect()), 1);
    let ids: Vec<u32> = (100..300).collect();
    for _ in 0..20 {
        pair.step(&ids, false);
        for _ in 0..9 {
            pair.commit();
        }
    }
    assert_eq!(pair.osp.moving(), 0);
}

#[test]
fn clearing_forgets_what_moves() {
    let mut pair = Pair::filled(drawn(3_000, 1), tree(Backend::detect()), 1);
    let ids: Vec<u32> = (0..3_000).collect();
    for _ in 0..6 {
        pair.step(&ids, true);
    }
    assert!(pair.osp.moving() > 2_900);
    pair.osp.clear();
    assert_eq!((pair.osp.len(), pair.osp.moving()), (0, 0));
    pair.osp.validate().expect("an empty index");
    assert_eq!(pair.osp.insert(PolygonId(7), &pair.boxes[7]), Ok(()));
}

/// The slot after the last update is the guess for the next one. A removed polygon leaves its id in the slot, or another
/// polygon takes the slot.
#[test]
fn a_guessed_slot_is_checked() {
    let osp = Osp::new(&IndexConfig { capacity: 4_000, ..config() });
    let mut pair = Pair::filled(shuffled(drawn(4_000, 2), 3), osp, 5);
    let ids: Vec<u32> = (0..4_000).step_by(40).collect();
    for _ in 0..1_000 {
        pair.step(&ids, false);
    }
    assert_eq!(pair.osp.moving(), ids.len());
    let mut removed = Vec::new();
    for gone in [99, 50, 1] {
        // The slot of `gone` is the guess. After the removal it is empty, or the last polygon has it.
        pair.step(&ids[gone - 1..gone], true);
        pair.both(|index, _| index.remove(PolygonId(ids[gone])));
        pair.both(|index, boxes| index.update(PolygonId(ids[gone]), &boxes[0]));
        removed.push(ids[gone]);
        pair.step(&ids[gone - 1..gone], true);
        pair.step(&ids[90..=90], true);
        pair.osp.validate().expect("a sound index");
        for id in &ids {
            let expected = (!removed.contains(id)).then_some(pair.boxes[*id as usize]);
            assert_eq!(pair.osp.bounds(PolygonId(*id)), expected);
        }
    }
}

/// If most scattered polygons move in one commit, all of them go to the rows in this commit.
#[test]
fn what_moves_all_at_once_goes_to_the_rows_at_once() {
    for is_each in [false, true] {
        let osp = tree(Backend::detect()).with_linear_blocks(0);
        let mut pair = Pair::filled(shuffled(drawn(5_000, 6), 7), osp, 8);
        assert_eq!(pair.osp.moving(), 0);
        let ids: Vec<u32> = (0..5_000).collect();
        pair.step(&ids, is_each);
        assert_eq!(pair.osp.moving(), 5_000, "one by one: {is_each}");
        pair.check();
    }
    // Strokes move as whole runs, which takes less time.
    let mut pair = Pair::filled(drawn(5_000, 6), tree(Backend::detect()).with_linear_blocks(0), 8);
    pair.step(&(0..5_000).collect::<Vec<u32>>(), false);
    assert_eq!(pair.osp.moving(), 0);
}

/// If other polygons move, come and go in each frame, all polygons go to the rows, and return when few change.
#[test]
fn where_much_changes_all_are_in_the_rows_until_little_does() {
    let count = 6_000;
    let mut pair = Pair::filled(shuffled(drawn(count, 11), 12), tree(Backend::detect()), 13);
    for frame in 0..300 {
        let ids: Vec<u32> = (0..60).map(|_| pair.rng.below(count) as u32).collect();
        match frame % 3 {
            0 => pair.step(&ids, false),
            1 => pair.step(&ids, true),
            _ => {
                for id in ids.into_iter().map(PolygonId) {
                    pair.both(|index, _| index.remove(id));
                    pair.both(|index, _| index.remove(id));
                    pair.both(|index, boxes| index.insert(id, &boxes[id.index()]));
                    pair.both(|index, boxes| index.insert(id, &boxes[id.index()]));
                }
                pair.commit();
            }
        }
        if frame % 25 == 0 {
            pair.check();
        }
    }
    assert_eq!(pair.osp.moving(), count);
    for _ in 0..3_000 {
        pair.step(&[7, 70], false);
    }
    assert_eq!(pair.osp.moving(), 2);
    pair.check();
}

/// The same holds for pieces of a drawing that are replaced in each frame, or move for a few frames.
#[test]
fn pieces_that_are_replaced_or_move_briefly_are_in_the_rows_until_few_do() {
    let (count, piece) = (6_000, 100);
    for is_replaced in [true, false] {
        let mut pair = Pair::filled(drawn(count, 11), tree(Backend::detect()), 13);
        for frame in 0..900 {
            let first = frame * 25 % (count - piece);
            let ids: Vec<u32> = (first..first + piece).map(|id| id as u32).collect();
            if is_replaced {
                for &id in &ids {
                    pair.both(|index, _| index.remove(PolygonId(id)));
                    pair.both(|index, _| index.remove(PolygonId(id)));
                }
                for &id in &ids {
                    pair.both(|index, boxes| index.insert(PolygonId(id), &boxes[id as usize]));
                    pair.both(|index, boxes| index.insert(PolygonId(id), &boxes[id as usize]));
                }
                pair.commit();
            } else {
                pair.step(&ids, frame % 2 == 0);
            }
            if frame % 100 == 0 {
                pair.check();
            }
        }
        assert_eq!(pair.osp.moving(), count, "replaced: {is_replaced}");
        for _ in 0..3_000 {
            pair.commit();
        }
        assert_eq!(pair.osp.moving(), 0, "replaced: {is_replaced}");
        pair.check();
    }
}

/// While other polygons move in each frame, all stay in the rows, however long it takes. If the same polygons move from
/// then on, the rest returns to the tree, even though many move.
#[test]
fn only_polygons_that_rest_return_to_the_tree() {
    let (count, moving) = (6_000, 60);
    let mut pair = Pair::filled(shuffled(drawn(count, 11), 12), tree(Backend::detect()), 13);
    for frame in 0..1_500 {
        let ids: Vec<u32> = (0..moving).map(|_| pair.rng.below(count) as u32).collect();
        pair.step(&ids, false);
        assert!(frame < 100 || pair.osp.moving() == count, "frame {frame}");
    }
    let ids: Vec<u32> = (0..moving as u32).map(|at| at * 97).collect();
    for frame in 0..4_000 {
        pair.step(&ids, frame % 2 == 0);
    }
    assert_eq!(pair.osp.moving(), moving);
    pair.check();
}

/// A few polygons that moved come to rest while the list is full and many polygons of the list are replaced in each frame.
#[test]
fn polygons_return_to_a_full_list_whose_polygons_are_replaced() {
    let mut osp = Osp::new(&IndexConfig::default());
    let place = |i: u32, x: f32| {
        Aabb::cube(Vec3::new((i % 400) as f32 * 0.05 - 10.0 + x, (i / 400) as f32 * 0.3, 0.0), 0.05)
    };
    let all = 5008..5008 + 224 * 16;
    (0..5000).for_each(|i| osp.insert(PolygonId(i), &place(i, 0.0)).expect("a new id"));
    for frame in 0..800 {
        if frame >= 400 {
            (0..64).for_each(|i| {
                osp.update(PolygonId(i), &place(i, (frame - 400) as f32 * 0.3)).expect("it is there")
            });
        }
        if frame == 412 {
            (64..5000).for_each(|i| osp.remove(PolygonId(i)).expect("it is there"));
        }
        osp.commit();
    }
    assert_eq!((osp.moving(), osp.len()), (64, 64));
    all.clone().for_each(|i| osp.insert(PolygonId(i), &place(i, 0.0)).expect("a new id"));
    for frame in 0..1_000 {
        for id in all.clone().take(if frame < 200 { 1_600 } else { 0 }).map(PolygonId) {
            osp.remove(id).expect("it is there");
            osp.insert(id, &place(id.0, 0.0)).expect("it is gone");
        }
        osp.commit();
    }
    osp.validate().expect("valid");
    assert_eq!((osp.moving(), osp.len()), (0, 64 + all.len()));
}
