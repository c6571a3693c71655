//! Where the top of the tree goes down, comes back, or keeps something of its own, and the largest leaf that there can be.

use super::Both;
use glam::Vec3;
use osp::{index::SpatialIndex, math::Aabb, polygon::PolygonId};
use osp_testkit::boxes::{Rng, root};

/// A cube in one of the eight parts of the root cube.
pub(crate) fn part() -> Aabb {
    Aabb::cube(Vec3::splat(1.0), 1.2)
}

#[test]
fn a_top_with_straddlers_of_its_own_stays() {
    let (mut both, mut rng) = (Both::new(), Rng(63));
    let straddlers: Vec<u32> = (0..3).map(|_| both.add(&[Aabb::cube(Vec3::ZERO, 3.0)])).collect();
    let small = both.add_small(600, &part(), &mut rng);
    both.remove(small[0]);
    both.osp.commit();
    both.check();
    straddlers.into_iter().for_each(|id| both.remove(id));
    both.wait();
    both.check();
}

/// The top goes down to the part in which everything lies; then so little is left that the tree begins again.
#[test]
fn a_tree_that_begins_again_below_the_root_cube_knows_nothing_of_before() {
    let (mut both, mut rng) = (Both::new(), Rng(64));
    for _ in 0..3 {
        let ids = both.add_small(600, &part(), &mut rng);
        both.check();
        for &id in &ids[20..] {
            both.remove(id);
            both.osp.commit();
        }
        both.check();
        both.add_small(300, &Aabb::cube(Vec3::splat(-1.0), 1.2), &mut rng);
        both.check();
        (0..both.next).step_by(16).map(PolygonId).for_each(|id| {
            assert_eq!(both.osp.remove(id), both.reference.remove(id));
        });
        both.wait();
    }
}

/// Whatever waits for upkeep then.
#[test]
fn a_tree_that_was_cleared_is_as_a_new_one() {
    let (mut both, mut rng) = (Both::new(), Rng(70));
    for _ in 0..3 {
        both.next = 0;
        let ids = both.add_small(700, &root(), &mut rng);
        ids.iter().step_by(3).for_each(|&id| both.remove(id));
        both.check();
        both.osp.clear();
        both.reference.clear();
        both.check();
        both.add_small(20, &part(), &mut rng);
        both.wait();
        both.check();
        both.osp.clear();
        both.reference.clear();
    }
}

/// A block knows which of its polygons are in the tree.
#[test]
fn a_polygon_is_not_inserted_twice_into_a_block_that_is_partly_filed() {
    let mut both = Both::new();
    let boxes = [Aabb::cube(Vec3::splat(0.5), 0.1), Aabb::cube(Vec3::splat(-0.5), 0.1)];
    both.add(&boxes);
    both.add(&boxes);
    for id in [2, 0, 1, 2].map(PolygonId) {
        let inserted = both.osp.insert(id, &boxes[0]);
        assert_eq!(inserted, both.reference.insert(id, &boxes[0]), "{id:?}");
        both.check();
    }
}

/// Runs that are too long for a smaller cell let a leaf grow to twice its size; then they shrink, and all go to one leaf below.
#[test]
fn the_largest_leaf_that_there_can_be_keeps_all_its_runs() {
    let (mut both, mut rng) = (Both::new(), Rng(65));
    let corner = Aabb::cube(Vec3::splat(0.5), 0.8);
    both.add_small(128, &corner, &mut rng);
    let long: Vec<u32> = (0..129)
        .map(|_| {
            let from = Vec3::new(0.1, rng.range(0.1, 0.9), rng.range(0.1, 0.9));
            let piece = |x: f32| Aabb::new(from + Vec3::X * x, from + Vec3::new(x + 0.55, 0.01, 0.01));
            both.add(&[piece(0.0), piece(0.55)])
        })
        .collect();
    both.add_small(1, &corner, &mut rng);
    both.osp.commit();
    long.iter().for_each(|id| both.remove(id + 1));
    both.wait();
    both.check();
    both.add_small(256, &corner, &mut rng);
    both.wait();
    both.check();
}
