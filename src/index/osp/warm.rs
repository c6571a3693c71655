//! Runs the code of a growing tree once in a process, before a frame needs it.

use std::sync::Once;

use glam::Vec3;

use super::index::Osp;
use crate::{
    index::{Backend, IndexConfig, SpatialIndex},
    math::{Aabb, Frustum, Plane},
    polygon::{BLOCK, PolygonId, VisibleBlocks},
};

static ONCE: Once = Once::new();

/// Number of polygons of the small model. It is enough for a tree, and for a leaf that is split.
const POLYGONS: u32 = 1024;
/// Number of polygons of a frame.
const A_FRAME: u32 = 16;

impl Osp {
    /// Grows a small model and queries it in each frame. Otherwise the frame in which the tree gets its first leaf would wait
    /// until the system and the processor have loaded this code. Only the first call in a process does anything.
    pub(super) fn warm_up(backend: Backend) {
        ONCE.call_once(|| grow(backend));
    }
}

fn grow(backend: Backend) {
    let config = IndexConfig { root: Aabb::cube(Vec3::ZERO, 2.0), capacity: POLYGONS as usize };
    let mut index = Osp::empty(&config, backend).with_most_in_order(0);
    // These planes cut the model, so that nodes, leaves and runs are tested.
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|normal| Plane { normal, d: 0.5 });
    let view = Frustum::new([x, y, z, x, y, z]);
    let (mut ids, mut visible) = (Vec::new(), VisibleBlocks::new());
    for first in (0..POLYGONS).step_by(A_FRAME as usize) {
        for number in first..first + A_FRAME {
            let angle = number as f32 * 0.1;
            let center = Vec3::new(angle.cos(), angle.sin(), angle.sin() * angle.cos());
            // Each polygon is in a block of its own, and therefore in a run of its own.
            let inserted = index.insert(PolygonId(number * BLOCK as u32), &Aabb::cube(center, 0.05));
            debug_assert_eq!(inserted, Ok(()));
        }
        index.commit();
        ids.clear();
        index.frustum_cull(&view, &mut ids);
        index.frustum_cull_blocks(&view, &mut visible);
    }
}
