use glam::Affine3A;

use super::{ConvexPolygon, PolygonId, SpaceId, SpacePlace};
use crate::math::Aabb;

/// The caller's polygons, in any form. A returned value is valid until the caller passes a [`Change`](super::Change) of
/// that polygon, or a [`Place`](super::Change::Place) of its space. A `Place` changes the box of each polygon in the
/// space.
///
/// A "polygon" is one drawn object with a number: a convex polygon, or a mesh, which has a box and no corners. A mesh hides
/// nothing. To make a house an occluder, give its walls numbers of their own. Such a wall may be an undrawn polygon inside
/// the house, because everything behind this polygon is behind the house, too.
pub trait Geometry {
    /// One more than the highest number that is or was in use.
    fn id_end(&self) -> usize;

    /// Whether the polygon exists now. `false` for every number that is not in use.
    fn is_present(&self, id: PolygonId) -> bool;

    /// The tight box of a polygon, world space, metres; any box, such as [`Aabb::EMPTY`], for a removed polygon. Called
    /// only for numbers below [`Geometry::id_end`] and for numbers in changes.
    fn bounds(&self, id: PolygonId) -> Aabb;

    /// The corners of a polygon, world space, metres: convex and flat ([`FLATNESS`](super::FLATNESS)). `None` for a removed polygon,
    /// and for a mesh, which hides nothing and is culled by its box.
    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon>;

    /// Whether a polygon may hide others, because it is opaque and drawn from both sides. Called for the same numbers as
    /// [`Geometry::bounds`]; ignored for a mesh.
    fn may_occlude(&self, id: PolygonId) -> bool;

    /// The solid part of a polygon, in its plane: the whole polygon if it may occlude and has no holes.
    fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
        if self.may_occlude(id) { self.polygon(id) } else { None }
    }

    /// The space that a polygon is fixed in, if it moves as a whole with other polygons. When a polygon enters or leaves a
    /// space, or moves inside it, the caller passes an [`Update`](super::Change::Update). When the space moves, one
    /// [`Place`](super::Change::Place) replaces the updates of all its polygons.
    fn space(&self, _id: PolygonId) -> Option<SpaceId> {
        None
    }

    /// The tight box of a polygon in the coordinates of its space. Called only for polygons in a space.
    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        self.bounds(id)
    }

    /// The current transform of a space that [`Geometry::space`] has returned.
    fn place(&self, _space: SpaceId) -> SpacePlace {
        SpacePlace::from(Affine3A::IDENTITY)
    }
}
