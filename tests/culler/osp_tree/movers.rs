//! Polygons that move leave the tree, and come back when their blocks rest: no answer changes.

use super::{config, in_order::assert_all_same};
use glam::Vec3;
use osp::{
    index::{BruteForce, IndexError, Osp, SpatialIndex},
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};
use osp_testkit::boxes::{Rng, drawn, shuffled};
use proptest::prelude::{ProptestConfig, proptest};

/// The tree answers for the polygons that it holds, and the walk in order for the others.
fn osp() -> Osp {
    Osp::new(&config()).with_most_in_order(0)
}

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
        (0..80).for_each(|_| pair.commit());
        assert_eq!(pair.osp.moving(), 0);
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
    ) {
        let count = 2_000;
        let mut boxes = drawn(count, seed);
        if is_shuffled {
            boxes = shuffled(boxes, seed);
        }
        let mut rng = Rng(seed);
        let ids = moving(kind, count, &mut rng);
        let mut pair = Pair::filled(boxes, osp(), seed);
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
        for frame in 0..800 {
            let there: Vec<u32> =
                going.iter().copied().filter(|&id| pair.osp.bounds(PolygonId(id)).is_some()).collect();
            pair.step(&there, is_each);
            if frame % 200 == 0 {
                pair.check();
            }
        }
        // A block stays out of the tree with a polygon that moves.
        let most = BLOCK * going.len();
        assert!(pair.osp.moving() <= most, "{} move, {most} should", pair.osp.moving());
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
    let mut pair = Pair::filled(boxes, osp(), 5);
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
fn clearing_forgets_what_moves() {
    let mut pair = Pair::filled(drawn(3_000, 1), osp(), 1);
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

/// If most scattered polygons move in one commit, all polygons leave the tree in this commit.
#[test]
fn what_moves_all_at_once_leaves_the_tree_at_once() {
    for is_each in [false, true] {
        let osp = osp();
        let mut pair = Pair::filled(shuffled(drawn(5_000, 6), 7), osp, 8);
        assert_eq!(pair.osp.moving(), 0);
        let ids: Vec<u32> = (0..5_000).collect();
        pair.step(&ids, is_each);
        assert_eq!(pair.osp.moving(), 5_000, "one by one: {is_each}");
        pair.check();
    }
}

/// If other polygons move, come and go in each frame, all polygons leave the tree, and return when few change.
#[test]
fn where_much_changes_the_tree_is_empty_until_little_does() {
    let count = 6_000;
    let mut pair = Pair::filled(shuffled(drawn(count, 11), 12), osp(), 13);
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
    assert_eq!(pair.osp.moving(), 2 * BLOCK);
    pair.check();
}

/// Pieces of a drawing are replaced in each frame, or move for a few frames.
#[test]
fn pieces_that_are_replaced_or_move_briefly_are_found() {
    let (count, piece) = (6_000, 100);
    for is_replaced in [true, false] {
        let mut pair = Pair::filled(drawn(count, 11), osp(), 13);
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
        for _ in 0..3_000 {
            pair.commit();
        }
        assert_eq!(pair.osp.moving(), 0, "replaced: {is_replaced}");
        pair.check();
    }
}

/// While other polygons move in each frame, the tree stays empty, however long it takes. If the same polygons move from
/// then on, the rest returns to the tree.
#[test]
fn only_polygons_that_rest_return_to_the_tree() {
    let (count, moving) = (6_000, 60);
    let mut pair = Pair::filled(shuffled(drawn(count, 11), 12), osp(), 13);
    for frame in 0..1_500 {
        let ids: Vec<u32> = (0..moving).map(|_| pair.rng.below(count) as u32).collect();
        pair.step(&ids, false);
        assert!(frame < 100 || pair.osp.moving() == count, "frame {frame}");
    }
    let ids: Vec<u32> = (0..moving as u32).map(|at| at * 97).collect();
    for frame in 0..4_000 {
        pair.step(&ids, frame % 2 == 0);
    }
    assert_eq!(pair.osp.moving(), BLOCK * moving);
    pair.check();
}
