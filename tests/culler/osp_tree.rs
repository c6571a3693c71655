//! The fast tree against brute force, validated after each operation.

#![allow(clippy::print_stderr, reason = "a skipped test says why")]

mod borders;
mod chains;
mod hidden;
mod in_order;
mod life;
mod loose;
mod many_views;
mod movers;
mod whole;

use glam::Vec3;
use osp::{
    index::{Backend, BruteForce, IndexConfig, Osp, SpatialIndex, Visit, Visitor},
    math::{Aabb, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_rivals::IndexKind;
use osp_testkit::boxes::{Place, Rng, drawn, root, shuffled, views};

fn config() -> IndexConfig {
    IndexConfig { root: root(), capacity: 1000 }
}

fn tree(backend: Backend) -> Osp {
    Osp::with_backend(&config(), backend).with_all_in_tree()
}

fn backends() -> Vec<Backend> {
    let (can, cannot): (Vec<_>, Vec<_>) =
        Backend::ALL.iter().copied().partition(|backend: &Backend| backend.is_available());
    for backend in cannot {
        eprintln!("skipped: this processor has no {}", backend.name());
    }
    can
}

fn cull(index: &dyn SpatialIndex, frustum: &Frustum) -> Vec<u32> {
    let mut list = Vec::new();
    let work = index.frustum_cull(frustum, &mut list);
    assert_eq!(work.reported as usize, list.len(), "{}: reported", index.name());
    let mut ids: Vec<u32> = list.iter().map(|id| id.0).collect();
    ids.sort_unstable();
    ids
}

/// Takes every node and gathers the polygons.
#[derive(Default)]
struct Gather(Vec<u32>);

impl Visitor for Gather {
    fn node(&mut self, node: &osp::index::Node<'_>) -> Visit {
        assert!(node.polygons > 0);
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
        self.0.extend(ids.iter().map(|id| id.0));
    }
}

fn assert_same(osp: &dyn SpatialIndex, reference: &BruteForce, frusta: &[Frustum]) {
    assert_eq!(osp.len(), reference.len());
    for frustum in frusta {
        let expected = cull(reference, frustum);
        assert_eq!(cull(osp, frustum), expected);
        let mut gather = Gather::default();
        osp.traverse(frustum, &mut gather);
        gather.0.sort_unstable();
        assert_eq!(gather.0, expected);
    }
}

/// A tree and brute force, which get the same changes.
struct Both {
    osp: Osp,
    reference: BruteForce,
    /// The first number of the next block of sixteen: what begins one is a run of its own.
    next: u32,
}

impl Both {
    fn new() -> Self {
        Self::of(tree(Backend::detect()))
    }

    fn of(osp: Osp) -> Self {
        Self { osp, reference: BruteForce::new(), next: 0 }
    }

    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.osp.insert(PolygonId(id), bounds).expect("a new id");
        self.reference.insert(PolygonId(id), bounds).expect("a new id");
    }

    fn update(&mut self, id: u32, bounds: &Aabb) {
        self.osp.update(PolygonId(id), bounds).expect("it is there");
        self.reference.update(PolygonId(id), bounds).expect("it is there");
    }

    fn remove(&mut self, id: u32) {
        self.osp.remove(PolygonId(id)).expect("it is there");
        self.reference.remove(PolygonId(id)).expect("it is there");
    }

    /// Inserts boxes with their places as numbers, with a commit after each so many.
    fn fill(&mut self, boxes: &[Aabb], each: usize) {
        for (i, bounds) in boxes.iter().enumerate() {
            self.insert(i as u32, bounds);
            if i % each == each - 1 {
                self.osp.commit();
            }
        }
    }

    /// Polygons that lie side by side, and nothing else, in a block of numbers. The first number.
    fn add(&mut self, boxes: &[Aabb]) -> u32 {
        for (id, bounds) in (self.next..).zip(boxes) {
            self.insert(id, bounds);
        }
        self.next += 16;
        self.next - 16
    }

    fn add_small(&mut self, count: usize, around: &Aabb, rng: &mut Rng) -> Vec<u32> {
        (0..count).map(|_| self.add(&[Aabb::cube(rng.point(around), 0.02)])).collect()
    }

    /// Frames in which nothing changes, as many as upkeep needs.
    fn wait(&mut self) {
        (0..100).for_each(|_| self.osp.commit());
    }

    fn check(&self) {
        self.osp.validate().expect("a sound tree");
        assert_same(&self.osp, &self.reference, &views(&root(), 3, Place::Outside, 61));
        assert_same(&self.osp, &self.reference, &views(&root(), 3, Place::Inside, 62));
    }
}

/// A box of any kind that people draw, and some that they do not.
fn any_box(rng: &mut Rng) -> Aabb {
    let center = match rng.below(8) {
        0 => Vec3::ZERO,
        1 => rng.point(&Aabb::cube(Vec3::splat(1000.0), 8.0)),
        2 => rng.point(&Aabb::cube(Vec3::splat(-3.0), 2.0)),
        3 => rng.point(&Aabb::cube(Vec3::ONE, 0.001)),
        4 => rng.direction() * 10f32.powi(rng.below(30) as i32),
        _ => rng.point(&root()),
    };
    let size = match rng.below(6) {
        0 => 0.0,
        1 => 10f32.powi(rng.below(24) as i32 - 8),
        2 => 4.0,
        _ => 0.02,
    };
    let half = Vec3::new(rng.unit(), rng.unit(), rng.unit()) * size;
    Aabb::new(center - half, center + half)
}

#[test]
fn every_order_of_operations_is_answered_like_brute_force() {
    let rounds = if cfg!(debug_assertions) { 40 } else { 200 };
    let backends = backends();
    for round in 0..rounds {
        let mut rng = Rng(round);
        // Always by the tree, by the tree and the walk in order, or as it comes.
        let kind = |osp: Osp| match round / 8 % 3 {
            0 => osp.with_all_in_tree(),
            1 => osp.with_most_in_order(0),
            _ => osp,
        };
        let mut osp: Box<dyn SpatialIndex> = match round % 8 {
            0 => IndexKind::BruteSimd.create(&config()),
            1 => IndexKind::TimeOrder.create(&config()),
            2..=4 => {
                Box::new(kind(Osp::with_backend(&config(), backends[round as usize / 8 % backends.len()])))
            }
            _ => Box::new(kind(Osp::new(&config()))),
        };
        let mut reference = BruteForce::new();
        let ids = [40, 600, 3000][rng.below(3)];
        let strokes = drawn(ids, round + 1000);
        let session = rng.below(3);
        let mut next = 0;
        for step in 0..120 {
            match rng.below(6) {
                0..=2 => {
                    for _ in 0..rng.below(80) {
                        let id = if session == 0 { rng.below(ids) } else { next % ids };
                        next += 1;
                        let bounds = if session == 2 { any_box(&mut rng) } else { strokes[id] };
                        let id = PolygonId(id as u32);
                        assert_eq!(osp.insert(id, &bounds), reference.insert(id, &bounds));
                    }
                }
                3 => {
                    let start = rng.below(ids);
                    for i in 0..rng.below(120) {
                        let id = PolygonId(((start + i) % ids) as u32);
                        assert_eq!(osp.remove(id), reference.remove(id));
                    }
                }
                4 => {
                    let start = rng.below(ids);
                    let by = rng.direction() * rng.range(0.0, 5.0);
                    for i in 0..rng.below(60) {
                        let id = (start + i) % ids;
                        let bounds = Aabb::new(strokes[id].min + by, strokes[id].max + by);
                        let id = PolygonId(id as u32);
                        assert_eq!(osp.update(id, &bounds), reference.update(id, &bounds));
                    }
                }
                _ => osp.commit(),
            }
            if let Err(broken) = osp.validate() {
                panic!("round {round}, step {step}: {broken}");
            }
            let mut frusta = views(&root(), 1, Place::Inside, rng.next());
            frusta.extend(views(&Aabb::cube(Vec3::splat(1000.0), 8.0), 1, Place::Outside, rng.next()));
            assert_same(osp.as_ref(), &reference, &frusta);
        }
        osp.clear();
        osp.validate().unwrap();
        assert_eq!(osp.len(), 0);
    }
}
