//! Compares every index with brute force: every scene, every order of changes, validated after each step.

mod batches;
mod check;
mod groups;
mod life_cycles;
mod limits;
mod nested;
mod osp_paper;
#[cfg(feature = "peers")]
mod peers;
mod printed;
mod random_changes;
mod scenes;
mod settings;
mod subjects;

use check::{BruteForceTwin, check};
use glam::Vec3;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, WorkCounts},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;
use scenes::{TestScene, frusta, scenes};
use subjects::{Subject, subjects};

/// An index and its twin, which get the same changes.
struct Pair<'a> {
    index: Box<dyn SpatialIndex>,
    twin: BruteForceTwin,
    frusta: &'a [Frustum],
    place: String,
}

impl<'a> Pair<'a> {
    fn new(subject: &Subject, config: &IndexConfig, frusta: &'a [Frustum], place: String) -> Self {
        Self { index: (subject.make)(config), twin: BruteForceTwin::default(), frusta, place }
    }

    fn insert(&mut self, id: usize, bounds: &Aabb) {
        let id = PolygonId(id as u32);
        let inserted = self.twin.index.insert(id, bounds);
        assert_eq!(self.index.insert(id, bounds), inserted, "{}", self.place);
        if inserted.is_ok() {
            self.twin.set(id, bounds);
        }
    }

    fn remove(&mut self, id: usize) {
        let id = PolygonId(id as u32);
        assert_eq!(self.index.remove(id), self.twin.index.remove(id), "{}", self.place);
    }

    fn update(&mut self, id: usize, bounds: &Aabb) {
        let id = PolygonId(id as u32);
        let updated = self.twin.index.update(id, bounds);
        assert_eq!(self.index.update(id, bounds), updated, "{}", self.place);
        if updated.is_ok() {
            self.twin.set(id, bounds);
        }
    }

    /// Updates the index in one batch, and the twin one by one. Returns the refusals.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)]) -> Vec<IndexError> {
        let (mut refused, mut expected) = (Vec::new(), Vec::new());
        self.index.update_all(updates, &mut refused);
        for (id, bounds) in updates {
            match self.twin.index.update(*id, bounds) {
                Ok(()) => self.twin.set(*id, bounds),
                Err(why) => expected.push(why),
            }
        }
        assert_eq!(refused, expected, "{}", self.place);
        refused
    }

    fn clear(&mut self) {
        self.index.clear();
        self.twin.index.clear();
    }

    fn check(&mut self, step: &str) {
        self.index.commit();
        check(&*self.index, &self.twin, self.frusta, &format!("{}, {step}", self.place));
    }
}

fn every_kind_and_scene(mut test: impl FnMut(&mut Pair<'_>, &TestScene)) {
    let config = IndexConfig { capacity: 100, ..IndexConfig::default() };
    for scene in scenes() {
        let frusta = frusta(&scene.boxes);
        for subject in &subjects() {
            let place = format!("{}, scene '{}'", subject.name, scene.name);
            test(&mut Pair::new(subject, &config, &frusta, place), &scene);
        }
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

#[test]
fn streamed_in_small_batches() {
    every_kind_and_scene(|pair, scene| {
        pair.check("nothing yet");
        let batch = scene.boxes.len().div_ceil(5).max(1);
        for (n, boxes) in scene.boxes.chunks(batch).enumerate() {
            for (i, bounds) in boxes.iter().enumerate() {
                pair.insert(n * batch + i, bounds);
            }
            pair.check("streaming");
        }
    });
}

#[test]
fn inserted_and_removed_in_every_order() {
    every_kind_and_scene(|pair, scene| {
        let count = scene.boxes.len();
        let forwards: Vec<usize> = (0..count).collect();
        let backwards: Vec<usize> = (0..count).rev().collect();
        let scattered: Vec<usize> = (0..count).map(|i| i * 37 % count).collect();
        let mixed = if count % 37 == 0 { &backwards } else { &scattered };
        let every_third: Vec<usize> = (0..3).flat_map(|r| (r..count).step_by(3)).collect();
        let orders = [
            ("first in, first out", &forwards, &forwards),
            ("last in, first out", &forwards, &backwards),
            ("mixed in, every third out", mixed, &every_third),
        ];
        for (name, come, go) in orders {
            come.iter().for_each(|&id| pair.insert(id, &scene.boxes[id]));
            pair.check(name);
            let (most, rest) = go.split_at(count - count / 8);
            most.iter().for_each(|&id| pair.remove(id));
            pair.check(name);
            // Some polygons come back under their old ids, and then all go.
            most.iter().step_by(4).for_each(|&id| pair.insert(id, &scene.boxes[id]));
            rest.iter().chain(most.iter().step_by(4)).for_each(|&id| pair.remove(id));
            pair.check(name);
            assert!(pair.index.is_empty(), "{}, {name}", pair.place);
        }
    });
}

#[test]
fn moved_and_cleared() {
    every_kind_and_scene(|pair, scene| {
        let boxes = &scene.boxes;
        let count = boxes.len();
        for (id, bounds) in boxes.iter().enumerate() {
            pair.insert(id, bounds);
        }
        pair.check("inserted");
        // All polygons move a little, so that a structure may refit.
        let nudged = |b: &Aabb| {
            let by = b.extent().min(Vec3::splat(1.0)) * 0.25;
            Aabb::new(b.min + by, b.max + by)
        };
        boxes.iter().enumerate().for_each(|(id, b)| pair.update(id, &nudged(b)));
        pair.check("nudged");
        // Each polygon moves to the place of another one, so that a structure must insert it again.
        (0..count).for_each(|id| pair.update(id, &boxes[count - 1 - id]));
        pair.check("mirrored");
        (0..count).step_by(2).for_each(|id| pair.update(id, &boxes[id]));
        (0..count).step_by(3).for_each(|id| pair.remove(id));
        pair.check("half moved back, a third removed");
        // Inserts, updates and removals are in one batch.
        (0..count).step_by(3).for_each(|id| {
            pair.insert(id, &boxes[id]);
            pair.update(id, &nudged(&boxes[id]));
            if id % 2 == 0 {
                pair.remove(id);
            }
        });
        pair.check("mixed batch");
        pair.clear();
        pair.check("cleared");
        boxes.iter().enumerate().for_each(|(id, b)| pair.insert(count - 1 - id, b));
        pair.check("filled again");
    });
}

#[test]
fn refused_changes_leave_everything_as_it_was() {
    let boxes = &scenes()[5].boxes[..40];
    let good = boxes[0];
    let bad = [
        Aabb::EMPTY,
        Aabb::new(Vec3::ONE, Vec3::new(1.0, 0.9, 1.0)),
        Aabb::new(Vec3::NAN, Vec3::NAN),
        Aabb::new(Vec3::new(0.0, f32::NAN, 0.0), Vec3::ONE),
        Aabb::new(Vec3::ZERO, Vec3::new(1.0, 1.0, f32::NAN)),
        Aabb::new(Vec3::ZERO, Vec3::INFINITY),
        Aabb::new(Vec3::NEG_INFINITY, Vec3::ZERO),
        Aabb::new(Vec3::INFINITY, Vec3::INFINITY),
    ];
    let frusta = frusta(boxes);
    for subject in &subjects() {
        let name = subject.name;
        let mut pair = Pair::new(subject, &IndexConfig::default(), &frusta, name.to_owned());
        assert_eq!(pair.index.remove(PolygonId(3)), Err(IndexError::Unknown(PolygonId(3))));
        assert_eq!(pair.index.update(PolygonId(3), &good), Err(IndexError::Unknown(PolygonId(3))));
        for (id, bounds) in boxes.iter().enumerate() {
            pair.insert(id, bounds);
        }
        for committed in [false, true] {
            for bounds in &bad {
                let (known, new) = (PolygonId(1), PolygonId(1000));
                assert_eq!(pair.index.insert(new, bounds), Err(IndexError::InvalidBounds(new)), "{name}");
                assert_eq!(pair.index.insert(known, bounds), Err(IndexError::InvalidBounds(known)), "{name}");
                assert_eq!(pair.index.update(known, bounds), Err(IndexError::InvalidBounds(known)), "{name}");
                assert_eq!(pair.index.update(new, bounds), Err(IndexError::Unknown(new)), "{name}");
            }
            let (known, new) = (PolygonId(7), PolygonId(41));
            assert_eq!(pair.index.insert(known, &good), Err(IndexError::Duplicate(known)), "{name}");
            assert_eq!(pair.index.remove(new), Err(IndexError::Unknown(new)), "{name}");
            pair.check(if committed { "refused after commit" } else { "refused before commit" });
        }
        pair.remove(7);
        assert_eq!(pair.index.remove(PolygonId(7)), Err(IndexError::Unknown(PolygonId(7))), "{name}");
        assert_eq!(pair.index.update(PolygonId(7), &good), Err(IndexError::Unknown(PolygonId(7))), "{name}");
        pair.check("removed twice");
    }
}

#[test]
fn any_root_will_do() {
    let roots = [
        Aabb::cube(Vec3::ZERO, 0.0),
        Aabb::cube(Vec3::ZERO, 1.0e-30),
        Aabb::cube(Vec3::splat(1.0e8), 1.0),
        Aabb::cube(Vec3::ZERO, f32::MAX),
        Aabb::new(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX)),
        Aabb::new(Vec3::ZERO, Vec3::new(1.0, 20.0, 3.0)),
        Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY),
        Aabb::cube(Vec3::splat(3.0e38), 1.0e30),
        Aabb::new(Vec3::ONE, Vec3::ZERO),
        Aabb::EMPTY,
        Aabb::new(Vec3::NAN, Vec3::NAN),
    ];
    let all = scenes();
    for name in ["large among small", "strokes", "huge"] {
        let scene = all.iter().find(|scene| scene.name == name).expect("it is among the scenes");
        let frusta = frusta(&scene.boxes);
        for root in roots {
            for subject in &subjects() {
                let config = IndexConfig { root, capacity: 0 };
                let mut pair = Pair::new(subject, &config, &frusta, format!("{} in {root:?}", subject.name));
                scene.boxes.iter().enumerate().for_each(|(id, b)| pair.insert(id, b));
                pair.check(name);
                (0..scene.boxes.len()).step_by(2).for_each(|id| pair.remove(id));
                pair.check(name);
            }
        }
    }
}
