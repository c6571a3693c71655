//! Random numbers in double precision.

use glam::DVec3;

use crate::boxes::Rng;

/// The numbers of [`Rng`] in the forms that models need.
#[derive(Clone, Debug)]
pub struct Random(Rng);

impl Random {
    /// Creates a generator. Equal seeds give equal numbers.
    pub fn new(seed: u64) -> Self {
        Self(Rng(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5bf0_3635))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next()
    }

    /// Returns a number from 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number from `low` to below `high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a number from 0 to below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Returns a number from `low` to `high`, both above 0, evenly distributed over the exponents.
    pub fn log_range(&mut self, low: f64, high: f64) -> f64 {
        self.range(low.ln(), high.ln()).exp()
    }

    /// Returns a point in the cube from -1 to 1.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0))
    }

    /// Returns a vector of length 1.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if v.length_squared() > 1.0e-4 && v.length_squared() <= 1.0 {
                return v.normalize();
            }
        }
    }
}
