use super::{PolygonId, SpaceId};

/// A change of a polygon since the last frame. The caller updates the geometry before it passes the change to the pipeline. A
/// free number may be given to another polygon at once (`Remove`, then `Insert`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The polygon exists now. A polygon that a scene restores has its former box, or an update follows.
    Insert(PolygonId),
    /// The polygon is gone. It may come back under the same number.
    Remove(PolygonId),
    /// The polygon has moved, or has another shape.
    Update(PolygonId),
    /// The polygon looks different at the same place. An index ignores this. A renderer draws the polygon again, and occlusion
    /// culling reads its solid part again.
    Repaint(PolygonId),
    /// A space has moved, and with it every polygon that [is in it](super::Geometry::space). When a polygon enters or leaves a
    /// space, the caller passes an `Update` of that polygon first.
    Place(SpaceId),
}
