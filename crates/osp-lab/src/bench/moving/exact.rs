//! Polygons that must be visible, and polygons that must not be, computed without any structure.

use glam::{Affine3A, DVec3, Vec3};

use super::world::World;
use osp::{
    math::{Aabb, Frustum, clip_convex},
    polygon::{PolygonId, VisibleBlocks},
};

/// Largest displacement of a corner or a plane by single precision, as a fraction of the model's size.
const ROUNDING: f64 = 1.0e-5;

/// The polygons of which at least one point is certainly in view.
pub(super) fn seen(world: &World<'_>, frame: u64, frustum: &Frustum) -> VisibleBlocks {
    let margin_m = ROUNDING * f64::from(world.model.around().extent().length());
    let (mut part_of, mut rest) = (Vec::new(), Vec::new());
    let mut all = VisibleBlocks::new();
    for part in &world.parts {
        let place = world.place(part, frame);
        for (id, polygon) in part.ids().zip(world.polygons(part, place)) {
            part_of.clear();
            part_of.extend(polygon.vertices().iter().map(|p| p.as_dvec3()));
            for plane in frustum.planes() {
                let inside_m = |p: DVec3| plane.normal.as_dvec3().dot(p) + f64::from(plane.d) - margin_m;
                rest.clear();
                clip_convex(&part_of, inside_m, |p| rest.push(p));
                std::mem::swap(&mut part_of, &mut rest);
            }
            if !part_of.is_empty() {
                all.insert(PolygonId(id as u32));
            }
        }
    }
    all
}

/// The polygons whose box, transformed from the model's space by the motion of their part and grown by the rounding
/// margin, intersects the view. No group index may report other polygons.
pub(super) fn may_be_seen(world: &World<'_>, frame: u64, frustum: &Frustum) -> VisibleBlocks {
    let margin = Vec3::splat(10.0 * ROUNDING as f32 * world.model.around().extent().length());
    let mut all = VisibleBlocks::new();
    for part in &world.parts {
        let place: Affine3A = world.place(part, frame);
        for (id, bounds) in part.ids().zip(&world.model.boxes[part.mesh.clone()]) {
            let around = Aabb::from_points(&bounds.corners().map(|p| place.transform_point3(p)));
            if frustum.may_see(&Aabb { min: around.min - margin, max: around.max + margin }) {
                all.insert(PolygonId(id as u32));
            }
        }
    }
    all
}

/// Whether all polygons of `of` are in `all`.
pub(super) fn is_within(of: &VisibleBlocks, all: &VisibleBlocks) -> bool {
    of.blocks().all(|(block, mask)| mask & !all.mask(block) == 0)
}
