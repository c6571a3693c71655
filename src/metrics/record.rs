use super::Stage;
use crate::index::WorkCounts;

/// One frame: what came, what it cost, what is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameRecord {
    /// Its number, from 0.
    pub frame: u64,
    /// Polygons that came.
    pub inserted: u64,
    /// Polygons that went.
    pub removed: u64,
    /// Polygons that moved.
    pub updated: u64,
    /// Polygons in the index at the end of the frame.
    pub polygons: u64,
    /// Filing the changes, including a rebuild if the index is one that rebuilds.
    pub insert: Stage,
    /// Culling by the frustum.
    pub cull: Stage,
    /// What culling did.
    pub work: WorkCounts,
    /// Polygons to draw.
    pub visible: u64,
    /// Of the visible set; see [`super::fingerprint_of_frame`].
    pub fingerprint: u64,
}

impl FrameRecord {
    /// All stages, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.insert.ns + self.cull.ns
    }

    /// Allocations of all stages.
    pub fn allocations(&self) -> u64 {
        self.insert.allocations + self.cull.allocations
    }
}
