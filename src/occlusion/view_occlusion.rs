//! Occlusion culling of one view: the choice of occluders, the culler built from them, and what it leaves to draw.

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

/// Settings of [`ViewOcclusion`], and of its candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OcclusionConfig {
    /// Which polygons are kept as candidates.
    pub pool: PoolConfig,
    /// How the occluders of a frame are chosen.
    pub select: SelectConfig,
    /// How the index is culled.
    pub cull: CullConfig,
}

/// What is culled: a view, and what its frustum may see.
#[derive(Clone, Copy)]
pub struct ViewInput<'a> {
    /// The index.
    pub index: &'a dyn SpatialIndex,
    /// The polygons.
    pub geometry: &'a dyn Geometry,
    /// The view.
    pub view: &'a View,
    /// What [`SpatialIndex::frustum_cull_blocks`] has found for its frustum, and the polygons of `spaces`.
    pub in_view: &'a VisibleBlocks,
    /// Those of them that are in no index.
    pub spaces: Option<&'a SpacesInView>,
}

impl std::fmt::Debug for ViewInput<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ViewInput").field("in_view", &self.in_view.len()).finish_non_exhaustive()
    }
}

/// How much work a view was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewCounts {
    /// The choice of occluders.
    pub select: SelectCounts,
    /// The culler.
    pub build: BuildCounts,
    /// The tests.
    pub cull: CullCounts,
}

/// Culls one view after the other by the best occluders of a pool. Every caller culls through this. It keeps memory, and starts
/// the choice of occluders with those of the last view; what a view is left with depends on that view alone but for occluders
/// that are equally good.
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
    /// By a method of the CPU ([`Occlusion::has_culler`]). With any other, everything in view is drawn.
    pub fn new(method: Occlusion, config: &OcclusionConfig) -> Self {
        Self::with_culler(method.create(config.select.occluders), config)
    }

    /// By any culler.
    pub fn with_culler(culler: Box<dyn OcclusionCuller>, config: &OcclusionConfig) -> Self {
        let mut selector = Selector::new(config.select);
        // The pool holds twice its capacity before it is trimmed, and may be one over.
        selector.reserve(2 * config.pool.capacity.min(MOST_CAPACITY) + 1);
        Self { selector, culler, cull: config.cull }
    }

    pub(super) fn set_cull(&mut self, cull: CullConfig) {
        self.cull = cull;
    }

    /// Leaves in `drawn` the polygons of `input.in_view` that the occluders do not hide. A view without a window
    /// ([`View::window`]) keeps all of them. The pool has to have followed the same geometry. Costs O(pool), O(occluders log
    /// occluders) and the tests.
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

    /// First part of [`ViewOcclusion::cull`]: chooses the occluders.
    pub fn select(
        &mut self,
        pool: &OccluderPool,
        geometry: &dyn Geometry,
        window: &ViewWindow,
    ) -> SelectCounts {
        self.selector.select(pool, geometry, window)
    }

    /// Second part: builds the culler from them, for the same window.
    pub fn build(&mut self, window: &ViewWindow) -> BuildCounts {
        self.culler.build(window, self.selector.chosen())
    }

    /// Third part: leaves in `drawn` what they do not hide, in the same view.
    pub fn remove_hidden(&self, input: &ViewInput<'_>, drawn: &mut VisibleBlocks) -> CullCounts {
        let ViewInput { index, geometry, view, in_view, spaces } = *input;
        if self.selector.chosen().is_empty() {
            drawn.copy_from(in_view);
            return CullCounts::default();
        }
        remove_hidden(&*self.culler, self.cull, index, geometry, &view.frustum(), in_view, spaces, drawn)
    }

    /// Forgets the occluders of the last view.
    pub fn forget(&mut self) {
        self.selector.forget();
    }

    /// The occluders of the last view, best first, with the eye as the origin.
    pub fn selector(&self) -> &Selector {
        &self.selector
    }

    /// The culler, as built last.
    pub fn culler(&self) -> &dyn OcclusionCuller {
        &*self.culler
    }
}

/// Leaves in `drawn` the polygons of `in_view` that a culler does not hide: see [`ViewOcclusion::remove_hidden`]. For callers that
/// choose the occluders themselves; the culler has to be built for the view of the frustum.
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
    // An index that can is not walked for what is not hidden.
    if !index.thin_out(frustum, drawn, &mut tests) {
        drawn.clear();
        let mut visitor = OcclusionVisitor::new(culler, geometry, config, drawn);
        index.traverse(frustum, &mut visitor);
        tests.set_counts(visitor.counts());
    }
    if let Some(spaces) = spaces {
        tests.spaces(geometry, spaces, drawn);
    }
    tests.counts()
}
