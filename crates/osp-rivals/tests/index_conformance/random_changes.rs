//! A random sequence of changes, each applied to every index and to the reference.

use super::{
    Pair,
    check::check,
    scenes::random_frustum,
    subjects::{Subject, subjects},
};
use glam::Vec3;
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::Aabb,
    polygon::PolygonId,
};
use osp_testkit::boxes::Rng;
use proptest::{collection::vec, prelude::*};

/// Number of different ids. It is small, so that duplicate and unknown ids occur.
const IDS: u32 = 40;

#[derive(Clone, Debug)]
enum Change {
    Insert(u32, Aabb),
    Remove(u32),
    Update(u32, Aabb),
    /// Updates in one batch. Ids may occur twice, and may be unknown.
    UpdateAll(Vec<(u32, Aabb)>),
    /// A whole stroke along a line, with ids from the first number on.
    InsertRow(u32, u32, Aabb, Vec3),
    RemoveRow(u32, u32),
    Clear,
    Commit,
}

/// A coordinate: anywhere in the cube, often on a plane that halves the root, sometimes far outside or huge.
fn coordinate() -> BoxedStrategy<f32> {
    prop_oneof![
        4 => -2.0f32..4.0,
        3 => (-16i32..32).prop_map(|k| k as f32 * 0.125 - 0.5),
        1 => prop_oneof![Just(1.0e10f32), Just(-3.0e6), Just(f32::MAX), Just(-f32::MAX), Just(0.0), Just(1.0e-40)],
    ]
    .boxed() // The unboxed strategies, one in another, do not fit on the stack of a test.
}

fn point() -> BoxedStrategy<Vec3> {
    (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Vec3::new(x, y, z)).boxed()
}

fn bounds() -> BoxedStrategy<Aabb> {
    prop_oneof![
        6 => (point(), 0.0f32..0.2).prop_map(|(p, size_m)| Aabb::new(p, (p + Vec3::splat(size_m)).min(Vec3::MAX))),
        2 => (point(), point()).prop_map(|(a, b)| Aabb::new(a.min(b), a.max(b))),
        1 => point().prop_map(|p| Aabb::new(p, p)),
        // This box is refused.
        1 => point().prop_map(|p| Aabb::new(p, Vec3::new(p.x, f32::NAN, p.z))),
    ]
    .boxed()
}

fn change() -> impl Strategy<Value = Change> {
    let step = (-0.1f32..0.1, -0.1f32..0.1, -0.1f32..0.1).prop_map(|(x, y, z)| Vec3::new(x, y, z));
    prop_oneof![
        4 => (0..IDS, bounds()).prop_map(|(id, b)| Change::Insert(id, b)),
        3 => (0..IDS).prop_map(Change::Remove),
        3 => (0..IDS, bounds()).prop_map(|(id, b)| Change::Update(id, b)),
        3 => vec((0..2 * IDS, bounds()), 0..40).prop_map(Change::UpdateAll),
        2 => (0..IDS, 1..60u32).prop_flat_map(|(first, n)| vec(bounds(), n as usize).prop_map(move |all| {
            Change::UpdateAll((first..).zip(all).collect())
        })),
        2 => (0..IDS, 1..60u32, bounds(), step).prop_map(|(id, n, b, by)| Change::InsertRow(id, n, b, by)),
        1 => (0..IDS, 1..60u32).prop_map(|(id, n)| Change::RemoveRow(id, n)),
        1 => Just(Change::Clear),
        4 => Just(Change::Commit),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, max_shrink_iters: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn same_as_brute_force(changes in vec(change(), 1..40), seed in any::<u64>()) {
        let config = IndexConfig { capacity: 16, ..IndexConfig::default() };
        for subject in &subjects() {
            run(subject, &config, &changes, seed);
        }
    }
}

fn run(subject: &Subject, config: &IndexConfig, changes: &[Change], seed: u64) {
    let mut pair = Pair::new(subject, config, &[], subject.name.to_owned());
    let mut random = Rng(seed);
    for change in changes.iter().chain([&Change::Commit]) {
        match change {
            Change::Insert(id, b) => pair.insert(*id as usize, b),
            Change::InsertRow(first, count, b, by) => {
                for i in 0..*count {
                    let moved = Aabb::new(b.min + *by * i as f32, b.max + *by * i as f32);
                    pair.insert((first + i) as usize, &moved);
                }
            }
            Change::Remove(id) => pair.remove(*id as usize),
            Change::RemoveRow(first, count) => {
                (*first..first + count).for_each(|id| pair.remove(id as usize));
            }
            Change::Update(id, b) => pair.update(*id as usize, b),
            Change::UpdateAll(updates) => {
                let updates: Vec<_> = updates.iter().map(|&(id, b)| (PolygonId(id), b)).collect();
                pair.update_all(&updates);
            }
            Change::Clear => pair.clear(),
            Change::Commit => {
                pair.index.commit();
                let frusta = [(); 2].map(|()| random_frustum(&mut random, &config.root));
                check(&*pair.index, &pair.twin, &frusta, subject.name);
            }
        }
        // The index is also valid between two commits.
        if let Err(fault) = pair.index.validate() {
            panic!("{}, after {change:?}: {fault}", pair.place);
        }
        assert_eq!(pair.index.len(), pair.twin.index.len(), "{}, after {change:?}", pair.place);
    }
}
