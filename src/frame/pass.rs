use std::{any::Any, fmt::Debug};

use crate::{
    frame::{OcclusionRecord, StageClock},
    index::SpatialIndex,
    polygon::{Change, Geometry, VisibleBlocks},
    view::View,
};

/// What leaves polygons out of a frame after the frustum did: the one place in a [`super::Pipeline`] for culling by
/// occlusion, of whatever kind.
pub trait Pass: Any + Debug + Send + Sync {
    /// Takes a whole model, before the first frame: nothing of it is left for later frames to look at.
    fn load(&mut self, geometry: &dyn Geometry, changes: &[Change]);

    /// Follows the changes of a frame that is not looked at.
    fn skip(&mut self, geometry: &dyn Geometry, changes: &[Change]);

    /// Follows the changes of a frame and culls its views.
    fn frame(&mut self, frame: &PassInput<'_>) -> OcclusionRecord;

    /// What is left of each view, as the last frame left it in which [`OcclusionRecord::used`] was set.
    fn drawn(&self) -> &[VisibleBlocks];

    /// Changes the most occluders of a view in a frame; `None` is the method's own number. Nothing where there are none.
    fn set_occluders(&mut self, _occluders: Option<usize>) {}

    /// Says what drawing a polygon costs, nanoseconds, to a pass that culls where it pays.
    fn set_polygon_ns(&mut self, _polygon_ns: f64) {}
}

/// A frame as a [`Pass`] sees it.
#[derive(Clone, Copy)]
pub struct PassInput<'a> {
    /// The index, up to date.
    pub index: &'a dyn SpatialIndex,
    /// The polygons.
    pub geometry: &'a dyn Geometry,
    /// What changed since the frame before.
    pub changes: &'a [Change],
    /// The views.
    pub views: &'a [View],
    /// What the frustum of each view may see.
    pub in_view: &'a [VisibleBlocks],
    /// The clock for the stages.
    pub clock: &'a StageClock,
}

impl Debug for PassInput<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PassInput").field("views", &self.views).finish_non_exhaustive()
    }
}
