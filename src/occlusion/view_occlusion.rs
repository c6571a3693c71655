//! Occlusion culling of one view: selects occluders, builds a culler from them, and removes the hidden polygons.

use super::{
    BuildCounts, CullConfig, CullCounts, OccluderPool, Occlusion, OcclusionCuller, OcclusionVisitor,
    PoolConfig, SelectConfig, SelectCounts, Selector, cull::Tests, pool::MOST_CAPACITY,
};
use crate::{
    index::SpatialIndex,
    math::Frustum,
    polygon::{Geometry, SpacesInView, VisibleBlocks},
    view::{View, ViewWindow},
};

/// Settings of [`ViewOcclusion`] and of the pool of candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OcclusionConfig {
    /// Settings of the pool of candidates.
    pub pool: PoolConfig,
    /// Settings of the selection of a frame's occluders.
    pub select: SelectConfig,
    /// Settings of the culling of the index.
    pub cull: CullConfig,
}

/// The input of [`ViewOcclusion::cull`]: a view, and the polygons in its frustum.
#[derive(Clone, Copy)]
pub struct ViewInput<'a> {
    /// The index.
    pub index: &'a dyn SpatialIndex,
    /// The polygons.
    pub geometry: &'a dyn Geometry,
    /// The view.
    pub view: &'a View,
    /// The polygons in the frustum: the result of [`SpatialIndex::frustum_cull_blocks`], and the polygons of `spaces`.
    pub in_view: &'a VisibleBlocks,
    /// The polygons of `in_view` that are not in `index`, because they move with a space.
    pub spaces: Option<&'a SpacesInView>,
}

impl std::fmt::Debug for ViewInput<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ViewInput").field("in_view", &self.in_view.len()).finish_non_exhaustive()
    }
}

/// Work counts of one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewCounts {
    /// Counts of the selection of occluders.
    pub select: SelectCounts,
    /// Counts of the culler's build.
    pub build: BuildCounts,
    /// Counts of the tests.
    pub cull: CullCounts,
}

/// Culls one view after the other with the best occluders of a pool. It reuses its memory, and tries the occluders of the
/// last view first. The result depends only on the current view, except for ties
/// between occluders that are equally good.
pub struct ViewOcclusion {
    selector: Selector,
    culler: Box<dyn OcclusionCuller>,
    cull: CullConfig,
}

impl std::fmt::Debug for ViewOcclusion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ViewOcclusion").field("culler", &self.culler.name()).finish_non_exhaustive()
    }
}

impl ViewOcclusion {
    /// Uses the culler of a method ([`Occlusion::culler`]). For [`Occlusion::None`], [`ViewOcclusion::cull`] keeps all
    /// polygons in view.
    pub fn new(method: Occlusion, config: &OcclusionConfig) -> Self {
        Self::with_culler(method.create(config.select.occluders), config)
    }

    /// Uses the given culler.
    pub fn with_culler(culler: Box<dyn OcclusionCuller>, config: &OcclusionConfig) -> Self {
        let mut selector = Selector::new(config.select);
        // A pool grows to twice its capacity, plus one, before it is trimmed.
        selector.reserve(2 * config.pool.capacity.min(MOST_CAPACITY) + 1);
        Self { selector, culler, cull: config.cull }
    }

    pub(super) fn set_cull(&mut self, cull: CullConfig) {
        self.cull = cull;
    }

    /// Sets `drawn` to the polygons of `input.in_view` that the occluders do not hide. A view without a window
    /// ([`View::window`]) keeps all of them. The pool must have received all changes of the same geometry. Takes O(pool +
    /// occluders log occluders), and the time of the tests.
    pub fn cull(
        &mut self,
        pool: &OccluderPool,
        input: &ViewInput<'_>,
        drawn: &mut VisibleBlocks,
    ) -> ViewCounts {
        let Some(window) = input.view.window() else {
            drawn.copy_from(input.in_view);
            return ViewCounts::default();
        };
        let select = self.select(pool, input.geometry, &window);
        let build = self.build(&window);
        let cull = self.remove_hidden(input, drawn);
        ViewCounts { select, build, cull }
    }

    /// First step of [`ViewOcclusion::cull`]: selects the occluders.
    pub fn select(
        &mut self,
        pool: &OccluderPool,
        geometry: &dyn Geometry,
        window: &ViewWindow,
    ) -> SelectCounts {
        self.selector.select(pool, geometry, window)
    }

    /// Second step: builds the culler from the selected occluders, for the same window.
    pub fn build(&mut self, window: &ViewWindow) -> BuildCounts {
        self.culler.build(window, self.selector.chosen())
    }

    /// Third step: sets `drawn` to the polygons that the occluders do not hide, for the same view.
    pub fn remove_hidden(&self, input: &ViewInput<'_>, drawn: &mut VisibleBlocks) -> CullCounts {
        let ViewInput { index, geometry, view, in_view, spaces } = *input;
        if self.selector.chosen().is_empty() {
            drawn.copy_from(in_view);
            return CullCounts::default();
        }
        remove_hidden(&*self.culler, self.cull, index, geometry, &view.frustum(), in_view, spaces, drawn)
    }

    /// Drops the occluders of the last view.
    pub fn forget(&mut self) {
        self.selector.forget();
    }

    /// The selector of the last view: its occluders, best first, with the eye as the origin.
    pub fn selector(&self) -> &Selector {
        &self.selector
    }

    /// The culler as it was last built.
    pub fn culler(&self) -> &dyn OcclusionCuller {
        &*self.culler
    }
}

/// Sets `drawn` to the polygons of `in_view` that a culler does not hide, as [`ViewOcclusion::remove_hidden`] does. This is
/// for callers that select the occluders themselves. The culler must be built for the view of the frustum.
#[allow(clippy::too_many_arguments, reason = "the parts of a `ViewInput`, where there is no view")]
pub fn remove_hidden(
    culler: &dyn OcclusionCuller,
    config: CullConfig,
    index: &dyn SpatialIndex,
    geometry: &dyn Geometry,
    frustum: &Frustum,
    in_view: &VisibleBlocks,
    spaces: Option<&SpacesInView>,
    drawn: &mut VisibleBlocks,
) -> CullCounts {
    drawn.copy_from(in_view);
    let mut tests = Tests::new(culler, config);
    // `thin_out` removes the hidden polygons from `drawn`. An index without this method is traversed instead, and the
    // visitor collects the visible polygons.
    if !index.thin_out(frustum, drawn, &mut tests) {
        drawn.clear();
        let mut visitor = OcclusionVisitor::new(culler, geometry, config, drawn);
        index.traverse(frustum, &mut visitor);
        tests.counts = visitor.counts();
    }
    if let Some(spaces) = spaces {
        tests.cull_spaces(geometry, spaces, drawn);
    }
    tests.counts
}
