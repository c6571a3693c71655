//! Displacement of the three lines of an electric bolt from the stroke.

use glam::Vec3;

/// Half the width to which [`STRENGTH_M`] applies, metres.
const HALF_WIDTH_M: f32 = 0.002;
/// Largest displacement along one axis for a stroke of half width [`HALF_WIDTH_M`], metres: by slow noise (8 mm root
/// mean square), and by fast noise (6 mm).
const STRENGTH_M: [f32; 2] = [0.022, 0.0155];

/// Displacement of line 0, 1 or 2 at a point of the stroke. It depends only on the point, and is at most some
/// centimetres for the brush's sizes.
pub(super) fn displacement_m(at: Vec3, half_width_m: f32, copy: usize) -> Vec3 {
    let wideness = half_width_m / HALF_WIDTH_M;
    if !(wideness > 1.0e-6 && wideness < 1.0e6) {
        return Vec3::ZERO;
    }
    // The unit is a decimetre for a stroke of half width `HALF_WIDTH_M`. Wider bolts have larger curves.
    let p = at * (10.0 / wideness);
    let frequency = [1.1, 1.433, 1.87][copy.min(2)];
    let slow = noise(p * frequency, 3 * copy as u32);
    let fast = noise(p * (frequency + 0.1), 100 + 3 * copy as u32);
    (slow * STRENGTH_M[0] + fast * STRENGTH_M[1]) * wideness
}

/// Three components of smooth noise, each from -1 to 1, by interpolation of random values at the corners of unit cubes.
fn noise(p: Vec3, salt: u32) -> Vec3 {
    let cell = p.floor();
    let part = p - cell;
    let ease = part * part * (Vec3::splat(3.0) - 2.0 * part);
    let mut sum = Vec3::ZERO;
    for corner in 0..8_u32 {
        let is_far = [corner & 1, corner >> 1 & 1, corner >> 2].map(|bit| bit == 1);
        let weight: f32 =
            (0..3).map(|axis| if is_far[axis] { ease[axis] } else { 1.0 - ease[axis] }).product();
        // Casts saturate, so the noise is constant far from the origin.
        let place = [0, 1, 2].map(|axis| (cell[axis] as i32).wrapping_add(i32::from(is_far[axis])) as u32);
        sum += weight * at_corner(place, salt);
    }
    sum
}

fn at_corner([x, y, z]: [u32; 3], salt: u32) -> Vec3 {
    let seed = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
    let random = super::random::Random::new(seed);
    Vec3::from_array([0, 1, 2].map(|axis| random.around_zero(salt + axis, 1.0)))
}
