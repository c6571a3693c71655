use super::Stage;
use crate::index::WorkCounts;

/// One frame: changed polygons, cost of each stage, polygons in the frustum and hidden ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameRecord {
    /// Its number, from 0.
    pub frame: u64,
    /// Polygons that came.
    pub inserted: u64,
    /// Polygons that went.
    pub removed: u64,
    /// Polygons with an `Update`. A `Place` of a space counts for none.
    pub updated: u64,
    /// Polygons in the index and in spaces at the end of the frame.
    pub polygons: u64,
    /// Views that were culled.
    pub views: u64,
    /// Applying the changes, including a rebuild if the index is one that rebuilds.
    pub insert: Stage,
    /// Culling by the frustum.
    pub cull: Stage,
    /// Work counts of frustum culling.
    pub work: WorkCounts,
    /// Polygons in the frustum, hidden or not, of all views together; [`FrameRecord::drawn`] leaves out those that
    /// occlusion culling removes.
    pub visible: u64,
    /// Culling by occlusion, after the frustum.
    pub occlusion: OcclusionRecord,
}

/// Work of occlusion culling in a frame. All zero without occlusion culling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OcclusionRecord {
    /// Whether occlusion culling ran in this frame; frames in which it would not pay skip it.
    pub used: bool,
    /// Whether the polygons that were visible in the last frame were the occluders, instead of the largest ones.
    pub by_last: bool,
    /// Polygons in the frustum that were found to be hidden.
    pub occluded: u64,
    /// Following the scene's changes and choosing occluders.
    pub select: Stage,
    /// Building the culler.
    pub build: Stage,
    /// Walking the index and testing.
    pub query: Stage,
    /// Occluders chosen, for all views.
    pub occluders: u64,
    /// Splitting planes of the trees (or covered tiles of the depth buffers) built from them, of all views.
    pub nodes: u64,
    /// Nodes and polygons tested.
    pub tests: u64,
}

impl OcclusionRecord {
    /// All its stages, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.select.ns + self.build.ns + self.query.ns
    }
}

impl FrameRecord {
    /// Polygons to draw.
    pub fn drawn(&self) -> u64 {
        self.visible - self.occlusion.occluded.min(self.visible)
    }

    /// Polygons outside of the frustum, of all views together.
    pub fn culled(&self) -> u64 {
        (self.polygons * self.views).saturating_sub(self.visible)
    }

    /// All stages, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.insert.ns + self.cull.ns + self.occlusion.total_ns()
    }

    /// Allocations of all stages.
    pub fn allocations(&self) -> u64 {
        let OcclusionRecord { select, build, query, .. } = self.occlusion;
        [self.insert, self.cull, select, build, query].iter().map(|stage| stage.allocations).sum()
    }
}
