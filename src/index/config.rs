use glam::Vec3;

use crate::math::Aabb;

/// What an index should expect. A hint only: polygons outside `root` and beyond `capacity` are inserted and found, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexConfig {
    /// A cube in world space, around most of what will come, metres. `Osp` adds levels above it for what lies outside. For a
    /// box that is empty, not finite, or not larger than `1.2e-30` it takes the cube of four metres around the origin.
    pub root: Aabb,
    /// Polygons to reserve memory for, so that no frame allocates; at most [`IndexConfig::MOST_RESERVED`]. With `Osp` no frame
    /// allocates while no more polygons are there, with numbers below four millions in at most an eighth as many blocks of
    /// sixteen. Up to a million polygons may come, go and move in any way. Of more, most must lie side by side, as those of a
    /// stroke do. Of polygons that come from everywhere it gives room for strokes back.
    pub capacity: usize,
}

impl IndexConfig {
    /// The most polygons that an index reserves memory for, whatever its capacity: as many as a recorded session may have. Beyond
    /// this, memory grows in steps as polygons come. Larger: a mistaken capacity takes more memory.
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
