use osp::{
    index::WorkCounts,
    math::{Aabb, Frustum, PlaneMask},
};

/// Whether a polygon's box may be in view: it is not wholly behind any plane of `mask`. If `mask` belongs to a node
/// around the box, the result equals [`Frustum::may_see`]. The reason is that the whole node is in front of the other
/// planes.
#[inline]
pub(super) fn passes(frustum: &Frustum, mask: PlaneMask, bounds: &Aabb, work: &mut WorkCounts) -> bool {
    work.boxes += 1;
    for (i, plane) in frustum.planes().iter().enumerate() {
        if mask.contains(i) {
            work.planes += 1;
            if plane.signed_distance(plane.positive_vertex(bounds)) < 0.0 {
                return false;
            }
        }
    }
    true
}
