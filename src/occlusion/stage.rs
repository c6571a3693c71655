use super::{
    BuildCounts, CullConfig, CullCounts, OccluderPool, Occlusion, OcclusionConfig, OcclusionCuller,
    SelectCounts, ViewCounts, ViewInput, ViewOcclusion,
};
use crate::{
    polygon::{Change, Geometry, VisibleBlocks},
    view::View,
};

/// Approximate time to offer a polygon to the pool, nanoseconds.
const OFFER_NS: f64 = 1500.0;

/// Time to read a polygon's area, nanoseconds.
const READ_NS: f64 = 10.0;

/// Largest number of polygons of removed candidates that [`OcclusionStage::follow_in_steps`] offers again in a frame.
const OFFERS_A_STEP: usize = 16;

/// Largest number of changed polygons whose size is tested one by one.
const MOST_SIZE_TESTS: usize = 64;

/// Largest number of polygons that are offered in the frame of their arrival.
const MOST_AT_ONCE: f64 = 16.0;

/// Least number of waiting polygons that a frame offers. A frame whose budget permits fewer offers none, so most frames
/// make no offers.
const LEAST_OFFERS: usize = 128;

/// The state of occlusion culling from frame to frame: the candidates for occluders, and a [`ViewOcclusion`] that culls all
/// views one after the other.
#[derive(Debug)]
pub struct OcclusionStage {
    config: OcclusionConfig,
    pool: OccluderPool,
    view: ViewOcclusion,
}

impl OcclusionStage {
    /// A stage without candidates.
    pub fn new(kind: Occlusion, config: OcclusionConfig) -> Self {
        Self::with_culler(kind.create(config.select.occluders), config)
    }

    /// A stage with this culler.
    pub fn with_culler(culler: Box<dyn OcclusionCuller>, config: OcclusionConfig) -> Self {
        let view = ViewOcclusion::with_culler(culler, &config);
        Self { config, pool: OccluderPool::new(config.pool), view }
    }

    /// Makes room for scenes with `polygons` polygons.
    pub fn reserve(&mut self, polygons: usize) {
        self.pool.reserve(polygons);
    }

    /// Replaces the culler, and sets the largest number of occluders of a frame, for which `culler` has room. The
    /// candidates stay.
    pub(crate) fn set_culler(&mut self, culler: Box<dyn OcclusionCuller>, occluders: usize) {
        self.config.select.occluders = occluders;
        self.view = ViewOcclusion::with_culler(culler, &self.config);
    }

    /// Changes the settings that decide which occlusion tests are made.
    pub(crate) fn set_cull(&mut self, cull: CullConfig) {
        self.config.cull = cull;
        self.view.set_cull(cull);
    }

    /// Applies a frame's changes to the candidates. Call it once for every culled frame.
    pub fn follow(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.pool.follow(geometry, changes);
    }

    /// Does the same as [`OcclusionStage::follow`], but offers the polygons of removed candidates again a few at a time, in
    /// this and later frames.
    pub(crate) fn follow_in_steps(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.pool.follow_in_steps(geometry, changes, OFFERS_A_STEP);
    }

    /// Whether some polygons have not been considered as occluders yet.
    pub(crate) fn is_behind(&self, geometry: &dyn Geometry) -> bool {
        self.pool.is_behind(geometry)
    }

    /// Whether a polygon of these changes may fill enough of a view to be an occluder. Also returns true if there are too
    /// many changes to test.
    pub(crate) fn comes_large(&self, geometry: &dyn Geometry, changes: &[Change], views: &[View]) -> bool {
        let came = changes.iter().filter_map(|change| match *change {
            Change::Insert(id) | Change::Update(id) | Change::Repaint(id) => Some(id),
            Change::Remove(_) | Change::Place(_) => None,
        });
        if came.clone().nth(MOST_SIZE_TESTS).is_some() {
            return true;
        }
        let least_share = self.config.select.least_share as f32;
        views.iter().filter_map(View::window).any(|window| {
            let eye = window.eye_in_world().as_vec3();
            let least_sr = least_share * window.solid_angle_sr() as f32;
            came.clone().any(|id| {
                // The box is read first, because it was just inserted and is in the cache. A polygon is no larger than a
                // disk with the box's diagonal.
                let bounds = geometry.bounds(id);
                let disk_m2 = std::f32::consts::FRAC_PI_4 * bounds.extent().length_squared();
                if disk_m2 < least_sr * bounds.distance_squared(eye) || !geometry.is_present(id) {
                    return false;
                }
                let Some(polygon) = geometry.occluder(id) else { return false };
                // The solid angle is at most that of a polygon with this area that faces the eye at the box's nearest
                // point.
                0.5 * polygon.area_vector().length() >= least_sr * bounds.distance_squared(eye)
            })
        })
    }

    /// Replaces [`OcclusionStage::follow`] in a frame that is not culled. It does only the urgent work, then makes new
    /// polygons candidates for about `budget_ns` nanoseconds. Returns the approximate time that it spent of this budget,
    /// nanoseconds.
    pub(crate) fn follow_roughly(
        &mut self,
        geometry: &dyn Geometry,
        changes: &[Change],
        budget_ns: f64,
    ) -> f64 {
        let at_once = (budget_ns / OFFER_NS).min(MOST_AT_ONCE) as usize;
        let reads_ns = if at_once > 0 { READ_NS * changes.len() as f64 } else { 0.0 };
        let mut spent_ns = reads_ns + self.pool.follow_roughly(geometry, changes, at_once) as f64 * OFFER_NS;
        let offers = ((budget_ns - spent_ns) / OFFER_NS) as usize;
        if offers >= LEAST_OFFERS && self.pool.is_behind(geometry) {
            // The search for the polygons costs time, too.
            spent_ns += (self.pool.catch_up(geometry, offers) + 1) as f64 * OFFER_NS;
        }
        spent_ns
    }

    /// Culls one view; see [`ViewOcclusion::cull`].
    pub fn cull(&mut self, input: &ViewInput<'_>, drawn: &mut VisibleBlocks) -> ViewCounts {
        self.view.cull(&self.pool, input, drawn)
    }

    /// The pool and the [`ViewOcclusion`], for callers that measure the steps of [`OcclusionStage::cull`] separately.
    pub(crate) fn parts(&mut self) -> (&OccluderPool, &mut ViewOcclusion) {
        (&self.pool, &mut self.view)
    }

    /// The candidates for occluders.
    pub fn pool(&self) -> &OccluderPool {
        &self.pool
    }

    /// The occluders and the culler of the last view.
    pub fn view(&self) -> &ViewOcclusion {
        &self.view
    }
}

/// Approximate time of a frame's occlusion culling, nanoseconds, computed from its work counts: the same on every machine.
/// The factors were measured once, on a 2-core x86-64 machine. Only their ratio to the cost of drawing matters.
pub(crate) fn work_ns(select: &SelectCounts, build: &BuildCounts, cull: &CullCounts) -> f64 {
    let of = |count: u64, ns: f64| count as f64 * ns;
    of(u64::from(select.candidates), 1.5)
        + of(u64::from(select.measured), 400.0)
        + of(u64::from(build.nodes), 60.0)
        + of(u64::from(build.pieces), 20.0)
        + of(cull.node_tests + cull.polygon_tests, 30.0)
        + of(cull.planes, 5.0)
}
