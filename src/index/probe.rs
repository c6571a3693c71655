//! Box and ray queries that work on every index: the first as a frustum, the second as a walk.

use super::{Node, SpatialIndex, Visit, Visitor, WorkCounts};
use crate::{
    index::DrawList,
    math::{Aabb, Frustum, Plane, Ray},
    scene::PolygonId,
};
use glam::Vec3;

/// A ray goes on looking this much (relative) beyond the nearest hit so far, because a polygon test and a box test
/// round differently. Larger: a few more polygons are asked.
pub(super) const RAY_SLACK: f32 = 1.0e-4;

/// The frustum that sees exactly the boxes which share a point with `bounds`: one product with 1, two with 0 and one
/// difference, whose sign `f32` never gets wrong.
pub(super) fn frustum_of_box(bounds: &Aabb) -> Frustum {
    let plane = |normal: Vec3, d: f32| Plane { normal, d };
    Frustum::new([
        plane(Vec3::X, -bounds.min.x),
        plane(Vec3::Y, -bounds.min.y),
        plane(Vec3::Z, -bounds.min.z),
        plane(Vec3::new(-1.0, 0.0, 0.0), bounds.max.x),
        plane(Vec3::new(0.0, -1.0, 0.0), bounds.max.y),
        plane(Vec3::new(0.0, 0.0, -1.0), bounds.max.z),
    ])
}

/// See [`SpatialIndex::box_query`].
pub(super) fn box_query<I: SpatialIndex + ?Sized>(
    index: &I,
    bounds: &Aabb,
    out: &mut Vec<PolygonId>,
) -> WorkCounts {
    if bounds.min.is_nan() || bounds.max.is_nan() {
        return WorkCounts::default();
    }
    let mut list = DrawList::new();
    std::mem::swap(list.ids_mut(), out);
    let work = index.frustum_cull(&frustum_of_box(bounds), &mut list);
    std::mem::swap(list.ids_mut(), out);
    work
}

/// The nearest hit so far.
pub(super) struct Nearest<'a> {
    hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>,
    t_max: f32,
    found: Option<(PolygonId, f32)>,
}

impl<'a> Nearest<'a> {
    pub(super) fn new(t_max: f32, hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>) -> Self {
        Self { hit, t_max, found: None }
    }

    /// How far boxes are still of interest.
    pub(super) fn reach(&self) -> f32 {
        self.found.map_or(self.t_max, |(_, t)| (t * (1.0 + RAY_SLACK)).min(self.t_max))
    }

    /// Asks a polygon.
    pub(super) fn ask(&mut self, id: PolygonId) {
        let Some(t) = (self.hit)(id).filter(|&t| t <= self.t_max) else { return };
        if self.found.is_none_or(|(other, best)| t < best || (t == best && id < other)) {
            self.found = Some((id, t));
        }
    }

    pub(super) fn found(&self) -> Option<(PolygonId, f32)> {
        self.found
    }
}

struct RayVisitor<'a> {
    ray: &'a Ray,
    nearest: Nearest<'a>,
}

impl Visitor for RayVisitor<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        match self.ray.enter_box(node.bounds, self.nearest.reach()) {
            Some(_) => Visit::Descend,
            None => Visit::Skip,
        }
    }

    fn polygons(&mut self, ids: &[PolygonId], _asked: Visit) {
        for &id in ids {
            self.nearest.ask(id);
        }
    }
}

/// See [`SpatialIndex::ray_nearest`].
pub(super) fn ray_nearest<I: SpatialIndex + ?Sized>(
    index: &I,
    ray: &Ray,
    t_max: f32,
    hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
) -> Option<(PolygonId, f32)> {
    // A plane without a normal has everything on its inner side.
    let everything = Frustum::new([Plane { normal: Vec3::ZERO, d: 0.0 }; 6]);
    let mut visitor = RayVisitor { ray, nearest: Nearest::new(t_max, hit) };
    index.traverse(&everything, &mut visitor);
    visitor.nearest.found()
}
