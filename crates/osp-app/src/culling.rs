mod plan;

use std::time::Duration;

use glam::Vec3;

use super::{draw_cost::DrawCost, spans::Part};
use osp::{
    frame::{FrameRecord, OcclusionPass, Pipeline},
    index::SpatialIndex,
    math::{Aabb, Ray},
    occlusion::ShadowVolume,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::StrokeId,
    scene::{Scene, Stroke},
};

pub(super) use plan::Indexing;
pub use plan::{CullingPlan, Indexed};

/// The insertion of a whole model into another index, with its duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reindexed {
    pub kind: IndexKind,
    /// Number of polygons inserted.
    pub polygons: u64,
    pub took: Duration,
    /// Whether a background thread inserted the polygons.
    pub in_background: bool,
}

/// Work of searches with rays and around points, summed since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchCounts {
    pub rays: u64,
    /// Number of exact tests of polygons by rays.
    pub tests: u64,
    pub points: u64,
    /// Number of polygons near search points whose boxes were tested one by one.
    pub near: u64,
}

/// The culling of frames, with a frustum query that can be turned off.
#[derive(Debug)]
pub struct Culling {
    /// Settings of the index. A change takes effect with the next [`Culling::reindex`]; an index ignores the settings of
    /// other structures.
    pub plan: CullingPlan,
    pipeline: Pipeline,
    pub culls_by_frustum: bool,
    reindexed: Option<Reindexed>,
    searches: SearchCounts,
    /// Scratch of [`Culling::nearest_box`].
    found: Vec<PolygonId>,
    draw_cost: DrawCost,
    /// All polygons, used while frustum culling is off.
    all: VisibleBlocks,
}

impl Culling {
    /// Culling with an empty index.
    pub fn new(kind: IndexKind) -> Self {
        let plan = CullingPlan::new(kind, Method::NONE);
        let pipeline = plan.pipeline(&Aabb::EMPTY, 0);
        Self {
            plan,
            pipeline,
            culls_by_frustum: true,
            reindexed: None,
            searches: SearchCounts::default(),
            found: Vec::new(),
            draw_cost: DrawCost::default(),
            all: VisibleBlocks::new(),
        }
    }

    /// The index and its occlusion culling.
    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    pub fn index(&self) -> &dyn SpatialIndex {
        self.pipeline.index()
    }

    /// Largest number of occluders of a view; `None` without occlusion culling.
    pub fn most_occluders(&self) -> Option<usize> {
        self.pipeline.occlusion().map(OcclusionPass::most_occluders)
    }

    /// Sets the largest number of occluders of a view.
    pub fn set_occluders(&mut self, occluders: Option<usize>) {
        self.plan.occluders = occluders;
        self.pipeline.set_occluders(occluders);
    }

    /// Shadow volumes of the first view's occluders in the last frame, relative to the eye.
    pub fn shadows(&self) -> &[ShadowVolume] {
        let pass = self.pipeline.occlusion().filter(|_| self.pipeline.is_occluded());
        pass.map_or(&[], |pass| pass.shadows())
    }

    /// The last insertion of a whole model into an index, with its duration.
    pub fn reindexed(&self) -> Option<Reindexed> {
        self.reindexed
    }

    pub fn searches(&self) -> SearchCounts {
        self.searches
    }

    /// Inserts the whole model into another index, or again into the same index. The inserted model includes all
    /// changes so far, so these changes must not be passed to the next frame.
    pub fn reindex(&mut self, kind: IndexKind, occlusion: Method, scene: &Scene, bounds: &Aabb) {
        let plan = CullingPlan { kind, occlusion, ..self.plan.clone() };
        self.take(plan.index(scene, bounds), false);
    }

    /// Uses a model that another thread has inserted into an index. Without such a model, or if its plan differs,
    /// inserts the model on this thread.
    pub fn take_indexed(&mut self, indexed: Option<Indexed>, scene: &Scene, bounds: &Aabb) {
        match indexed.filter(|indexed| indexed.plan == self.plan) {
            Some(indexed) => self.take(indexed, true),
            None => self.take(self.plan.clone().index(scene, bounds), false),
        }
    }

    fn take(&mut self, indexed: Indexed, in_background: bool) {
        let Indexed { plan, pipeline, took } = indexed;
        let polygons = pipeline.polygon_count() as u64;
        self.reindexed = Some(Reindexed { kind: plan.kind, polygons, took, in_background });
        (self.plan, self.pipeline) = (plan, pipeline);
    }

    /// Applies changes to the index without a frame.
    pub fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        self.pipeline.skip(scene, changes);
    }

    /// Culls one frame: applies the changes to the index, then culls for each of `views` (screens, eyes) by frustum and
    /// occlusion.
    pub fn frame(&mut self, scene: &Scene, changes: &[Change], views: &[View]) -> FrameRecord {
        let record = self.pipeline.frame_of_views(scene, changes, views);
        self.all.clear();
        if !self.culls_by_frustum {
            self.all.extend(scene.visible_ids());
        }
        record
    }

    /// The polygons in the frustum of a view of the last frame; `None` if there was no such view.
    pub fn in_view(&self, view: usize) -> Option<&VisibleBlocks> {
        self.pipeline.in_view_lists().get(view)
    }

    /// The polygons to draw in a view of the last frame. Empty if there was no such view.
    pub fn drawn(&self, view: usize) -> &VisibleBlocks {
        static NOTHING: VisibleBlocks = VisibleBlocks::new();
        match self.pipeline.draw_lists().get(view) {
            Some(list) if self.culls_by_frustum => list,
            Some(_) => &self.all,
            None => &NOTHING,
        }
    }

    /// Records the time to draw this number of polygons. After several frames, the pipeline gets an estimate of the
    /// time that culling one polygon saves.
    pub fn note_drawing(&mut self, polygons: u64, ns: u64) {
        self.draw_cost.note(polygons, ns);
        if let Some(polygon_ns) = self.draw_cost.polygon_ns() {
            self.pipeline.set_polygon_ns(polygon_ns);
        }
    }

    /// Number of frames with a measured drawing time.
    pub fn drawings_measured(&self) -> u32 {
        self.draw_cost.frames()
    }

    /// Time to draw a polygon, nanoseconds, once it is measured.
    pub fn polygon_ns(&self) -> Option<f64> {
        self.draw_cost.polygon_ns()
    }

    /// Finds the polygons that no view of the last frame draws. Appends polygons outside of all views to `outside`, and
    /// hidden polygons to `hidden`.
    pub fn left_out(&self, scene: &Scene, outside: &mut VisibleBlocks, hidden: &mut VisibleBlocks) {
        let views = self.pipeline.draw_lists().len();
        let is_drawn = |id| (0..views).any(|view| self.drawn(view).contains(id));
        let in_view = self.pipeline.in_view_lists();
        hidden.extend(in_view.iter().flat_map(VisibleBlocks::ids).filter(|&id| !is_drawn(id)));
        let is_in_view = |id| in_view.iter().any(|set| set.contains(id));
        outside.extend(scene.visible_ids().filter(|&id| !is_drawn(id) && !is_in_view(id)));
    }

    /// The first polygon that a ray hits, and the ray parameter of the hit. Only strokes for which `counts` returns
    /// `true` are tested. `waiting` are the changes that no frame has applied to the index yet.
    pub fn pick(
        &mut self,
        scene: &Scene,
        waiting: &[Change],
        ray: &Ray,
        counts: impl Fn(&Stroke) -> bool,
    ) -> Option<(PolygonId, f32)> {
        let mut tests = 0;
        let mut meet = |id: PolygonId| {
            tests += 1;
            let is_met = is_there(scene, id) && counts(scene.stroke_of(id));
            // From either side.
            is_met.then(|| scene.polygon_from(id, ray.origin, Vec3::Y).meet(ray)).flatten()
        };
        let mut found = self.pipeline.ray_nearest(scene, ray, f32::MAX, &mut meet);
        for id in changed(waiting) {
            if let Some(t) = meet(id)
                && found.is_none_or(|(_, nearest)| t < nearest)
            {
                found = Some((id, t));
            }
        }
        self.searches.rays += 1;
        self.searches.tests += tests;
        found
    }

    /// The strokes with a polygon in a region of space. `waiting` are the changes that no frame has applied to the
    /// index yet.
    pub fn strokes_in(&mut self, scene: &Scene, waiting: &[Change], part: &Part) -> Vec<StrokeId> {
        let mut is_in = |id: PolygonId| is_there(scene, id) && part.touches(&scene.polygon(id));
        self.found.clear();
        match part {
            Part::Box(bounds) => {
                self.pipeline.box_query(scene, bounds, &mut self.found);
                self.found.retain(|&id| is_in(id));
            }
            Part::Sphere(sphere) => self.pipeline.sphere_query(scene, sphere, &mut is_in, &mut self.found),
        }
        self.found.extend(changed(waiting).filter(|&id| is_in(id)));
        self.found.iter().filter_map(|&id| scene.stroke_of(id).id()).collect()
    }

    /// The polygon whose box is nearest to a point, within `reach_m` along each axis. If several polygons are equally
    /// near, returns the polygon with the smallest id. `waiting` are the changes that no frame has applied to the index
    /// yet.
    pub fn nearest_box(
        &mut self,
        scene: &Scene,
        waiting: &[Change],
        point: Vec3,
        reach_m: f32,
    ) -> Option<PolygonId> {
        let reach = Aabb::cube(point, 2.0 * reach_m);
        self.found.clear();
        self.pipeline.box_query(scene, &reach, &mut self.found);
        self.found.extend(changed(waiting));
        self.searches.points += 1;
        self.searches.near += self.found.len() as u64;
        let is_near = |id: &PolygonId| is_there(scene, *id) && scene.bounds(*id).intersects(&reach);
        let distance = |id: &PolygonId| scene.bounds(*id).distance_squared(point);
        let near = self.found.iter().copied().filter(is_near);
        near.min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)))
    }
}

/// Whether a polygon of the index is in the scene, which may be a frame ahead.
pub(super) fn is_there(scene: &Scene, id: PolygonId) -> bool {
    id.index() < scene.polygon_count() && scene.is_visible(id)
}

/// The polygons that these changes insert or move. A polygon of a group that moves as a whole is found at its current
/// position.
fn changed(waiting: &[Change]) -> impl Iterator<Item = PolygonId> + '_ {
    waiting.iter().filter_map(|change| match *change {
        Change::Insert(id) | Change::Update(id) => Some(id),
        Change::Remove(_) | Change::Repaint(_) | Change::Place(_) => None,
    })
}
