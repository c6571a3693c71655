use glam::Vec3;

use crate::math::Aabb;

/// What an index should expect. A hint only: polygons outside `root` and beyond `capacity` are inserted and found, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexConfig {
    /// A cube in world space, around most of what will come. `Osp` adds levels above it for what lies outside.
    pub root: Aabb,
    /// Polygons to reserve memory for, so that no frame has to.
    pub capacity: usize,
}

impl Default for IndexConfig {
    /// The 4 m cube standing on the floor, room for 100,000 polygons.
    fn default() -> Self {
        Self { root: Aabb::cube(Vec3::new(0.0, 1.5, 0.0), 4.0), capacity: 100_000 }
    }
}
