use super::{ConvexPolygon, PolygonId};
use crate::math::Aabb;

/// What culling asks about polygons: the caller keeps them in whatever form it likes. Whatever is said of a polygon holds
/// until a [`Change`](super::Change) tells otherwise.
pub trait Geometry {
    /// One more than the highest number in use, of a polygon that is present or not.
    fn id_end(&self) -> usize;

    /// Whether the polygon is there now. `false` for every number that is not in use.
    fn is_present(&self, id: PolygonId) -> bool;

    /// The tight box of a polygon that is or was present, world space, metres.
    fn bounds(&self, id: PolygonId) -> Aabb;

    /// The corners of a polygon that is or was present, world space, metres: convex and flat
    /// ([`FLATNESS`](super::FLATNESS)). `None` for what is no single polygon (a mesh): it is culled by its box and hides
    /// nothing.
    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon>;

    /// Whether a polygon that is present hides what is behind it: opaque, and seen from both sides.
    fn may_occlude(&self, id: PolygonId) -> bool;

    /// The part of a polygon that hides all that is behind it, in its plane: all of it if it may occlude, unless there are
    /// holes in it.
    fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
        if self.may_occlude(id) { self.polygon(id) } else { None }
    }
}
