//! Box and ray queries for every index: the first as a frustum, the second as a walk.

use std::collections::BinaryHeap;

use glam::Vec3;

use super::{Node, Visit, Visitor, WorkCounts};
use crate::{
    index::DrawList,
    math::{Aabb, Frustum, Plane, Ray, Sphere, is_no_later},
    polygon::PolygonId,
};

/// Relative distance beyond the nearest hit so far up to which a ray tests boxes, because a polygon test and a box test round
/// differently. Larger: a few more polygons are tested.
pub(crate) const RAY_SLACK: f32 = 1.0e-4;

/// The frustum that sees exactly the boxes which share a point with `bounds`: one product with 1, two with 0 and one
/// difference, whose sign `f32` never gets wrong.
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

/// See [`super::SpatialIndex::box_query`].
pub(crate) fn box_query(
    bounds: &Aabb,
    out: &mut Vec<PolygonId>,
    cull: impl FnOnce(&Frustum, &mut DrawList) -> WorkCounts,
) -> WorkCounts {
    if bounds.min.is_nan() || bounds.max.is_nan() {
        return WorkCounts::default();
    }
    let mut list = DrawList::new();
    std::mem::swap(list.ids_mut(), out);
    let work = cull(&frustum_of_box(bounds), &mut list);
    std::mem::swap(list.ids_mut(), out);
    work
}

/// The nearest hit so far.
#[allow(missing_debug_implementations, reason = "it holds a function")]
pub struct Nearest<'a> {
    hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>,
    t_max: f32,
    found: Option<(PolygonId, f32)>,
}

impl<'a> Nearest<'a> {
    /// Begins a search up to this distance along the ray; `hit` returns the distance to a polygon that the ray meets.
    pub fn new(t_max: f32, hit: &'a mut dyn FnMut(PolygonId) -> Option<f32>) -> Self {
        Self { hit, t_max, found: None }
    }

    /// Distance up to which boxes are tested.
    pub fn reach(&self) -> f32 {
        self.found.map_or(self.t_max, |(_, t)| (t * (1.0 + RAY_SLACK)).min(self.t_max))
    }

    /// Tests a polygon.
    pub fn ask(&mut self, id: PolygonId) {
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

/// Whether a box that the ray enters at `t` lies within `reach`, by the comparison of [`Ray::enter_box`].
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

    fn polygons(&mut self, ids: &[PolygonId], _asked: Visit) {
        for &id in ids {
            self.nearest.ask(id);
        }
    }
}

/// See [`super::SpatialIndex::ray_nearest`].
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

/// See [`super::SpatialIndex::ray_any`].
pub(crate) fn ray_any(
    t_max: f32,
    hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    nearest: impl FnOnce(&mut dyn FnMut(PolygonId) -> Option<f32>) -> Option<(PolygonId, f32)>,
) -> Option<(PolygonId, f32)> {
    let mut found = None;
    // After any hit, the search for the nearest has nothing left to visit.
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
        // The computed distance of a box never exceeds that of a box inside it. A radius of NaN finds nothing.
        if node.bounds.distance_squared(center) <= radius_m * radius_m { Visit::Descend } else { Visit::Skip }
    }

    fn polygons(&mut self, ids: &[PolygonId], _asked: Visit) {
        let before = self.out.len();
        self.out.extend(ids.iter().copied().filter(|&id| (self.within)(id)));
        self.reported += (self.out.len() - before) as u64;
    }
}

/// See [`super::SpatialIndex::sphere_query`].
pub(crate) fn sphere_query(
    sphere: &Sphere,
    within: &mut dyn FnMut(PolygonId) -> bool,
    out: &mut Vec<PolygonId>,
    walk: impl FnOnce(&mut dyn Visitor) -> WorkCounts,
) -> WorkCounts {
    // The square of a negative radius would find polygons.
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

/// The nearest polygons to a point so far.
#[allow(missing_debug_implementations, reason = "it holds a function")]
pub struct NearestPolygons<'a> {
    point: Vec3,
    count: usize,
    distance_m: &'a mut dyn FnMut(PolygonId) -> f32,
    /// The polygons found, the farthest on top.
    found: BinaryHeap<Near>,
}

impl<'a> NearestPolygons<'a> {
    /// `None` for a count of zero or a point with NaN.
    pub(crate) fn new(
        point: Vec3,
        count: usize,
        filed: usize,
        distance_m: &'a mut dyn FnMut(PolygonId) -> f32,
    ) -> Option<Self> {
        let is_wanted = count > 0 && !point.is_nan();
        is_wanted.then(|| Self {
            point,
            count,
            distance_m,
            found: BinaryHeap::with_capacity(count.min(filed)),
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
        // A root: the square of a short distance may be too small for an `f32`.
        Some(bounds.distance_squared(self.point).sqrt()).filter(|&distance_m| distance_m <= reach_m)
    }

    /// Tests a polygon.
    pub fn ask(&mut self, id: PolygonId) {
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

impl Visitor for NearestPolygons<'_> {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        if self.distance_of(node.bounds).is_some() { Visit::Descend } else { Visit::Skip }
    }

    fn polygons(&mut self, ids: &[PolygonId], _asked: Visit) {
        ids.iter().for_each(|&id| self.ask(id));
    }
}

/// [`super::SpatialIndex::nearest`] for an index of `len` polygons with its own search.
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
