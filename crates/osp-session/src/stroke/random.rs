use glam::Vec3;

/// The random numbers of a stroke: a function of seed and salt, independent of the order of calls.
///
/// Source: Chris Wellons' hash "lowbias32" (public domain), as in Open Brush.
#[derive(Clone, Copy, Debug)]
pub(super) struct Random {
    seed: u32,
}

impl Random {
    pub(super) fn new(seed: u32) -> Self {
        Self { seed }
    }

    /// A number from 0 to below 1.
    pub(super) fn unit(self, salt: u32) -> f32 {
        let mut x = self.seed ^ salt;
        x ^= x >> 16;
        x = x.wrapping_mul(0x7feb_352d);
        x ^= x >> 15;
        x = x.wrapping_mul(0x846c_a68b);
        x ^= x >> 16;
        // 24 bits fit an f32, so the result is never 1.
        (x >> 8) as f32 / (1 << 24) as f32
    }

    pub(super) fn around_zero(self, salt: u32, half_range: f32) -> f32 {
        half_range * (2.0 * self.unit(salt) - 1.0)
    }

    /// A unit vector; uses two salts. The sign of z is opposite to that in Open Brush, whose z axis has the opposite
    /// direction.
    pub(super) fn on_sphere(self, salt: u32) -> Vec3 {
        let z = 1.0 - 2.0 * self.unit(salt);
        let (sin, cos) = libm::sincosf(std::f32::consts::TAU * self.unit(salt.wrapping_add(1)));
        let ring = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(ring * cos, ring * sin, z)
    }

    /// A point of the unit ball; uses three salts.
    pub(super) fn in_ball(self, salt: u32) -> Vec3 {
        self.on_sphere(salt) * libm::cbrtf(self.unit(salt.wrapping_add(2)))
    }
}
