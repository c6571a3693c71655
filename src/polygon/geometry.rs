use glam::Affine3A;

use super::{ConvexPolygon, PolygonId, SpaceId, SpacePlace};
use crate::math::Aabb;

/// The caller's polygons, in any form. An answer about a polygon holds until the caller passes a [`Change`](super::Change) of
/// that polygon, or a [`Place`](super::Change::Place) of its space, which changes the box of each polygon in the space.
///
/// "Polygon" is whatever the caller draws under one number: one polygon, or a mesh that is known by its box only. A mesh
/// hides nothing. To let a house hide what is behind it, give its walls numbers of their own. Such a wall may be a stand-in
/// that the engine does not draw, as long as it lies inside the house: then whatever it hides, the house hides too.
pub trait Geometry {
    /// One more than the highest number that is or was in use.
    fn id_end(&self) -> usize;

    /// Whether the polygon is there now. `false` for every number that is not in use.
    fn is_present(&self, id: PolygonId) -> bool;

    /// The tight box of a polygon, world space, metres. For one that is gone any box will do
    /// ([`Aabb::EMPTY`]); it is asked below [`Geometry::id_end`] and for numbers in changes only.
    fn bounds(&self, id: PolygonId) -> Aabb;

    /// The corners of a polygon, world space, metres: convex and flat ([`FLATNESS`](super::FLATNESS)). `None` for a mesh, which
    /// is culled by its box and hides nothing, and for what is gone.
    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon>;

    /// Whether a polygon hides what is behind it: it is opaque, and drawn from both sides. Asked like [`Geometry::bounds`];
    /// no matter for a mesh.
    fn may_occlude(&self, id: PolygonId) -> bool;

    /// The part of a polygon that hides all that is behind it, in its plane: all of it if it may occlude, unless there are
    /// holes in it.
    fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
        if self.may_occlude(id) { self.polygon(id) } else { None }
    }

    /// The space that a polygon is fixed in, if it is in one that moves as a whole. A polygon that comes into a space, leaves
    /// it, or changes its place in it, has an [`Update`](super::Change::Update); when the space moves, one
    /// [`Place`](super::Change::Place) stands for all its polygons.
    fn space(&self, _id: PolygonId) -> Option<SpaceId> {
        None
    }

    /// The tight box of a polygon in the space that it is fixed in; asked of polygons that are in one only.
    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        self.bounds(id)
    }

    /// Where a space is now; asked of spaces that [`Geometry::space`] has named.
    fn place(&self, _space: SpaceId) -> SpacePlace {
        SpacePlace::from(Affine3A::IDENTITY)
    }
}
