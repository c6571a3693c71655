use glam::Vec3;

use crate::math::Aabb;

/// Expected extent and size of a model. Hints only: polygons outside `root` and beyond `capacity` are inserted and found, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexConfig {
    /// A cube around most future polygons, world space, metres. `Osp` adds levels above it for polygons outside. For a box that is
    /// empty, not finite, or at most `1.2e-30` large, it takes the cube of four metres around the origin.
    pub root: Aabb,
    /// Polygons to reserve memory for, so that no frame allocates; at most [`IndexConfig::MOST_RESERVED`]. `Osp` keeps this promise
    /// for numbers below four million, in at most an eighth as many blocks of sixteen. Up to a million polygons may come, go and
    /// move in any way. Beyond that most must lie side by side, as in strokes. For scattered polygons `Osp` returns the memory
    /// reserved for strokes.
    pub capacity: usize,
}

impl IndexConfig {
    /// Upper bound of the reserved capacity: as many polygons as a recorded session may have. Beyond it memory grows in steps.
    /// Larger: a mistaken capacity takes more memory.
    pub const MOST_RESERVED: usize = 1 << 22;

    /// Polygons to reserve memory for.
    pub fn room(&self) -> usize {
        self.capacity.min(Self::MOST_RESERVED)
    }
}

impl Default for IndexConfig {
    /// The 4 m cube standing on the floor, room for 100,000 polygons.
    fn default() -> Self {
        Self { root: Aabb::cube(Vec3::new(0.0, 1.5, 0.0), 4.0), capacity: 100_000 }
    }
}
