use glam::DVec3;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Pseudo-random numbers from a seed, the same on every machine (M. O'Neill, "PCG: A Family of Simple Fast
/// Space-Efficient Statistically Good Algorithms for Random Number Generation", 2014; its XSL-RR 128/64).
#[derive(Debug)]
pub(super) struct Random(Pcg64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        // The generator's default stream, written out so that a new version of the library cannot change it.
        Self(Pcg64::new(u128::from(seed), 0x0a02_bdbf_7bb3_c0a7_ac28_fa16_a64a_bf96))
    }

    /// A number from 0 to below 1.
    pub(super) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// A random integer of `0..count`. `count` must be at least 1.
    pub(super) fn index(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }

    pub(super) fn pick<T: Copy, const N: usize>(&mut self, from: [T; N]) -> T {
        from[self.index(N)]
    }

    /// A normally distributed number of mean 0 and standard deviation 1 (Box and Muller, 1958).
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// A log-normally distributed number. The logarithm has this standard deviation, and is clamped to three standard
    /// deviations.
    pub(super) fn log_normal(&mut self, median: f64, deviation: f64) -> f64 {
        median * libm::exp(deviation * self.normal().clamp(-3.0, 3.0))
    }

    /// A unit vector, uniformly distributed over the sphere.
    pub(super) fn direction(&mut self) -> DVec3 {
        let y = self.between(-1.0, 1.0);
        let angle = self.between(0.0, std::f64::consts::TAU);
        let radius = (1.0 - y * y).sqrt();
        DVec3::new(radius * libm::cos(angle), y, radius * libm::sin(angle))
    }

    /// A colour near the given one, rounded to hundredths.
    pub(super) fn color_near(&mut self, (r, g, b): (f64, f64, f64), spread: f64) -> (f32, f32, f32, f32) {
        let light = self.between(-spread, spread);
        let mut channel = |value: f64| {
            let value = (value + light + self.between(-0.3, 0.3) * spread).clamp(0.0, 1.0);
            ((value * 100.0).round() / 100.0) as f32
        };
        (channel(r), channel(g), channel(b), 1.0)
    }
}
