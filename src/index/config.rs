use glam::Vec3;

use crate::math::Aabb;

/// What an index is told before the first polygon comes. Every polygon is accepted whatever it says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexConfig {
    /// The modelling volume, a cube in world space.
    pub root: Aabb,
    /// Polygons to have room for at once, so that growing does not fall into a frame.
    pub capacity: usize,
}

impl Default for IndexConfig {
    /// The 4 m cube standing on the floor, room for 100,000 polygons.
    fn default() -> Self {
        Self { root: Aabb::cube(Vec3::new(0.0, 1.5, 0.0), 4.0), capacity: 100_000 }
    }
}
