//! Random changes of an index, and of the plain list of its boxes.

use glam::Vec3;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_testkit::boxes::Rng;

use crate::{
    check::{Boxes, check_frusta, check_queries},
    scenes::{TestScene, around, frusta, random_frustum},
    subjects::Subject,
};

/// Boxes that no index takes.
const BAD: [Aabb; 5] = [
    Aabb::EMPTY,
    Aabb { min: Vec3::ONE, max: Vec3::new(1.0, 0.9, 1.0) },
    Aabb { min: Vec3::new(0.0, f32::NAN, 0.0), max: Vec3::ONE },
    Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, f32::NAN) },
    Aabb { min: Vec3::NEG_INFINITY, max: Vec3::ZERO },
];

/// An index and what it should have.
struct Twins<'a> {
    index: Box<dyn SpatialIndex>,
    boxes: Boxes,
    scene: &'a TestScene,
    frusta: Vec<Frustum>,
    random: Rng,
    place: String,
    /// Difference of the ids of neighbours.
    spread: usize,
}

impl Twins<'_> {
    fn insert(&mut self, id: PolygonId, bounds: &Aabb) {
        let expected = match self.boxes.contains_key(&id) {
            _ if id.0 >= PolygonId::LIMIT => Err(IndexError::IdBeyondLimit(id)),
            _ if !bounds.is_valid() => Err(IndexError::InvalidBounds(id)),
            true => Err(IndexError::Duplicate(id)),
            false => Ok(()),
        };
        assert_eq!(self.index.insert(id, bounds), expected, "{}", self.place);
        if expected.is_ok() {
            self.boxes.insert(id, *bounds);
        }
    }

    fn remove(&mut self, id: PolygonId) {
        let expected = self.boxes.remove(&id).map(|_| ()).ok_or(IndexError::Unknown(id));
        assert_eq!(self.index.remove(id), expected, "{}", self.place);
    }

    fn note_update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        let known = self.boxes.get_mut(&id).ok_or(IndexError::Unknown(id))?;
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        *known = *bounds;
        Ok(())
    }

    /// One after the other, or all together.
    fn update(&mut self, updates: &[(PolygonId, Aabb)], together: bool) {
        let mut refused = Vec::new();
        if together {
            self.index.update_all(updates, &mut refused);
        } else {
            refused.extend(updates.iter().filter_map(|(id, bounds)| self.index.update(*id, bounds).err()));
        }
        let expected = updates.iter().filter_map(|(id, bounds)| self.note_update(*id, bounds).err());
        assert_eq!(refused, expected.collect::<Vec<_>>(), "{}", self.place);
    }

    /// Some polygons of the scene: neighbours in either order, scattered ones, or one in three.
    fn some(&mut self) -> Vec<usize> {
        let count = self.scene.boxes.len();
        let most = [3, 20, 200, count][self.random.below(4)].min(count);
        let (first, n) = (self.random.below(count), 1 + self.random.below(most));
        let step = [1, 1, 1, count - 1, 37, 3][self.random.below(6)].max(1);
        (0..n).map(|i| (first + i * step) % count).collect()
    }

    fn id(&self, polygon: usize) -> PolygonId {
        PolygonId((polygon * self.spread) as u32)
    }

    /// The boxes of these polygons after a change of one kind.
    fn moved(&mut self, polygons: &[usize]) -> Vec<(PolygonId, Aabb)> {
        let (kind, boxes) = (self.random.below(7), &self.scene.boxes);
        let far = [1.0e-3, 0.05, 0.5, 3.5, 20.0, 400.0][self.random.below(6)];
        let by = self.random.direction() * far;
        let random = &mut self.random;
        let polygons = polygons.iter().map(|&polygon| {
            let b = boxes[polygon];
            let small = b.extent().min(Vec3::ONE) * 0.25;
            let other = boxes[random.below(boxes.len())];
            let to = match kind {
                0 => b,
                // A little, so that a structure may refit, or all by the same vector.
                1 => Aabb::new(b.min + small, b.max + small),
                2 | 3 => Aabb::new(b.min + by, b.max + by),
                4 => other,
                // A crowd.
                5 => around(by + random.direction() * 0.2, 0.01),
                _ if random.below(4) == 0 => BAD[random.below(BAD.len())],
                _ => around(b.center(), 2.0),
            };
            (PolygonId((polygon * self.spread) as u32), to)
        });
        polygons.collect()
    }

    fn step(&mut self, step: usize) {
        if self.scene.boxes.is_empty() {
            return self.check(step);
        }
        let some = self.some();
        match if step == 0 { 0 } else { self.random.below(13) } {
            0..=3 => some.iter().for_each(|&i| self.insert(self.id(i), &self.scene.boxes[i])),
            4 | 5 => some.iter().for_each(|&i| self.remove(self.id(i))),
            6 => {
                let moved = self.moved(&some);
                self.update(&moved, false);
            }
            7..=9 => {
                // Also what is not there and what occurs twice, and all in one batch.
                let mut moved = self.moved(&some);
                let more = self.some();
                moved.extend(self.moved(&more));
                self.update(&moved, true);
            }
            10 => {
                for (id, bounds) in self.moved(&some) {
                    self.insert(id, &bounds);
                }
            }
            11 if self.random.below(3) == 0 => {
                self.index.clear();
                self.boxes.clear();
            }
            // Time for upkeep.
            _ => (0..40).for_each(|_| self.index.commit()),
        }
        assert_eq!(self.index.validate(), Ok(()), "{}, step {step}", self.place);
        assert_eq!(self.index.len(), self.boxes.len(), "{}, step {step}", self.place);
        // A query before the commit has some answer.
        self.index.box_query(&around(Vec3::ZERO, 1.0e9), &mut Vec::new());
        if self.random.below(3) > 0 {
            self.check(step);
        }
    }

    fn check(&mut self, step: usize) {
        self.index.commit();
        let place = format!("{}, step {step}", self.place);
        assert_eq!(self.index.validate(), Ok(()), "{place}");
        assert_eq!(self.index.len(), self.boxes.len(), "{place}");
        assert_eq!(self.index.is_empty(), self.boxes.is_empty(), "{place}");
        let first = self.random.below(6);
        let mut frusta: Vec<Frustum> = self.frusta.iter().skip(first).step_by(6).copied().collect();
        frusta.push(random_frustum(&mut self.random, &IndexConfig::default().root));
        check_frusta(&*self.index, &self.boxes, &frusta, &place);
        check_queries(&*self.index, &self.boxes, &mut self.random, &place);
    }
}

/// Changes an index in so many steps. Each is validated, and most are committed and compared with the list.
pub(crate) fn change(subject: &Subject, scene: &TestScene, config: &IndexConfig, seed: u64, steps: usize) {
    let mut random = Rng(seed);
    let spread = [1, 1, 1, 5, 16][random.below(5)];
    let place = format!("{}, scene '{}', seed {seed}, {config:?}", subject.name, scene.name);
    let frusta = frusta(&scene.boxes);
    let index = (subject.make)(config);
    let mut twins = Twins { index, boxes: Boxes::new(), scene, frusta, random, place, spread };
    (0..steps).for_each(|step| twins.step(step));
    twins.check(steps);
}
