use osp::{
    index::WorkCounts,
    math::{Aabb, Frustum, PlaneMask},
};

/// The exact test of one polygon's box: whether the box is behind none of the planes of `mask`. With the mask of a node
/// around the box, the result equals that of [`Frustum::may_see`], because the whole node has passed the other planes.
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
