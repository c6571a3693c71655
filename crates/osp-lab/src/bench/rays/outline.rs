//! Traversal of a structure's tree for all rays of a benchmark.

use super::model::Queries;
pub(super) use crate::outline::{Order, Outline, Steps};
use osp::polygon::{ConvexPolygon, PolygonId};

/// Traverses the tree for all rays. Returns the sum of the hit distances, for comparison.
pub(super) fn walk(
    outline: &Outline,
    order: Order,
    polygons: &[ConvexPolygon],
    queries: &Queries,
    steps: &mut Steps,
) -> f64 {
    let mut sum = 0.0;
    for ray in queries.outside.iter().chain(&queries.inside) {
        let mut hit = |id: PolygonId| polygons[id.index()].meet(ray);
        sum += outline.nearest(order, ray, &mut hit, steps).map_or(0.0, |(_, t)| f64::from(t));
    }
    sum
}
