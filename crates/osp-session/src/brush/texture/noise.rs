//! Random numbers and noise for generated textures, equal on every machine.

/// A pseudo-random number from 0 to 1 for a cell.
pub(crate) fn random(x: i32, y: i32, seed: u32) -> f32 {
    let mut n = (x as u32).wrapping_mul(0x9E37_79B9)
        ^ (y as u32).wrapping_mul(0x85EB_CA6B)
        ^ seed.wrapping_mul(0xC2B2_AE35);
    n ^= n >> 16;
    n = n.wrapping_mul(0x7FEB_352D);
    n ^= n >> 15;
    n = n.wrapping_mul(0x846C_A68B);
    n ^= n >> 16;
    n as f32 / u32::MAX as f32
}

/// Smooth noise from 0 to 1 with period 1 along each axis. `cells` is the number of lattice cells of a period along
/// each axis.
pub fn noise(x: f32, y: f32, cells: (i32, i32), seed: u32) -> f32 {
    let (x, y) = (x * cells.0 as f32, y * cells.1 as f32);
    let (left, low) = (x.floor(), y.floor());
    let at = |i: i32, j: i32| {
        random((left as i32 + i).rem_euclid(cells.0), (low as i32 + j).rem_euclid(cells.1), seed)
    };
    let [s, t] = [x - left, y - low].map(|v| v * v * (3.0 - 2.0 * v));
    mix(mix(at(0, 0), at(1, 0), s), mix(at(0, 1), at(1, 1), s), t)
}

/// A sum of `count` noises. Each noise has half the cell size and half the weight of the noise before it.
pub fn octaves(x: f32, y: f32, cells: (i32, i32), count: u32, seed: u32) -> f32 {
    let (mut sum, mut weights, mut weight) = (0.0, 0.0, 1.0);
    for octave in 0..count {
        let cells = (cells.0 << octave, cells.1 << octave);
        sum += weight * noise(x, y, cells, seed + octave);
        weights += weight;
        weight *= 0.5;
    }
    sum / weights
}

pub(crate) fn mix(a: f32, b: f32, part: f32) -> f32 {
    a + (b - a) * part
}

/// A smooth step: 0 at and below `from`, 1 at and above `to`.
pub fn step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation at `x` between points: their positions, ascending, and the values there.
pub fn on_line<const N: usize>([at, values]: &[[f32; N]; 2], x: f32) -> f32 {
    match at.partition_point(|&at| at <= x) {
        0 => values[0],
        after if after == N => values[N - 1],
        after => {
            let [from, to] = [at[after - 1], at[after]];
            mix(values[after - 1], values[after], (x - from) / (to - from))
        }
    }
}
