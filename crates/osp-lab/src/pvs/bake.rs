use glam::{Quat, Vec3};

use super::{GROUP, ViewCells, words_of};
use crate::{oracle::OracleConfig, verify::visible_polygons};
use osp::{
    index::SpatialIndex,
    math::Aabb,
    polygon::bits,
    view::{Projection, View},
};
use osp_session::scene::Scene;

/// Near distance of the views, metres.
const NEAR_M: f32 = 0.01;

/// Settings of a [`Baker`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeConfig {
    /// Number of sample points of a cell: the middle, then the corners, then evenly distributed points. Each point has
    /// pictures in all six directions.
    pub samples: u32,
    /// Width and height of each of the six pictures from a point, pixels.
    pub pixels: u32,
}

impl Default for BakeConfig {
    /// Nine points, 512 x 512 pixels.
    fn default() -> Self {
        Self { samples: 9, pixels: 512 }
    }
}

/// Computes the sets of cells. Several threads may compute cells simultaneously.
pub struct Baker<'a> {
    scene: &'a Scene,
    cells: ViewCells,
    config: BakeConfig,
    far_m: f32,
}

impl std::fmt::Debug for Baker<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Baker")
            .field("cells", &self.cells)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

impl<'a> Baker<'a> {
    /// A baker for a finished model; `bounds` contains the whole model.
    pub fn new(scene: &'a Scene, bounds: &Aabb, cells: ViewCells, config: BakeConfig) -> Self {
        let ends = cells.min + cells.count.as_vec3() * cells.side_m;
        let all = bounds.union(&Aabb { min: cells.min, max: ends });
        Self { scene, cells, config, far_m: all.extent().length().max(1.0) * 1.01 }
    }

    /// The groups of polygons that are visible from a cell, one bit per group. `index` must contain every polygon and
    /// be committed. O(samples x (pixels squared + polygons)).
    pub fn cell(&self, cell: usize, index: &dyn SpatialIndex) -> Vec<u64> {
        let mut groups = vec![0u64; words_of(self.scene.polygon_count())];
        let mut in_view = Vec::new();
        let pixels = self.config.pixels as usize;
        let oracle = OracleConfig { width: pixels, height: pixels };
        for sample in 0..self.config.samples.max(1) {
            let eye = self.cells.corner(cell) + place_in_cell(sample) * self.cells.side_m;
            for world_from_view in all_round() {
                let projection = Projection::symmetric(90.0, 1.0, NEAR_M, self.far_m);
                let view = View { eye_in_world: eye, world_from_view, projection };
                let Some(window) = view.window() else { continue };
                in_view.clear();
                index.frustum_cull(&view.frustum(), &mut in_view);
                for id in visible_polygons(self.scene, &window, &in_view, oracle) {
                    let group = id.index() / GROUP;
                    bits::insert(&mut groups, group);
                }
            }
        }
        groups
    }
}

/// The directions to the six faces of a cube.
fn all_round() -> [Quat; 6] {
    use std::f32::consts::{FRAC_PI_2, PI};
    [
        Quat::IDENTITY,
        Quat::from_rotation_y(FRAC_PI_2),
        Quat::from_rotation_y(PI),
        Quat::from_rotation_y(-FRAC_PI_2),
        Quat::from_rotation_x(FRAC_PI_2),
        Quat::from_rotation_x(-FRAC_PI_2),
    ]
}

/// Sample point number `sample` of a cell, with coordinates from 0 to 1. The first point is the middle. The
/// corners follow, because they see most of the polygons that the middle does not see. The further points are the
/// sequence R3 of M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
fn place_in_cell(sample: u32) -> Vec3 {
    match sample {
        0 => Vec3::splat(0.5),
        1..=8 => {
            // Each odd corner of this list is followed by the opposite corner.
            let corner = [0, 7, 3, 4, 5, 2, 6, 1][sample as usize - 1];
            Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2 & 1) as f32)
        }
        _ => {
            let n = (sample - 8) as f32;
            Vec3::new(0.819_172_5 * n, 0.671_043_6 * n, 0.549_700_5 * n).fract()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_different_points_of_the_cell() {
        let points: Vec<Vec3> = (0..64).map(place_in_cell).collect();
        for (i, p) in points.iter().enumerate() {
            assert!(p.cmpge(Vec3::ZERO).all() && p.cmple(Vec3::ONE).all(), "{p}");
            assert!(points[..i].iter().all(|q| q.distance(*p) > 0.02), "{i}: {p}");
        }
    }
}
