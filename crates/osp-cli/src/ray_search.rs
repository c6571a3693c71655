//! Searches along a ray with the order of nodes or the radius that the command line gives.

use clap::Args;

use super::{numbers, parsers::named};
use osp::{
    index::SpatialIndex,
    math::{Aabb, Ray},
    polygon::{ConvexPolygon, PolygonId},
};
use osp_lab::outline::{Order, Outline, Steps, WideRay};
use osp_session::scene::Scene;

/// Number of steps of a search along the ray. They suffice for the precision of `f32`.
const HALVINGS: usize = 48;

/// Options of a search along a ray.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct RaySearchArgs {
    /// Order in which the index's tree is searched. `in-order` descends into the nearer child first; `best-first` takes
    /// the nearest node of a priority queue. Both count nodes and boxes [default: each index's usual search, without
    /// counts].
    #[arg(long, value_name = "ORDER", value_parser = named(&Order::ALL, Order::name))]
    search: Option<Order>,
    /// Radius of the ray, metres: it also hits polygons within this distance [default: 0].
    #[arg(long, value_name = "M", value_parser = numbers::radius_m, allow_negative_numbers = true)]
    radius: Option<f32>,
}

pub(super) struct RaySearch {
    outline: Outline,
    order: Order,
    radius_m: f32,
}

impl RaySearchArgs {
    pub(super) fn is_given(&self) -> bool {
        self.search.is_some() || self.radius.is_some()
    }

    /// Returns the radius of the ray, metres.
    pub(super) fn radius_m(&self) -> f32 {
        self.radius.unwrap_or(0.0)
    }

    /// Returns the search of these options in a model's index. Reads the whole tree once. `None` without options: then
    /// the command uses the index's own search.
    pub(super) fn of(&self, index: &dyn SpatialIndex, scene: &Scene) -> Option<RaySearch> {
        if !self.is_given() {
            return None;
        }
        let order = self.search.unwrap_or(Order::InOrder);
        let boxes: Vec<Aabb> =
            (0..scene.polygon_count() as u32).map(|id| scene.bounds(PolygonId(id))).collect();
        Some(RaySearch { outline: Outline::of(index, &boxes), order, radius_m: self.radius_m() })
    }
}

impl RaySearch {
    /// Finds the nearest hit, like [`SpatialIndex::ray_nearest`]. Also returns the counts of work.
    pub(super) fn nearest(
        &self,
        ray: &Ray,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> (Option<(PolygonId, f32)>, Steps) {
        let mut steps = Steps::default();
        let ray = WideRay { ray: *ray, radius_m: self.radius_m };
        let found = self.outline.nearest_around(self.order, &ray, hit, &mut steps);
        (found, steps)
    }
}

/// Returns the distance along the ray at which a moving sphere touches a polygon. The ray's direction has unit length.
pub(super) fn meet(polygon: &ConvexPolygon, ray: &Ray, radius_m: f32) -> Option<f32> {
    if radius_m == 0.0 {
        // The box test rejects false hits, which rounding causes far from a small polygon.
        return ray.enter_box(&polygon.bounds(), f32::INFINITY).and_then(|_| polygon.meet(ray));
    }
    let corners = polygon.vertices();
    let triangles =
        (2..corners.len()).map(|i| ConvexPolygon::triangle(corners[0], corners[i - 1], corners[i]));
    triangles.filter_map(|triangle| meet_triangle(&triangle, ray, radius_m)).reduce(f32::min)
}

/// Like [`meet`], for a triangle. The distance between the triangle and a point on the ray is a convex function of the
/// point's position along the ray. So the sphere touches the triangle in at most one range of positions. This range
/// contains the position nearest to the triangle.
fn meet_triangle(triangle: &ConvexPolygon, ray: &Ray, radius_m: f32) -> Option<f32> {
    let distance_m = |t: f32| triangle.distance_m(ray.origin + ray.direction * t);
    let bounds = triangle.bounds();
    let middle = (bounds.center() - ray.origin).dot(ray.direction);
    let reach_m = bounds.extent().length() * 0.5 + radius_m;
    let (start, mut end) = ((middle - reach_m).max(0.0), middle + reach_m);
    if end < start {
        return None;
    }
    if distance_m(start) <= radius_m {
        return Some(start);
    }
    let mut low = start;
    for _ in 0..HALVINGS {
        let third = (end - low) / 3.0;
        let (a, b) = (low + third, end - third);
        if distance_m(a) <= distance_m(b) { end = b } else { low = a }
    }
    let mut nearest = f32::midpoint(low, end);
    if distance_m(nearest) > radius_m {
        return None;
    }
    let mut apart = start;
    for _ in 0..HALVINGS {
        let half = f32::midpoint(apart, nearest);
        if distance_m(half) <= radius_m { nearest = half } else { apart = half }
    }
    Some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn along(origin: Vec3, direction: Vec3) -> Ray {
        Ray::new(origin, direction)
    }

    #[test]
    fn a_ball_meets_a_face_an_edge_and_a_corner_where_it_touches_them() {
        let square = ConvexPolygon::quad(
            [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(x, y)| Vec3::new(x as f32, y as f32, 0.0)),
        );
        let forward = |x: f32, y: f32| along(Vec3::new(x, y, 10.0), -Vec3::Z);
        let touch = |x: f32, y: f32| meet(&square, &forward(x, y), 0.5);
        let close = |found: Option<f32>, expected: f32| {
            assert!(found.is_some_and(|t| (t - expected).abs() < 1.0e-3), "{found:?}, not {expected}");
        };
        close(touch(0.3, -0.7), 9.5);
        // The centre passes the edge at 0.3 m: it is 0.4 m before the plane when the ball touches the edge.
        close(touch(1.3, 0.2), 10.0 - 0.4);
        close(touch(1.3, 1.0 + 0.3), 10.0 - (0.25_f32 - 0.18).sqrt());
        assert_eq!(touch(1.51, 0.0), None);
        assert_eq!(touch(1.4, 1.4), None, "past the corner");
        assert_eq!(meet(&square, &along(Vec3::Z * 10.0, Vec3::Z), 0.5), None, "behind the start");
        close(meet(&square, &along(Vec3::Z * 0.2, Vec3::Z), 0.5), 0.0);
        assert_eq!(meet(&square, &forward(0.0, 0.0), 0.0), square.meet(&forward(0.0, 0.0)));
    }
}
