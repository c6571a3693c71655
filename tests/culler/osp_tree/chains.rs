//! Polygons that no cell can part are a chain of buckets: whatever goes out of it first, the rest stays whole.

use super::life::depth;
use glam::Vec3;
use osp::{
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum, Plane},
    polygon::PolygonId,
};
use osp_testkit::boxes::{Rng, root};

const COUNT: u32 = 20_000;

fn check(osp: &Osp, is_left: &[bool], what: &str) {
    osp.validate().unwrap_or_else(|error| panic!("{what}: {error}"));
    let everything = Frustum::new([Plane { normal: Vec3::ZERO, d: 0.0 }; 6]);
    let mut list = Vec::new();
    osp.frustum_cull(&everything, &mut list);
    let mut found: Vec<u32> = list.iter().map(|id| id.0).collect();
    found.sort_unstable();
    let left: Vec<u32> = (0..COUNT).filter(|&i| is_left[i as usize]).collect();
    assert!(found == left, "{what}: {} of {} are found", found.len(), left.len());
}

fn full(size_m: f32) -> Osp {
    let mut osp = Osp::new(&IndexConfig { root: root(), capacity: COUNT as usize });
    let bounds = Aabb::cube(Vec3::new(0.1, 0.2, 0.3), size_m);
    for i in 0..COUNT {
        osp.insert(PolygonId(i), &bounds).expect("a new number");
        if i % 256 == 255 {
            osp.commit();
        }
    }
    osp.commit();
    assert!(depth(&osp) < 32, "a chain of nodes");
    osp
}

fn orders() -> [(&'static str, Vec<u32>); 4] {
    let (mut shuffled, mut random): (Vec<u32>, _) = ((0..COUNT).collect(), Rng(9));
    for i in (1..COUNT as usize).rev() {
        shuffled.swap(i, random.below(i + 1));
    }
    let from_the_middle = (COUNT / 3..COUNT).chain(0..COUNT / 3).collect();
    [
        ("first to last", (0..COUNT).collect()),
        ("last to first", (0..COUNT).rev().collect()),
        ("from the middle", from_the_middle),
        ("shuffled", shuffled),
    ]
}

#[test]
fn a_chain_stays_whole_whatever_goes_first() {
    for ((what, order), size_m) in orders().into_iter().zip([0.0, 0.02, 0.0, 0.02]) {
        let mut osp = full(size_m);
        let mut is_left = vec![true; COUNT as usize];
        for (done, &i) in order.iter().enumerate() {
            osp.remove(PolygonId(i)).expect("it is there");
            is_left[i as usize] = false;
            if done % 64 == 63 {
                osp.commit();
            }
            if done % 2048 == 2047 {
                check(&osp, &is_left, &format!("{what}, {done} gone"));
            }
        }
        osp.commit();
        check(&osp, &is_left, what);
    }
}

/// A leaf whose polygons are too large for its parts becomes a node that keeps them all, and smaller ones go below it.
#[test]
fn a_leaf_of_large_polygons_becomes_a_node_that_keeps_them() {
    let mut random = Rng(3);
    let mut near = |size_m: f32| {
        let mut offset = || random.below(1000) as f32 * 1.0e-5;
        Aabb::cube(Vec3::new(0.55 + offset(), 0.55 + offset(), 0.55 + offset()), size_m)
    };
    for large_m in [0.2, 0.35, 0.6] {
        let mut osp = Osp::new(&IndexConfig { root: root(), capacity: COUNT as usize });
        let mut is_left = vec![false; COUNT as usize];
        for i in 0..COUNT {
            // Large ones first, then small ones among them.
            let size_m = if i < 14_000 || i % 3 == 0 { large_m } else { 0.004 };
            osp.insert(PolygonId(i), &near(size_m)).expect("a new number");
            is_left[i as usize] = true;
            if i % 500 == 499 {
                osp.commit();
                check(&osp, &is_left, &format!("{large_m} m, {i} inserted"));
            }
        }
        for (done, i) in (0..COUNT).step_by(3).chain((0..COUNT).filter(|i| i % 3 == 1)).enumerate() {
            osp.remove(PolygonId(i)).expect("it is there");
            is_left[i as usize] = false;
            if done % 500 == 499 {
                osp.commit();
                check(&osp, &is_left, &format!("{large_m} m, {done} removed"));
            }
        }
    }
}
