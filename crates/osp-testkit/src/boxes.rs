//! Boxes and views for index tests and benchmarks.

use glam::Vec3;
use osp::math::{Aabb, Frustum, Plane};

/// The SplitMix64 generator (Steele, Lea, Flood, 2014): small, seedable, with the same numbers on every machine.
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    /// Returns the next 64 random bits.
    #[allow(clippy::should_implement_trait, reason = "no iterator: it never ends")]
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Returns a number from 0 to below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// Returns a number from 0 to below 1.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Returns a number from `low` to below `high`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Returns a point in a box.
    pub fn point(&mut self, bounds: &Aabb) -> Vec3 {
        let t = Vec3::new(self.unit(), self.unit(), self.unit());
        bounds.min + (bounds.max - bounds.min) * t
    }

    /// Returns a vector of length 1.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0));
            let squared = v.length_squared();
            if squared > 1.0e-3 && squared <= 1.0 {
                return v / squared.sqrt();
            }
        }
    }
}

/// Returns the cube that contains the synthetic session.
pub fn root() -> Aabb {
    Aabb::cube(Vec3::ZERO, 4.0)
}

/// Returns the boxes of a session of smooth ribbon strokes in [`root`], in the order of drawing. A stroke has 40 to 240
/// quads of about 1 x 2 cm.
pub fn drawn(count: usize, seed: u64) -> Vec<Aabb> {
    let mut rng = Rng(seed);
    let room = Aabb::cube(Vec3::ZERO, 3.9);
    let mut boxes = Vec::with_capacity(count);
    while boxes.len() < count {
        let mut at = rng.point(&room);
        let mut travel = rng.direction();
        let mut bend = rng.direction();
        let mut side = travel.cross(rng.direction()).normalize_or(Vec3::Y);
        for _ in 0..40 + rng.below(200) {
            bend = (bend + rng.direction() * 0.35).normalize_or(Vec3::X);
            travel = (travel + bend * 0.12).normalize_or(Vec3::X);
            side = (side - travel * side.dot(travel)).normalize_or(Vec3::Y);
            let next = at + travel * rng.range(0.015, 0.025);
            if !room.contains(&Aabb::new(next, next)) {
                break;
            }
            let half = side * 0.005;
            boxes.push(Aabb::from_points(&[at - half, at + half, next + half, next - half]));
            at = next;
        }
    }
    boxes.truncate(count);
    boxes
}

/// Returns the same boxes in random order.
pub fn shuffled(mut boxes: Vec<Aabb>, seed: u64) -> Vec<Aabb> {
    let mut rng = Rng(seed);
    for i in (1..boxes.len()).rev() {
        boxes.swap(i, rng.below(i + 1));
    }
    boxes
}

/// Returns a perspective view from `eye` towards `target`.
pub fn view(eye: Vec3, target: Vec3, fov_y_degrees: f32, aspect: f32, near_m: f32, far_m: f32) -> Frustum {
    let forward = (target - eye).normalize_or(Vec3::NEG_Z);
    let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let up = right.cross(forward);
    let half_y = (fov_y_degrees.to_radians() * 0.5).tan();
    let half_x = half_y * aspect;
    let through_eye = |normal: Vec3| Plane::from_point_normal(eye, normal.normalize());
    Frustum::new([
        through_eye(forward * half_x + right),
        through_eye(forward * half_x - right),
        through_eye(forward * half_y + up),
        through_eye(forward * half_y - up),
        Plane::from_point_normal(eye + forward * near_m, forward),
        Plane::from_point_normal(eye + forward * far_m, -forward),
    ])
}

/// Returns views of a model in `bounds`, from outside towards the model or from its middle.
pub fn views(bounds: &Aabb, count: usize, from: Place, seed: u64) -> Vec<Frustum> {
    let mut rng = Rng(seed);
    let center = bounds.center();
    let size = bounds.extent().max_element().max(1.0e-3);
    (0..count)
        .map(|_| match from {
            Place::Outside => {
                let eye = center + rng.direction() * size * rng.range(0.9, 1.1);
                view(eye, center + rng.direction() * size * 0.1, 60.0, 1.5, size * 0.01, size * 10.0)
            }
            Place::Inside => {
                let eye = center + rng.direction() * size * rng.range(0.0, 0.25);
                view(eye, eye + rng.direction(), 60.0, 1.5, size * 0.002, size * 10.0)
            }
        })
        .collect()
}

/// Position of a view's eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Around the model.
    Outside,
    /// In the middle of the model.
    Inside,
}
