use super::{
    BuildCounts, CullConfig, CullCounts, OccluderPool, Occlusion, OcclusionCuller, OcclusionVisitor,
    PoolConfig, SelectConfig, SelectCounts, Selector, cull::Tests, pool::MOST_CAPACITY,
};
use crate::{
    index::{SpatialIndex, WorkCounts},
    math::Frustum,
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
    view::{View, ViewWindow},
};

/// Settings of [`OcclusionStage`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OcclusionConfig {
    /// Which polygons are kept as candidates.
    pub pool: PoolConfig,
    /// How the occluders of a frame are chosen.
    pub select: SelectConfig,
    /// How the index is culled.
    pub cull: CullConfig,
}

/// What offering a polygon to the pool costs, nanoseconds, about.
const OFFER_NS: f64 = 1500.0;

/// Looking at a polygon's area, nanoseconds.
const LOOK_NS: f64 = 10.0;

/// Polygons left over from candidates that have died that are offered anew in a frame, in steps.
const OFFERS_A_STEP: usize = 16;

/// Most changed polygons that are tested one by one for whether they are large.
const MOST_LOOKS: usize = 64;

/// Most polygons that are offered in the frame in which they come.
const MOST_AT_ONCE: f64 = 16.0;

/// Fewer offers than this wait: most frames then have none.
const LEAST_OFFERS: usize = 128;

/// Everything that culling by occlusion needs from frame to frame: candidates, the choice among them, and a culler.
pub struct OcclusionStage {
    config: OcclusionConfig,
    pool: OccluderPool,
    selector: Selector,
    culler: Box<dyn OcclusionCuller>,
}

impl std::fmt::Debug for OcclusionStage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OcclusionStage").field("culler", &self.culler.name()).finish_non_exhaustive()
    }
}

impl OcclusionStage {
    /// A stage without candidates.
    pub fn new(kind: Occlusion, config: OcclusionConfig) -> Self {
        Self::with_culler(kind.create(config.select.occluders), config)
    }

    /// A stage around any culler.
    pub fn with_culler(culler: Box<dyn OcclusionCuller>, config: OcclusionConfig) -> Self {
        let mut selector = Selector::new(config.select);
        // The pool holds twice its capacity before it is trimmed, and may be one over.
        selector.reserve(2 * config.pool.capacity.min(MOST_CAPACITY) + 1);
        Self { config, pool: OccluderPool::new(config.pool), selector, culler }
    }

    /// Makes room for scenes of this many polygons.
    pub fn reserve(&mut self, polygons: usize) {
        self.pool.reserve(polygons);
    }

    /// Changes the most occluders of a frame; the candidates stay.
    pub(crate) fn set_occluders(&mut self, kind: Occlusion, occluders: usize) {
        self.config.select.occluders = occluders;
        self.selector = Selector::new(self.config.select);
        self.selector.reserve(2 * self.config.pool.capacity.min(MOST_CAPACITY) + 1);
        self.culler = kind.create(occluders);
    }

    /// Changes what is worth a test.
    pub(crate) fn set_cull(&mut self, cull: CullConfig) {
        self.config.cull = cull;
    }

    /// Follows a frame's changes; once a frame that is culled.
    pub fn follow(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.pool.follow(geometry, changes);
    }

    /// Follows the loading of a whole model; see [`OccluderPool::join_walls`].
    pub fn load(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.pool.follow(geometry, changes);
        self.pool.join_walls(geometry);
    }

    /// [`OcclusionStage::load`] in parts.
    pub(crate) fn load_part(&mut self, geometry: &dyn Geometry, part: &[Change], is_last: bool) {
        self.pool.follow(geometry, part);
        if is_last {
            self.pool.join_walls(geometry);
        }
    }

    /// As [`OcclusionStage::follow`], but what is left over from candidates that have died is offered anew a few at a time,
    /// in this and later frames.
    pub(crate) fn follow_in_steps(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.pool.follow_in_steps(geometry, changes, OFFERS_A_STEP);
    }

    /// Whether there are polygons that were not considered as occluders yet.
    pub(crate) fn is_behind(&self, geometry: &dyn Geometry) -> bool {
        self.pool.is_behind(geometry)
    }

    /// Whether one of the polygons that these changes bring may fill enough of a view to be an occluder, or they are too
    /// many to look at.
    pub(crate) fn comes_large(&self, geometry: &dyn Geometry, changes: &[Change], views: &[View]) -> bool {
        let came = changes.iter().filter_map(|change| match *change {
            Change::Insert(id) | Change::Update(id) | Change::Repaint(id) => Some(id),
            Change::Remove(_) | Change::Place(_) => None,
        });
        if came.clone().nth(MOST_LOOKS).is_some() {
            return true;
        }
        let least_share = self.config.select.least_share as f32;
        views.iter().filter_map(View::window).any(|window| {
            let eye = window.eye_in_world().as_vec3();
            let least_sr = least_share * window.solid_angle_sr() as f32;
            came.clone().any(|id| {
                // The box first, which has just been inserted: nothing of its width is larger than a disk.
                let bounds = geometry.bounds(id);
                let disk_m2 = std::f32::consts::FRAC_PI_4 * bounds.extent().length_squared();
                if disk_m2 < least_sr * bounds.distance_squared(eye) || !geometry.is_present(id) {
                    return false;
                }
                let Some(polygon) = geometry.occluder(id) else { return false };
                // Not less than the solid angle: the area as if it faced the eye, at its nearest point.
                0.5 * polygon.area_vector().length() >= least_sr * bounds.distance_squared(eye)
            })
        })
    }

    /// Instead of [`OcclusionStage::follow`] in a frame that is not culled: only what has to be done at once, and, for
    /// about as many nanoseconds as `budget_ns`, what makes candidates of what came. About what that took of the budget.
    pub(crate) fn follow_roughly(
        &mut self,
        geometry: &dyn Geometry,
        changes: &[Change],
        budget_ns: f64,
    ) -> f64 {
        let at_once = (budget_ns / OFFER_NS).min(MOST_AT_ONCE) as usize;
        let looks_ns = if at_once > 0 { LOOK_NS * changes.len() as f64 } else { 0.0 };
        let mut spent_ns = looks_ns + self.pool.follow_roughly(geometry, changes, at_once) as f64 * OFFER_NS;
        let offers = ((budget_ns - spent_ns) / OFFER_NS) as usize;
        if offers >= LEAST_OFFERS && self.pool.is_behind(geometry) {
            // Looking is not for nothing either.
            spent_ns += (self.pool.catch_up(geometry, offers) + 1) as f64 * OFFER_NS;
        }
        spent_ns
    }

    /// Chooses the occluders for a window.
    pub fn select(&mut self, geometry: &dyn Geometry, window: &ViewWindow) -> SelectCounts {
        self.selector.select(&self.pool, geometry, window)
    }

    /// Builds the culler from the occluders chosen last, for the same window.
    pub fn build(&mut self, window: &ViewWindow) -> BuildCounts {
        self.culler.build(window, self.selector.chosen())
    }

    /// Appends what the frustum may see, and the occluders of the last [`OcclusionStage::build`] do not hide, to
    /// `draw_list`: each polygon once. The frustum has to belong to the same view as the window.
    pub fn cull(
        &mut self,
        index: &dyn SpatialIndex,
        geometry: &dyn Geometry,
        frustum: &Frustum,
        draw_list: &mut impl Extend<PolygonId>,
    ) -> (CullCounts, WorkCounts) {
        let mut visitor = OcclusionVisitor::new(&*self.culler, geometry, self.config.cull, draw_list);
        let work = index.traverse(frustum, &mut visitor);
        (visitor.counts(), work)
    }

    /// What is left of `in_view`, which the index has found for the frustum, becomes `drawn`: the polygons that
    /// [`OcclusionStage::cull`] finds. An index that can ([`SpatialIndex::thin_out`]) is not walked for what is not hidden.
    pub fn thin_out(
        &mut self,
        index: &dyn SpatialIndex,
        geometry: &dyn Geometry,
        frustum: &Frustum,
        in_view: &VisibleBlocks,
        drawn: &mut VisibleBlocks,
    ) -> CullCounts {
        let culler = (!self.selector.chosen().is_empty()).then_some(&*self.culler);
        thin_out(culler, self.config.cull, index, geometry, frustum, in_view, drawn)
    }

    /// The candidates.
    pub fn pool(&self) -> &OccluderPool {
        &self.pool
    }

    /// The choice.
    pub fn selector(&self) -> &Selector {
        &self.selector
    }

    /// The culler, as built last.
    pub fn culler(&self) -> &dyn OcclusionCuller {
        &*self.culler
    }
}

/// What is left of `in_view` becomes `drawn`, by a culler that was built for the same view (`None`: without occluders):
/// see [`OcclusionStage::thin_out`].
pub fn thin_out(
    culler: Option<&dyn OcclusionCuller>,
    config: CullConfig,
    index: &dyn SpatialIndex,
    geometry: &dyn Geometry,
    frustum: &Frustum,
    in_view: &VisibleBlocks,
    drawn: &mut VisibleBlocks,
) -> CullCounts {
    drawn.copy_from(in_view);
    let Some(culler) = culler else { return CullCounts::default() };
    let mut tests = Tests::new(culler, config);
    if index.thin_out(frustum, drawn, &mut tests) {
        return tests.counts();
    }
    drawn.clear();
    let mut visitor = OcclusionVisitor::new(culler, geometry, config, drawn);
    index.traverse(frustum, &mut visitor);
    visitor.counts()
}

/// About what a frame's occlusion culling costs, nanoseconds, from its work counts alone: the same on every machine.
/// The factors were measured once, on one 2-core x86-64 machine; only their ratio to the cost of drawing matters.
pub(crate) fn work_ns(select: &SelectCounts, build: &BuildCounts, cull: &CullCounts) -> f64 {
    let of = |count: u64, ns: f64| count as f64 * ns;
    of(u64::from(select.candidates), 1.5)
        + of(u64::from(select.measured), 400.0)
        + of(u64::from(build.nodes), 60.0)
        + of(u64::from(build.pieces), 20.0)
        + of(cull.node_tests + cull.polygon_tests, 30.0)
        + of(cull.planes, 5.0)
}
