use super::{PolygonId, SpaceId};

/// A change of a polygon since the last frame. The caller updates the geometry before it passes the change to the pipeline.
/// A free number may be used for another polygon at once (`Remove`, then `Insert`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The polygon exists now. A polygon that a scene restores has its former box, unless an `Update` follows.
    Insert(PolygonId),
    /// The polygon no longer exists. It may come back under the same number.
    Remove(PolygonId),
    /// The polygon has moved, or has another shape.
    Update(PolygonId),
    /// The polygon looks different at the same place. An index ignores this change. A renderer draws the polygon again, and
    /// occlusion culling reads the solid part of the polygon again.
    Repaint(PolygonId),
    /// A space has moved, and with it every polygon that [is in it](super::Geometry::space). If a polygon enters or leaves
    /// the space, the caller passes an `Update` of this polygon first.
    Place(SpaceId),
}
