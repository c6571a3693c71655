//! Box, ray, sphere and distance queries for every index. A box query culls by a frustum whose planes are the sides of
//! the box. The other queries traverse the nodes.

use std::collections::BinaryHeap;

use glam::Vec3;

use super::{Node, Visit, Visitor, WorkCounts};
use crate::{
    math::{Aabb, Frustum, Plane, Ray, Sphere, is_no_later},
    polygon::PolygonId,
};

/// Relative distance beyond the nearest hit up to which a ray still tests boxes, because a polygon test and a box test
/// round differently. If it is larger, a ray tests a few more polygons.
pub(crate) const RAY_SLACK: f32 = 1.0e-4;

/// A frustum that sees exactly the boxes which share a point with `bounds`. The signed distance to each of its planes
/// is one product with 1, two products with 0 and one difference. The sign of this sum is always right in `f32`.
pub(crate) fn frustum_of_box(bounds: &Aabb) -> Frustum {
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

/// Implements [`super::SpatialIndex::box_query`] by the frustum query `cull`.
pub(crate) fn box_query(
    bounds: &Aabb,
    out: &mut Vec<PolygonId>,
    cull: impl FnOnce(&Frustum, &mut Vec<PolygonId>) -> WorkCounts,
) -> WorkCounts {
    if bounds.min.is_nan() || bounds.max.is_nan() {
        return WorkCounts::default();
    }
    cull(&frustum_of_box(bounds), out)
}

/// The nearest hit that a ray search has found.
#[allow(missing_debug_implementations, reason = "it holds a function")]
pub struct Nearest<'a> {
    hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>,
    t_max: f32,
    found: Option<(PolygonId, f32)>,
}

impl<'a> Nearest<'a> {
    /// Begins a search up to the distance `t_max` along the ray. `hit` returns the distance at which the ray meets a
    /// polygon, or `None` for a miss.
    pub fn new(t_max: f32, hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>) -> Self {
        Self { hit, t_max, found: None }
    }

    /// Distance along the ray up to which boxes are tested.
    pub fn reach(&self) -> f32 {
        self.found.map_or(self.t_max, |(_, t)| (t * (1.0 + RAY_SLACK)).min(self.t_max))
    }

    /// Tests a polygon.
    pub fn test(&mut self, id: PolygonId) {
        let Some(t) = (self.hit)(id).filter(|&t| t <= self.t_max) else { return };
        if self.found.is_none_or(|(other, best)| t < best || (t == best && id < other)) {
            self.found = Some((id, t));
        }
    }

    /// The nearest polygon and its distance along the ray.
    pub fn found(&self) -> Option<(PolygonId, f32)> {
        self.found
    }
}

/// Whether a box that the ray enters at `t` lies within `reach`. The comparison is the same as in [`Ray::enter_box`].
pub fn is_wanted(t: f32, reach: f32) -> bool {
    is_no_later(t, reach)
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

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
        for &id in ids {
            self.nearest.test(id);
        }
    }
}

/// Implements [`super::SpatialIndex::ray_nearest`] by the traversal `walk`.
pub(crate) fn ray_nearest(
    ray: &Ray,
    t_max: f32,
    hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    walk: impl FnOnce(&mut dyn Visitor) -> WorkCounts,
) -> Option<(PolygonId, f32)> {
    let mut visitor = RayVisitor { ray, nearest: Nearest::new(t_max, hit) };
    walk(&mut visitor);
    visitor.nearest.found()
}

/// Implements [`super::SpatialIndex::ray_any`] by the query `nearest`.
pub(crate) fn ray_any(
    t_max: f32,
    hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    nearest: impl FnOnce(&mut dyn FnMut(PolygonId) -> Option<f32>) -> Option<(PolygonId, f32)>,
) -> Option<(PolygonId, f32)> {
    let mut found = None;
    // After the first hit, a hit at minus infinity ends the search for the nearest polygon.
    let mut first = |id| {
        if found.is_some() {
            return None;
        }
        found = hit(id).filter(|&t| t <= t_max).map(|t| (id, t));
        found.map(|_| f32::NEG_INFINITY)
    };
    nearest(&mut first);
    found
}

struct SphereVisitor<'a> {
    sphere: &'a Sphere,
    within: &'a mut dyn FnMut(PolygonId) -> bool,
    out: &'a mut Vec<PolygonId>,
    reported: u64,
}

impl Visitor for SphereVisitor<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        let Sphere { center, radius_m } = *self.sphere;
        // A node can be skipped, because its computed distance never exceeds the distance of a box inside. If the
        // radius is NaN, nothing is found.
        if node.bounds.distance_squared(center) <= radius_m * radius_m { Visit::Descend } else { Visit::Skip }
    }

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
        let before = self.out.len();
        self.out.extend(ids.iter().copied().filter(|&id| (self.within)(id)));
        self.reported += (self.out.len() - before) as u64;
    }
}

/// Implements [`super::SpatialIndex::sphere_query`] by the traversal `walk`.
pub(crate) fn sphere_query(
    sphere: &Sphere,
    within: &mut dyn FnMut(PolygonId) -> bool,
    out: &mut Vec<PolygonId>,
    walk: impl FnOnce(&mut dyn Visitor) -> WorkCounts,
) -> WorkCounts {
    // Without this test a negative radius would find polygons, because its square is positive.
    if sphere.radius_m.is_nan() || sphere.radius_m < 0.0 {
        return WorkCounts::default();
    }
    let mut visitor = SphereVisitor { sphere, within, out, reported: 0 };
    let work = walk(&mut visitor);
    WorkCounts { reported: visitor.reported, ..work }
}

/// A polygon and its distance, ordered by the distance; at the same distance the higher id is greater.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Near {
    distance_m: f32,
    id: PolygonId,
}

impl Eq for Near {}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Near {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.distance_m.total_cmp(&other.distance_m).then(self.id.cmp(&other.id))
    }
}

/// The nearest polygons to a point that a search has found.
#[allow(missing_debug_implementations, reason = "it holds a function")]
pub struct NearestPolygons<'a> {
    point: Vec3,
    count: usize,
    distance_m: &'a mut dyn FnMut(PolygonId) -> f32,
    /// The polygons found; the farthest one is on top.
    found: BinaryHeap<Near>,
}

impl<'a> NearestPolygons<'a> {
    /// A search for the `count` polygons nearest to `point`; `None` if `count` is zero or a coordinate of `point` is
    /// NaN.
    pub(crate) fn new(
        point: Vec3,
        count: usize,
        polygons: usize,
        distance_m: &'a mut dyn FnMut(PolygonId) -> f32,
    ) -> Option<Self> {
        let is_wanted = count > 0 && !point.is_nan();
        is_wanted.then(|| Self {
            point,
            count,
            distance_m,
            found: BinaryHeap::with_capacity(count.min(polygons)),
        })
    }

    pub(crate) fn point(&self) -> Vec3 {
        self.point
    }

    /// Largest distance of a box that may hold one of the nearest polygons, metres.
    pub(crate) fn reach_m(&self) -> f32 {
        match self.found.peek() {
            Some(last) if self.found.len() == self.count => last.distance_m * (1.0 + RAY_SLACK),
            _ => f32::INFINITY,
        }
    }

    /// The distance of a box, metres, if it is at most [`NearestPolygons::reach_m`].
    pub fn distance_of(&self, bounds: &Aabb) -> Option<f32> {
        let reach_m = self.reach_m();
        // The square root is taken because the square of a short distance may be too small for an `f32`.
        Some(bounds.distance_squared(self.point).sqrt()).filter(|&distance_m| distance_m <= reach_m)
    }

    /// Tests a polygon.
    pub fn test(&mut self, id: PolygonId) {
        let near = Near { distance_m: (self.distance_m)(id), id };
        if near.distance_m.is_nan() {
            return;
        }
        if self.found.len() < self.count {
            self.found.push(near);
        } else if let Some(mut last) = self.found.peek_mut()
            && near < *last
        {
            *last = near;
        }
    }

    /// The polygons and their distances, the nearest first.
    pub(crate) fn into_found(self) -> impl Iterator<Item = (PolygonId, f32)> {
        self.found.into_sorted_vec().into_iter().map(|near| (near.id, near.distance_m))
    }
}

#[doc(hidden)]
impl Visitor for NearestPolygons<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        if self.distance_of(node.bounds).is_some() { Visit::Descend } else { Visit::Skip }
    }

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
        ids.iter().for_each(|&id| self.test(id));
    }
}

/// Does the work of [`super::SpatialIndex::nearest`] for an index of `len` polygons with its own search.
pub fn nearest_by(
    point: Vec3,
    count: usize,
    len: usize,
    distance_m: &mut dyn FnMut(PolygonId) -> f32,
    out: &mut Vec<(PolygonId, f32)>,
    search: impl FnOnce(&mut NearestPolygons<'_>) -> WorkCounts,
) -> WorkCounts {
    out.clear();
    let Some(mut nearest) = NearestPolygons::new(point, count, len, distance_m) else {
        return WorkCounts::default();
    };
    let work = search(&mut nearest);
    out.extend(nearest.into_found());
    WorkCounts { reported: out.len() as u64, ..work }
}
