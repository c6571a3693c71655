use std::{any::Any, fmt::Debug};

use crate::{
    frame::{OcclusionRecord, StageClock},
    index::SpatialIndex,
    polygon::{Change, Geometry, SpacesInView, VisibleBlocks},
    view::View,
};

/// A culling method that runs after frustum culling. Every kind of occlusion culling in a [`super::Pipeline`] is a
/// pass. Before the first frame, the pipeline may call `load`, once or for each part of a model. Then it calls
/// `frame` or `skip` for each frame.
pub trait Pass: Any + Debug + Send + Sync {
    /// Receives a model, or a part of it, before the first frame.
    fn load(&mut self, geometry: &dyn Geometry, changes: &[Change]);

    /// Receives the changes of a frame that is not drawn.
    fn skip(&mut self, geometry: &dyn Geometry, changes: &[Change]);

    /// Receives the changes of a frame, and culls its views.
    fn frame(&mut self, frame: &PassInput<'_>) -> OcclusionRecord;

    /// The polygons to draw in each view, of the last frame whose record had [`OcclusionRecord::used`] set. In any other
    /// frame the pipeline draws all polygons in the frustum.
    fn drawn(&self) -> &[VisibleBlocks];

    /// Sets the largest number of occluders of a view; `None` sets the default of the method. A method that selects no
    /// occluders ignores the call.
    fn set_occluders(&mut self, _occluders: Option<usize>) {}

    /// Sets the time to draw a polygon, nanoseconds, for a method that culls only if this saves time.
    fn set_polygon_ns(&mut self, _polygon_ns: f64) {}
}

/// The input of [`Pass::frame`].
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct PassInput<'a> {
    /// The index, after all changes.
    pub index: &'a dyn SpatialIndex,
    /// The polygons.
    pub geometry: &'a dyn Geometry,
    /// Changes since the previous frame.
    pub changes: &'a [Change],
    /// The views.
    pub views: &'a [View],
    /// For each view, the polygons that its frustum may contain.
    pub in_view: &'a [VisibleBlocks],
    /// For each view, the polygons of `in_view` that move with a space, so that they are not in `index`. Empty if the
    /// geometry has no spaces.
    pub spaces: &'a [SpacesInView],
    /// The clock that measures the stages.
    pub clock: &'a StageClock,
}

impl Debug for PassInput<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PassInput").field("views", &self.views).finish_non_exhaustive()
    }
}
