//! A batch of updates has the same result as one update after the other: the same polygons in queries, the same refusals in
//! the same order, whatever comes and goes in between.

use super::{
    Pair,
    scenes::frusta,
    subjects::{Subject, subjects},
};
use glam::Vec3;
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_testkit::boxes::{Rng, drawn};

/// An index that gets batches, an index that gets single updates, and brute force.
struct Trio<'a> {
    pair: Pair<'a>,
    of_each: Box<dyn SpatialIndex>,
    random: Rng,
}

impl<'a> Trio<'a> {
    fn new(subject: &Subject, boxes: &[Aabb], frusta: &'a [Frustum]) -> Self {
        let config = IndexConfig { capacity: 64, ..IndexConfig::default() };
        let mut pair = Pair::new(subject, &config, frusta, format!("{}, batches", subject.name));
        let mut of_each = (subject.make)(&config);
        for (id, bounds) in boxes.iter().enumerate() {
            pair.insert(id, bounds);
            assert_eq!(of_each.insert(PolygonId(id as u32), bounds), Ok(()));
        }
        Self { pair, of_each, random: Rng(7) }
    }

    fn update_all(&mut self, updates: &[(PolygonId, Aabb)]) {
        let expected = self.pair.update_all(updates);
        let of_each: Vec<_> =
            updates.iter().filter_map(|(id, bounds)| self.of_each.update(*id, bounds).err()).collect();
        assert_eq!(of_each, expected, "{}", self.pair.place);
        let valid = self.pair.index.validate();
        assert_eq!(valid, Ok(()), "{}, before the commit", self.pair.place);
    }

    /// Removes some polygons, and inserts some removed ones again.
    fn come_and_go(&mut self, boxes: &[Aabb]) {
        for _ in 0..boxes.len() / 40 {
            let id = self.random.below(boxes.len());
            let polygon = PolygonId(id as u32);
            if self.of_each.remove(polygon).is_ok() {
                self.pair.remove(id);
            } else {
                assert_eq!(self.of_each.insert(polygon, &boxes[id]), Ok(()));
                self.pair.insert(id, &boxes[id]);
            }
        }
    }

    fn check(&mut self, step: &str) {
        self.pair.check(step);
        self.of_each.commit();
        super::check(&*self.of_each, &self.pair.twin, self.pair.frusta, &format!("of each, {step}"));
    }
}

/// Moves consecutive polygons by the same vector.
fn stretch(random: &mut Rng, boxes: &[Aabb], by_m: f32) -> Vec<(PolygonId, Aabb)> {
    let first = random.below(boxes.len());
    let by = random.direction() * by_m;
    let some = boxes.iter().enumerate().skip(first).take(1 + random.below(200));
    some.map(|(id, b)| (PolygonId(id as u32), Aabb::new(b.min + by, b.max + by))).collect()
}

/// The updates of one frame: consecutive polygons that move together, scattered polygons, boxes that are refused, ids that
/// occur twice or are not in the index.
fn batch(random: &mut Rng, boxes: &[Aabb], frame: usize) -> Vec<(PolygonId, Aabb)> {
    let mut updates = Vec::new();
    for by_m in [0.001, 0.05, 1.5, 40.0] {
        updates.extend(stretch(random, boxes, by_m));
    }
    for _ in 0..boxes.len() / 30 {
        let id = PolygonId(random.below(boxes.len() + 20) as u32);
        let bounds = match random.below(8) {
            0 => Aabb::EMPTY,
            1 => Aabb::new(Vec3::ZERO, Vec3::new(1.0, f32::NAN, 1.0)),
            2 => Aabb::new(Vec3::ZERO, Vec3::INFINITY),
            3 => Aabb::cube(Vec3::ZERO, f32::MAX),
            _ => boxes[random.below(boxes.len())],
        };
        updates.push((id, bounds));
    }
    if frame % 3 == 1 {
        updates.sort_by_key(|(id, _)| *id);
    }
    // Some ids occur again, at once or much later.
    let again: Vec<_> = updates.iter().step_by(5).map(|&(id, b)| (id, Aabb::new(b.max, b.max))).collect();
    updates.extend(again);
    let twice: Vec<_> = updates.iter().take(60).flat_map(|&(id, b)| [(id, Aabb::EMPTY), (id, b)]).collect();
    updates.extend(twice);
    updates
}

fn run(subject: &Subject, boxes: &[Aabb], frames: usize) {
    let frusta: Vec<Frustum> = frusta(&boxes[..100]).into_iter().step_by(4).collect();
    let mut trio = Trio::new(subject, boxes, &frusta);
    trio.check("filled");
    for frame in 0..frames {
        let updates = batch(&mut trio.random, boxes, frame);
        trio.update_all(&updates);
        if frame % 2 == 1 {
            trio.come_and_go(boxes);
            let updates = batch(&mut trio.random, boxes, frame);
            trio.update_all(&updates);
        }
        trio.check(&format!("frame {frame}"));
    }
    // All polygons move in one batch, there and back.
    let by = Vec3::new(0.31, -0.17, 0.05);
    let all = |by: Vec3| -> Vec<_> {
        let moved = boxes.iter().map(|b| Aabb::new(b.min + by, b.max + by));
        (0..).map(PolygonId).zip(moved).collect()
    };
    for (step, by) in [("all moved", by), ("all back", Vec3::ZERO)] {
        trio.update_all(&all(by));
        trio.check(step);
    }
    trio.update_all(&[]);
    trio.check("nothing moved");
}

#[test]
fn every_index_takes_updates_together_as_one_after_the_other() {
    let boxes = drawn(900, 3);
    for subject in &subjects() {
        run(subject, &boxes, 4);
    }
}

/// The polygons are so many that the tree has leaves, which whole runs leave.
#[test]
fn runs_of_a_large_tree_move_between_its_leaves() {
    let boxes = drawn(12_000, 4);
    for subject in
        subjects().iter().filter(|subject| subject.name.starts_with("osp") && !subject.name.contains("paper"))
    {
        run(subject, &boxes, 12);
    }
}

/// Runs that have lost a polygon, and wait for upkeep, move into leaves that split.
#[test]
fn loose_runs_crowd_into_leaves_that_split() {
    // Each block has four runs of four polygons, each at another place.
    let mut random = Rng(11);
    let (runs, at_once) = (4_000, 40);
    let boxes_at = |place: Vec3| (0..4).map(move |i| Aabb::cube(place + Vec3::X * (0.012 * i as f32), 0.01));
    let places: Vec<Vec3> =
        (0..runs).map(|_| random.direction() * (2.0 + 0.002 * random.below(4000) as f32)).collect();
    let boxes: Vec<Aabb> = places.iter().flat_map(|&place| boxes_at(place)).collect();
    let frusta: Vec<Frustum> = frusta(&boxes[..100]).into_iter().step_by(6).collect();
    for subject in
        subjects().iter().filter(|subject| subject.name.starts_with("osp") && !subject.name.contains("paper"))
    {
        let mut trio = Trio::new(subject, &boxes, &frusta);
        trio.check("filled");
        for (step, first) in (0..runs).step_by(at_once).enumerate() {
            let corner = Vec3::splat(0.3) * (step / 25) as f32;
            let mut updates = Vec::new();
            for run in first..first + at_once {
                // The run loses one polygon, two or none. With three of four left the page does not wait for upkeep, with
                // two it does.
                let gone = random.below(4);
                for lane in 0..gone.min(3) {
                    assert!(trio.of_each.remove(PolygonId((run * 4 + lane) as u32)).is_ok());
                    trio.pair.remove(run * 4 + lane);
                }
                let place = corner + random.direction() * (0.001 * random.below(250) as f32);
                let moved = boxes_at(place).enumerate().skip(gone.min(3));
                updates.extend(moved.map(|(lane, b)| (PolygonId((run * 4 + lane) as u32), b)));
            }
            trio.update_all(&updates);
            if step % 3 == 0 {
                trio.check(&format!("step {step}"));
            }
        }
        trio.check("all moved");
    }
}
