//! Runs that have lost polygons: their boxes are too wide until upkeep comes to them, wherever they are by then.

use super::{Both, borders::part};
use glam::Vec3;
use osp::{index::SpatialIndex, math::Aabb};
use osp_testkit::boxes::Rng;

/// Polygons side by side along x, of which the last lies far from the first.
fn row(at: Vec3, count: usize) -> Vec<Aabb> {
    (0..count).map(|i| Aabb::cube(at + Vec3::X * (0.01 * i as f32), 0.01)).collect()
}

/// A tree with small polygons in two parts of the root cube, so many in each, and these rows in one of them. The first numbers of
/// the rows.
fn tree(both: &mut Both, rng: &mut Rng, count: usize, rows: &[usize]) -> Vec<u32> {
    both.add_small(count, &Aabb::cube(Vec3::splat(-1.0), 1.2), rng);
    both.add_small(count, &part(), rng);
    let corner = Aabb::cube(Vec3::splat(0.5), 0.1);
    let rows: Vec<u32> = rows.iter().map(|&count| both.add(&row(rng.point(&corner), count))).collect();
    both.add_small(1, &part(), rng);
    both.wait();
    both.check();
    rows
}

/// It takes the box of its own, and waits for that in the page to which it went.
#[test]
fn what_is_left_of_a_pair_may_go_to_another_leaf() {
    let (mut both, mut rng) = (Both::new(), Rng(66));
    let pairs = tree(&mut both, &mut rng, 200, &[2; 8]);
    for (i, &id) in pairs.iter().enumerate() {
        both.remove(id + i as u32 % 2);
        both.update(id + 1 - i as u32 % 2, &Aabb::cube(Vec3::splat(-1.0), 0.01));
        both.check();
    }
    both.wait();
    both.check();
}

/// Of seven six are left: that alone is no reason to look at their page.
#[test]
fn what_is_left_of_a_row_is_known_to_be_loose_when_its_leaf_is_packed() {
    let (mut both, mut rng) = (Both::new(), Rng(67));
    let rows = tree(&mut both, &mut rng, 150, &[7; 4]);
    both.add_small(40, &part(), &mut rng);
    rows.iter().for_each(|id| both.remove(id + 6));
    both.wait();
    both.check();
}

#[test]
fn what_is_left_of_a_row_is_known_to_be_loose_when_its_leaf_is_split() {
    let (mut both, mut rng) = (Both::new(), Rng(68));
    let rows = tree(&mut both, &mut rng, 200, &[7; 4]);
    rows.iter().for_each(|id| both.remove(id + 6));
    both.check();
    both.add_small(100, &part(), &mut rng);
    both.check();
}

#[test]
fn what_is_left_of_a_row_is_known_to_be_loose_when_leaves_are_joined() {
    let (mut both, mut rng) = (Both::new(), Rng(69));
    // Pages that hold nothing else, so that upkeep does not come to them before.
    let rows = tree(&mut both, &mut rng, 400, &[7; 48]);
    rows.iter().for_each(|id| both.remove(id + 6));
    for id in (0..both.next).step_by(16).filter(|id| !rows.contains(id)) {
        both.remove(id);
        both.osp.commit();
        both.osp.validate().expect("a sound tree");
    }
    both.wait();
    both.check();
}
