use glam::Vec3;

use crate::math::Aabb;

/// Expected extent and size of a model. Hints only: polygons outside `root` and beyond `capacity` are inserted and found, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexConfig {
    /// A cube that contains most future polygons, world space, metres. `Osp` adds levels above this cube for polygons
    /// outside of it. If the box is empty, not finite, or at most `1.2e-30` large, `Osp` uses the cube of four metres
    /// around the origin.
    pub root: Aabb,
    /// Number of polygons to reserve memory for, at most [`IndexConfig::MOST_RESERVED`]. With at most this number of
    /// polygons no frame of `Osp` allocates. The ids must be below four million, and lie in at most `capacity / 8`
    /// blocks of sixteen. Up to a million polygons may be inserted, removed and moved in any order. In a larger model,
    /// most polygons must be neighbours in space, as in strokes.
    pub capacity: usize,
}

impl IndexConfig {
    /// Upper bound of the reserved capacity: the largest number of polygons in a recorded session. Memory for further
    /// polygons is allocated in steps. If this is larger, a mistaken capacity takes more memory.
    pub const MOST_RESERVED: usize = 1 << 22;

    /// Number of polygons to reserve memory for: `capacity`, at most [`IndexConfig::MOST_RESERVED`].
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
