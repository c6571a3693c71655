use glam::{Vec3, Vec4};

use super::tuning::{CELL_STRETCH, FLAT_LEVELS};
use crate::{index::simd::Wide, math::Aabb};

/// The grid of the tree's cells in integer coordinates. The edge of a cell of level `shift` is `2^shift` finest cells long.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    origin: [f64; 3],
    finest_per_m: f64,
    /// `origin` and `finest_per_m` in single precision, for boxes in the root cube.
    near_origin: Vec4,
    near_finest_per_m: f32,
}

/// A position, in finest cells along each axis.
pub(super) type Key = [u64; 3];

/// Level of the root cube, which is `2^20` finest cells wide: for a cube of 4 m, a finest cell is 4 µm wide.
pub(super) const ROOT_SHIFT: u32 = 20;

/// Level of the largest possible cell, `2^38` root cubes wide. Positions outside of it are clamped to its outermost cells.
pub(super) const TOP_SHIFT: u32 = 58;

/// Position of the root cube along each axis, in root cubes. Its bits alternate, so that successive doublings extend
/// the top cell alternately to both sides.
const BIAS: u64 = 0x15_5555_5555;

/// Number of preallocated entries: one for the root cube, and one for each cell of `levels` levels below it.
pub(super) const fn flat_entries(levels: u32) -> usize {
    ((1 << (3 * (levels + 1))) - 1) / 7
}

impl Grid {
    pub(super) fn new(root: &Aabb) -> Self {
        let size = root.extent().max_element();
        let usable = root.is_valid() && size.is_finite() && size > f32::MIN_POSITIVE * 1.0e8;
        let root = if usable { *root } else { Aabb::cube(Vec3::ZERO, 4.0) };
        let size_m = root.extent().max_element();
        let finest = 1u32 << ROOT_SHIFT;
        Self {
            origin: root.min.to_array().map(f64::from),
            finest_per_m: f64::from(finest) / f64::from(size_m),
            near_origin: root.min.extend(root.min.z),
            near_finest_per_m: finest as f32 / size_m,
        }
    }

    /// The finest cell that contains a box's centre.
    #[inline]
    pub(super) fn key(&self, bounds: Wide) -> Key {
        let cells = (bounds.center() - self.near_origin) * self.near_finest_per_m;
        let inside = cells.cmpge(Vec4::ZERO) & cells.cmplt(Vec4::splat((1u32 << ROOT_SHIFT) as f32));
        if inside.all() {
            return cells.truncate().to_array().map(|k| (BIAS << ROOT_SHIFT) + k as u32 as u64);
        }
        self.far_key(&bounds.to_box())
    }

    /// Does the same as [`Grid::key`] for boxes outside the root cube.
    #[cold]
    fn far_key(&self, bounds: &Aabb) -> Key {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        std::array::from_fn(|axis| {
            let center = (f64::from(min[axis]) + f64::from(max[axis])) * 0.5;
            let offset = floor((center - self.origin[axis]) * self.finest_per_m);
            let bias = (BIAS << ROOT_SHIFT) as i64;
            offset.clamp(-bias, (1 << TOP_SHIFT) - 1 - bias).wrapping_add(bias) as u64
        })
    }

    /// The lowest level whose cells are large enough for a box.
    #[inline]
    pub(super) fn level_for(&self, bounds: Wide) -> u32 {
        let cells = bounds.length() * (self.near_finest_per_m / CELL_STRETCH);
        // The exponent of `cells`, rounded up to the next power of two.
        let exponent = (cells.to_bits() >> 23) as i32 - 126;
        exponent.clamp(0, TOP_SHIFT as i32) as u32
    }

    /// The entry of a cell in the preallocated levels; `None` if the cell lies outside of them.
    #[inline]
    pub(super) fn flat_entry(levels: u32, key: &Key, shift: u32) -> Option<usize> {
        if !(ROOT_SHIFT - levels..=ROOT_SHIFT).contains(&shift) {
            return None;
        }
        Some(flat_entry_at(morton_in_root(key)?, ROOT_SHIFT - shift))
    }

    /// The finest cell at the root cube's lowest corner.
    pub(super) fn root_key() -> Key {
        [BIAS << ROOT_SHIFT; 3]
    }
}

/// Computes `value.floor() as i64` without a call. On targets that may lack the instruction, the call takes longer than
/// the rest of [`Grid::far_key`].
#[inline]
fn floor(value: f64) -> i64 {
    let towards_zero = value as i64;
    towards_zero.saturating_sub(i64::from(value < towards_zero as f64))
}

/// Number of the octant of a cell of level `shift` that contains the key: bit 0 for x, bit 1 for y, bit 2 for z.
#[inline]
pub(super) fn octant(key: &Key, shift: u32) -> usize {
    let bit = |axis: usize| (key[axis] >> (shift - 1) & 1) as usize;
    bit(0) | bit(1) << 1 | bit(2) << 2
}

/// Whether two keys lie in the same cell of level `shift`.
#[inline]
pub(super) fn same_cell(a: &Key, b: &Key, shift: u32) -> bool {
    (0..3).all(|axis| (a[axis] ^ b[axis]) >> shift == 0)
}

/// The Morton code of the deepest preallocated cell that contains a key; `None` outside the root cube.
#[inline]
pub(super) fn morton_in_root(key: &Key) -> Option<u32> {
    let [x, y, z] = key.map(|k| k.wrapping_sub(BIAS << ROOT_SHIFT));
    if (x | y | z) >> ROOT_SHIFT != 0 {
        return None;
    }
    let spread = |k: u64| SPREAD[(k >> (ROOT_SHIFT - FLAT_LEVELS)) as usize & (SPREAD.len() - 1)];
    Some(spread(x) | spread(y) << 1 | spread(z) << 2)
}

/// The entry of the cell on this preallocated level that contains the deepest preallocated cell `morton`.
#[inline]
pub(super) fn flat_entry_at(morton: u32, level: u32) -> usize {
    FLAT_START[level as usize] + (morton >> (3 * (FLAT_LEVELS - level))) as usize
}

/// First entry of each preallocated level.
const FLAT_START: [usize; FLAT_LEVELS as usize + 1] = {
    let mut table = [0; FLAT_LEVELS as usize + 1];
    let mut level = 0;
    while level < table.len() {
        table[level] = ((1 << (3 * level)) - 1) / 7;
        level += 1;
    }
    table
};

/// The bits of each number, spread with two zeros between neighbouring bits.
static SPREAD: [u32; 1 << FLAT_LEVELS] = {
    let mut table = [0; 1 << FLAT_LEVELS];
    let mut i = 0;
    while i < table.len() {
        let mut bit = 0;
        while bit < FLAT_LEVELS {
            table[i] |= ((i >> bit & 1) as u32) << (3 * bit);
            bit += 1;
        }
        i += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn floor_is_that_of_the_standard_library(value: f64, small in -1.0e6..1.0e6_f64, whole in -9_i32..9) {
            for value in [value, small, f64::from(whole), f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0] {
                prop_assert_eq!(floor(value), value.floor() as i64);
            }
        }
    }
}
