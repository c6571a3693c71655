use super::Stage;
use crate::index::WorkCounts;

/// Counts of one frame: changed polygons, the cost of each stage, polygons in the frustum and hidden polygons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameRecord {
    /// Number of the frame, from 0 on.
    pub frame: u64,
    /// Number of inserted polygons.
    pub inserted: u64,
    /// Number of removed polygons.
    pub removed: u64,
    /// Number of polygons with an `Update`. A `Place` of a space does not count.
    pub updated: u64,
    /// Number of polygons in the index and in spaces at the end of the frame.
    pub polygons: u64,
    /// Number of views that were culled.
    pub views: u64,
    /// Cost of applying the changes, including a rebuild if the index rebuilds.
    #[doc(hidden)]
    pub insert: Stage,
    /// Cost of culling by the frustum.
    #[doc(hidden)]
    pub cull: Stage,
    /// Work counts of frustum culling.
    pub work: WorkCounts,
    /// Number of polygons in the frustum, hidden or not, summed over the views. [`FrameRecord::drawn`] excludes polygons
    /// that occlusion culling removes.
    pub visible: u64,
    /// Work of occlusion culling.
    #[doc(hidden)]
    pub occlusion: OcclusionRecord,
}

/// Work of occlusion culling in a frame. All zero without occlusion culling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct OcclusionRecord {
    /// Whether occlusion culling was done in this frame. It is skipped if it would take more time than it saves.
    pub used: bool,
    /// Whether the occluders were the polygons that were visible in the last frame, instead of the largest polygons.
    pub by_last: bool,
    /// Number of polygons in the frustum that were found to be hidden.
    pub occluded: u64,
    /// Cost of updating the candidates and selecting occluders.
    pub select: Stage,
    /// Cost of building the culler.
    pub build: Stage,
    /// Cost of traversing the index and testing boxes.
    pub query: Stage,
    /// Number of selected occluders, summed over the views.
    pub occluders: u64,
    /// Number of splitting planes of the trees, or of covered tiles of the depth buffers, summed over the views.
    pub nodes: u64,
    /// Number of nodes and polygons tested.
    pub tests: u64,
}

impl OcclusionRecord {
    /// Time of all stages of occlusion culling, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.select.ns + self.build.ns + self.query.ns
    }
}

impl FrameRecord {
    /// Number of polygons in the frustum that occlusion culling has removed, summed over the views.
    pub fn hidden(&self) -> u64 {
        self.occlusion.occluded.min(self.visible)
    }

    /// Number of polygons to draw, summed over the views.
    pub fn drawn(&self) -> u64 {
        self.visible - self.hidden()
    }

    /// Number of polygons outside the frustum, summed over the views.
    pub fn culled(&self) -> u64 {
        (self.polygons * self.views).saturating_sub(self.visible)
    }

    /// Time of applying the changes, nanoseconds.
    pub fn insert_ns(&self) -> u64 {
        self.insert.ns
    }

    /// Time of culling by the frustum, nanoseconds.
    pub fn cull_ns(&self) -> u64 {
        self.cull.ns
    }

    /// Time of culling by occlusion, nanoseconds.
    pub fn occlusion_ns(&self) -> u64 {
        self.occlusion.total_ns()
    }

    /// Time of all stages, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.insert_ns() + self.cull_ns() + self.occlusion_ns()
    }

    /// Number of allocations of all stages; 0 if the clock does not count them.
    #[doc(hidden)]
    pub fn allocations(&self) -> u64 {
        let OcclusionRecord { select, build, query, .. } = self.occlusion;
        [self.insert, self.cull, select, build, query].iter().map(|stage| stage.allocations).sum()
    }
}
