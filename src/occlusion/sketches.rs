//! Bounds of occluder candidates in structures of arrays, scored roughly, sixteen at a time.

use glam::Vec3;

use crate::index::simd::{Backend, Kernel, WithKernel};

/// Number of candidates of a block, which are scored together.
const LANES: usize = 16;

/// Bounds and area of a candidate, for the rough selection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sketch {
    pub(super) center: Vec3,
    pub(super) radius_m: f32,
    /// Normal, pointing to either side, with the area as its length, m^2; zero for a free slot.
    pub(super) area_vector: Vec3,
}

impl Sketch {
    /// The sketch of a free slot.
    pub(super) const FREE: Self = Self { center: Vec3::ZERO, radius_m: 0.0, area_vector: Vec3::ZERO };

    pub(super) fn is_free(&self) -> bool {
        self.area_vector == Vec3::ZERO
    }
}

/// Sixteen sketches, a row for each number: centre, radius, area vector.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Block([[f32; LANES]; 7]);

/// A list of sketches.
#[derive(Clone, Debug, Default)]
pub(super) struct Sketches {
    blocks: Vec<Block>,
    len: usize,
}

impl Sketches {
    /// An empty list with room for `sketches` sketches.
    pub(super) fn with_capacity(sketches: usize) -> Self {
        Self { blocks: Vec::with_capacity(sketches.div_ceil(LANES)), len: 0 }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn push(&mut self, sketch: Sketch) {
        if self.len.is_multiple_of(LANES) {
            self.blocks.push(Block([[0.0; LANES]; 7]));
        }
        self.len += 1;
        self.set(self.len - 1, sketch);
    }

    pub(super) fn get(&self, i: usize) -> Sketch {
        let Block(rows) = &self.blocks[i / LANES];
        let [x, y, z, radius_m, a, b, c] = std::array::from_fn(|row| rows[row][i % LANES]);
        Sketch { center: Vec3::new(x, y, z), radius_m, area_vector: Vec3::new(a, b, c) }
    }

    pub(super) fn set(&mut self, i: usize, Sketch { center, radius_m, area_vector }: Sketch) {
        let [x, y, z] = center.to_array();
        let [a, b, c] = area_vector.to_array();
        let Block(rows) = &mut self.blocks[i / LANES];
        for (row, number) in rows.iter_mut().zip([x, y, z, radius_m, a, b, c]) {
            row[i % LANES] = number;
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Sketch> + '_ {
        (0..self.len).map(|i| self.get(i))
    }

    /// Appends score and number of every candidate that may fill enough of a window.
    pub(super) fn score(&self, window: &RoughWindow, out: &mut Vec<(f32, u32)>) {
        Backend::detect().run(Scoring { sketches: self, window, out });
    }
}

/// The data of a window that the rough selection needs, in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughWindow {
    pub(super) eye: Vec3,
    /// Normals of the window's four sides, pointing inwards.
    pub(super) sides: [Vec3; 4],
    pub(super) forward: Vec3,
    pub(super) near_m: f32,
    /// The square of the least solid angle of a candidate by the rough score. `least_bound` is the least solid angle by the
    /// bound from the candidate's sphere.
    pub(super) least_squared: f32,
    pub(super) least_bound: f32,
}

struct Scoring<'a> {
    sketches: &'a Sketches,
    window: &'a RoughWindow,
    out: &'a mut Vec<(f32, u32)>,
}

impl WithKernel for Scoring<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) {
        let Self { sketches, window, out } = self;
        let RoughWindow { eye, sides, forward, near_m, least_squared, least_bound } = *window;
        for (number, Block([cx, cy, cz, radius, ax, ay, az])) in sketches.blocks.iter().enumerate() {
            // These are plain loops over lanes, which the compiler vectorises. Free slots have area 0, and NaN gets no
            // score.
            let mut scores = [0.0_f32; LANES];
            for k in 0..LANES {
                let (x, y, z, r) = (cx[k] - eye.x, cy[k] - eye.y, cz[k] - eye.z, radius[k]);
                let along = |n: Vec3| n.x * x + n.y * y + n.z * z;
                let distance_squared = x * x + y * y + z * z;
                let facing = ax[k] * x + ay[k] * y + az[k] * z;
                let score = facing * facing / (distance_squared * distance_squared * distance_squared);
                // If the eye is inside the bounding sphere, the occluder may fill any part of the window.
                let is_around =
                    (distance_squared <= r * r) & ((ax[k] != 0.0) | (ay[k] != 0.0) | (az[k] != 0.0));
                // No point of the occluder is nearer than its sphere. A flat occluder therefore fills at most this solid
                // angle.
                let nearest = distance_squared.sqrt() - r;
                let is_small = facing.abs() < least_bound * (nearest * nearest * nearest);
                let is_seen = (along(sides[0]) >= -r)
                    & (along(sides[1]) >= -r)
                    & (along(sides[2]) >= -r)
                    & (along(sides[3]) >= -r)
                    & (along(forward) - near_m >= -r);
                let score = if is_around { f32::MAX } else { score };
                let counts = is_seen & (score >= least_squared) & (score > 0.0) & (is_around | !is_small);
                scores[k] = if counts { score } else { 0.0 };
            }
            for (k, &score) in scores.iter().enumerate() {
                if score > 0.0 {
                    out.push((score, (number * LANES + k) as u32));
                }
            }
        }
    }
}
