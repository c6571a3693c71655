use glam::Vec3;

use super::tuning::{CELL_STRETCH, FLAT_LEVELS};
use crate::math::Aabb;

/// The cells of the tree as whole numbers. A cell of level `shift` has an edge of `2^shift` finest cells.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    origin: [f64; 3],
    finest_per_m: f64,
}

/// A place in finest cells.
pub(super) type Key = [u64; 3];

/// Level of the root cube: it is `2^20` finest cells wide (4 µm for a cube of 4 m).
pub(super) const ROOT_SHIFT: u32 = 20;

/// Level of the widest cell there can be: `2^38` root cubes. What lies farther out is filed in its outermost cells.
pub(super) const TOP_SHIFT: u32 = 58;

/// The root cube's place, in root cubes, along each axis. Alternating bits: every second doubling adds room on the
/// one side, every other on the other side.
const BIAS: u64 = 0x15_5555_5555;

/// Entries of the preallocated levels.
pub(super) const FLAT_ENTRIES: usize = ((1 << (3 * (FLAT_LEVELS + 1))) - 1) / 7;

impl Grid {
    pub(super) fn new(root: &Aabb) -> Self {
        let size = root.extent().max_element();
        let usable = root.is_valid() && size.is_finite() && size > f32::MIN_POSITIVE * 1.0e8;
        let root = if usable { *root } else { Aabb::cube(Vec3::ZERO, 4.0) };
        let size_m = f64::from(root.extent().max_element());
        Self {
            origin: root.min.to_array().map(f64::from),
            finest_per_m: f64::from(1u32 << ROOT_SHIFT) / size_m,
        }
    }

    /// The finest cell of a box's centre.
    #[inline]
    pub(super) fn key(&self, bounds: &Aabb) -> Key {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        std::array::from_fn(|axis| {
            let center = (f64::from(min[axis]) + f64::from(max[axis])) * 0.5;
            let offset = ((center - self.origin[axis]) * self.finest_per_m).floor() as i64;
            let bias = (BIAS << ROOT_SHIFT) as i64;
            offset.clamp(-bias, (1 << TOP_SHIFT) - 1 - bias).wrapping_add(bias) as u64
        })
    }

    /// The finest level at which the box counts as small enough for a cell.
    #[inline]
    pub(super) fn level_for(&self, bounds: &Aabb) -> u32 {
        let e = bounds.extent();
        let cells = f64::from(e.max_element()) * self.finest_per_m / f64::from(CELL_STRETCH);
        // The exponent of `cells`, rounded up to the next power of two.
        let exponent = (cells.to_bits() >> 52) as i64 - 1022;
        exponent.clamp(0, i64::from(TOP_SHIFT)) as u32
    }

    /// The entry of a preallocated cell, if it is one.
    #[inline]
    pub(super) fn flat_entry(key: &Key, shift: u32) -> Option<usize> {
        let inside = key.iter().all(|k| k >> ROOT_SHIFT == BIAS);
        if !inside || !(ROOT_SHIFT - FLAT_LEVELS..=ROOT_SHIFT).contains(&shift) {
            return None;
        }
        let level = ROOT_SHIFT - shift;
        let [x, y, z] = key.map(|k| (k >> shift) as usize & ((1 << level) - 1));
        let before = ((1usize << (3 * level)) - 1) / 7;
        Some(before + (((z << level) | y) << level | x))
    }

    /// The finest cell of the root cube's smallest corner.
    pub(super) fn root_key() -> Key {
        [BIAS << ROOT_SHIFT; 3]
    }
}

/// Which of the eight parts of a cell of level `shift` a key lies in.
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
