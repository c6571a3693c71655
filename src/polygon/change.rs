use super::PolygonId;

/// What an index has to do to follow the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The polygon is there now. One that was there before is where it was when it was removed, or an update follows.
    Insert(PolygonId),
    /// The polygon is gone (it may come back by undo or redo, under the same id).
    Remove(PolygonId),
    /// The polygon has moved, or has another shape.
    Update(PolygonId),
    /// The polygon is where it was, and looks different: of interest to who draws it, or takes it for an occluder (holes in
    /// it may be elsewhere), not to an index.
    Repaint(PolygonId),
}
