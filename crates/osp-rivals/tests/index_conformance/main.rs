//! Compares every index with the plainest loop: every kind of scene, random changes in random order, every query after each
//! commit.

mod changes;
mod check;
mod groups;
mod limits;
mod nested;
mod osp_paper;
mod printed;
mod scenes;
mod settings;
mod subjects;

use glam::Vec3;
use osp::{
    index::{IndexConfig, IndexError, Node, Visit, Visitor},
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;
use osp_testkit::boxes::{Rng, drawn, root};
use scenes::{TestScene, scattered, scenes};
use subjects::{peers, subjects};

/// The root is a hint. Any will do.
const ROOTS: [Aabb; 8] = [
    Aabb { min: Vec3::ZERO, max: Vec3::ZERO },
    Aabb { min: Vec3::splat(-0.5e-30), max: Vec3::splat(0.5e-30) },
    Aabb { min: Vec3::splat(1.0e8), max: Vec3::splat(1.0e8 + 8.0) },
    Aabb { min: Vec3::splat(-f32::MAX), max: Vec3::splat(f32::MAX) },
    Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 20.0, 3.0) },
    Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY },
    Aabb::EMPTY,
    Aabb { min: Vec3::NAN, max: Vec3::NAN },
];

#[test]
fn every_index_answers_as_the_plainest_loop_does() {
    for (seed, scene) in (1..).zip(&scenes()) {
        // Other crates' trees lose boxes that are huge.
        let peers = if scene.name.starts_with("strokes") { peers() } else { Vec::new() };
        for subject in subjects().iter().chain(&peers) {
            changes::change(
                subject,
                scene,
                &IndexConfig { capacity: 100, ..IndexConfig::default() },
                seed,
                14,
            );
            let root = ROOTS[seed as usize % ROOTS.len()];
            changes::change(subject, scene, &IndexConfig { root, capacity: 0 }, seed + 100, 8);
        }
    }
}

/// The model is so large that each structure has many nodes, and `osp` leaves that whole runs leave and enter.
#[test]
fn large_models_are_answered_as_well() {
    let config = IndexConfig { capacity: 64, ..IndexConfig::default() };
    let scene = |name, boxes| TestScene { name, boxes };
    let large = scene("5,000 scattered", scattered(5000, &config.root, 0.03, 31));
    let drawn = scene("12,000 drawn", drawn(12_000, 4));
    for subject in &subjects() {
        changes::change(subject, &large, &config, 7, 12);
        if subject.name.starts_with("osp") && !subject.name.contains("paper") {
            changes::change(subject, &drawn, &config, 11, 60);
        }
    }
}

/// Compares the box of each node with the boxes of the polygons below.
struct Tight<'a> {
    boxes: &'a check::Boxes,
    /// Depths of the nodes above, their boxes, and the boxes around the polygons found so far.
    above: Vec<(u32, Aabb, Aabb)>,
    nodes: usize,
}

impl Tight<'_> {
    fn close(&mut self, depth: u32) {
        while let Some((_, said, found)) = self.above.pop_if(|node| node.0 >= depth) {
            assert_eq!(said, found, "a node at depth {depth} or below");
            if let Some((.., around)) = self.above.last_mut() {
                *around = around.union(&found);
            }
        }
    }
}

impl Visitor for Tight<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.close(node.depth);
        self.above.push((node.depth, *node.bounds, Aabb::EMPTY));
        self.nodes += 1;
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _: Visit) {
        let (.., around) = self.above.last_mut().expect("a node comes first");
        *around = ids.iter().fold(*around, |all, id| all.union(&self.boxes[id]));
    }
}

/// Loose boxes would make queries slower, not wrong. Left out are trees of cells, of boxes that may be loose, and of copies.
#[test]
fn boxes_stay_tight_as_polygons_move_and_go() {
    let left_out = [
        "osp",
        "osp-paper",
        "octree-paper",
        "octree-every-child",
        "loose-octree",
        "bvh-two-level",
        "octree-rebuild-thread",
        "octree-rebuild-nth",
    ];
    for &kind in IndexKind::ALL.iter().filter(|kind| !left_out.contains(&kind.name())) {
        let mut index = kind.create(&IndexConfig::default());
        let mut boxes: check::Boxes = (0..).map(PolygonId).zip(scattered(3000, &root(), 0.05, 9)).collect();
        boxes.iter().for_each(|(id, bounds)| index.insert(*id, bounds).expect("a new box"));
        index.commit();
        for (id, bounds) in boxes.iter_mut().filter(|(id, _)| id.0 % 5 == 0) {
            *bounds = Aabb::new(bounds.min * 0.9, bounds.min * 0.9 + 0.01);
            index.update(*id, bounds).expect("it is inserted");
        }
        for (id, _) in boxes.extract_if(.., |id, _| id.0 % 7 == 0) {
            index.remove(id).expect("it is inserted");
        }
        index.commit();
        let mut tight = Tight { boxes: &boxes, above: Vec::new(), nodes: 0 };
        index.traverse(&Frustum::everything(), &mut tight);
        tight.close(0);
        assert!(tight.nodes > 0, "{}", kind.name());
    }
}

#[test]
fn names_are_unique_and_lead_back() {
    for &kind in IndexKind::ALL {
        assert_eq!(IndexKind::from_name(kind.name()), Some(kind));
        assert_eq!(kind.create(&IndexConfig::default()).name(), kind.name());
    }
    assert_eq!(IndexKind::from_name("no such index"), None);
}

/// An exact test of the caller's own may round more than a box test does: by a part of ten thousand, a hit may come before the
/// polygon's box is entered. A polygon in between must not end the search.
#[test]
fn a_hit_that_is_rounded_to_before_its_box_is_still_the_nearest() {
    let mut rng = Rng(48);
    for _ in 0..8 {
        let (origin, corner) = (rng.point(&root()) * 3.0, rng.point(&root()));
        let ray = Ray::new(origin, (corner - origin).normalize_or(Vec3::X));
        let bounds = Aabb::cube(corner, 0.01);
        let entered = ray.enter_box(&bounds, f32::INFINITY).expect("it is aimed at");
        let (rounded, between) = (entered * (1.0 - 4.0e-5), entered * (1.0 - 2.0e-5));
        let (wide, narrow) = (PolygonId(0), PolygonId(1));
        for subject in &subjects() {
            let mut index = (subject.make)(&IndexConfig { root: root(), capacity: 2 });
            index.insert(wide, &Aabb::cube(corner, 0.5)).expect("a good box");
            index.insert(narrow, &bounds).expect("a good box");
            index.commit();
            let mut hit = |id: PolygonId| Some(if id == wide { between } else { rounded });
            let picked = index.ray_nearest(&ray, f32::INFINITY, &mut hit);
            assert_eq!(picked, Some((narrow, rounded)), "{}: {entered}", subject.name);
        }
    }
}

/// The last id below the limit takes at most a few megabytes, except in the two rivals that are arrays up to the highest id.
#[test]
fn ids_beyond_the_limit_are_refused_and_cost_nothing() {
    let bounds = Aabb::cube(Vec3::ONE, 0.1);
    for subject in &subjects() {
        let (name, mut index) =
            (subject.name, (subject.make)(&IndexConfig { capacity: 0, ..IndexConfig::default() }));
        let before = index.bytes();
        for id in [PolygonId::LIMIT, u32::MAX - 1, u32::MAX].map(PolygonId) {
            assert_eq!(index.insert(id, &bounds), Err(IndexError::IdBeyondLimit(id)), "{name}");
            assert_eq!(index.insert(id, &Aabb::EMPTY), Err(IndexError::IdBeyondLimit(id)), "{name}");
            assert_eq!(index.update(id, &bounds), Err(IndexError::Unknown(id)), "{name}");
            assert_eq!(index.remove(id), Err(IndexError::Unknown(id)), "{name}");
        }
        assert_eq!(index.bytes(), before, "{name}");
        if ["brute-simd", "time-order"].contains(&name) {
            continue;
        }
        let last = PolygonId(PolygonId::LIMIT - 1);
        index.insert(last, &bounds).expect("it is below the limit");
        index.commit();
        let mut found = Vec::new();
        index.box_query(&bounds, &mut found);
        assert_eq!(found, [last], "{name}");
        assert!(index.bytes() < 32 << 20, "{name}: {} bytes", index.bytes());
        index.remove(last).expect("it is inserted");
        assert!(index.is_empty(), "{name}");
    }
}
