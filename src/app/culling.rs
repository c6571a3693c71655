use std::time::Duration;

use crate::{
    index::{DrawList, IndexConfig, IndexKind, SpatialIndex},
    math::{Aabb, Ray},
    metrics::{FrameRecord, StageClock},
    occlusion::CullerKind,
    recording::StrokeId,
    scene::{Change, PolygonId, Scene},
    visibility::{OcclusionChoice, OcclusionPass, PassConfig, Pipeline, View},
};

use super::document::meet_polygon;

/// Nothing is looked for that others hide.
pub(super) const NO_OCCLUSION: OcclusionChoice = OcclusionChoice::Always(CullerKind::None);

/// Whether a stage of culling takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stages {
    /// Polygons outside the view are left out.
    pub frustum: bool,
}

impl Default for Stages {
    fn default() -> Self {
        Self { frustum: true }
    }
}

/// What filing a whole model into another index took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reindexed {
    /// The index.
    pub kind: IndexKind,
    /// Polygons filed.
    pub polygons: u64,
    /// Time.
    pub took: Duration,
}

/// What picking with a ray found and took since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PickCounts {
    /// Rays asked.
    pub rays: u64,
    /// Polygons that were tested exactly.
    pub tests: u64,
    /// Time of all, nanoseconds.
    pub total_ns: u64,
    /// Time of the last, nanoseconds.
    pub last_ns: u64,
    /// What the last ray met.
    pub last: Option<PolygonId>,
}

/// The culling of a frame, with switches that can be turned while it runs.
#[derive(Debug)]
pub struct Culling {
    kind: IndexKind,
    occlusion: OcclusionChoice,
    root: Aabb,
    pipeline: Pipeline,
    clock: StageClock,
    stages: Stages,
    reindexed: Option<Reindexed>,
    picks: PickCounts,
    /// The polygons to draw on each screen for each eye.
    lists: Vec<DrawList>,
    /// One bit for each polygon, while the ones left out are looked for.
    marks: Vec<u64>,
}

impl Culling {
    /// Culling with an empty index.
    pub fn new(kind: IndexKind) -> Self {
        let clock = StageClock::default();
        let root = root_for(&Aabb::EMPTY);
        Self {
            kind,
            occlusion: NO_OCCLUSION,
            root,
            pipeline: create(kind, NO_OCCLUSION, root, 0, clock),
            clock,
            stages: Stages::default(),
            reindexed: None,
            picks: PickCounts::default(),
            lists: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// The index in use.
    pub fn kind(&self) -> IndexKind {
        self.kind
    }

    /// How polygons are found that others hide.
    pub fn occlusion(&self) -> OcclusionChoice {
        self.occlusion
    }

    /// The index itself.
    pub fn index(&self) -> &dyn SpatialIndex {
        self.pipeline.index()
    }

    /// The root cube of the index.
    pub fn root(&self) -> Aabb {
        self.root
    }

    /// The stages that take part.
    pub fn stages(&self) -> Stages {
        self.stages
    }

    /// Turns stages on and off.
    pub fn set_stages(&mut self, stages: Stages) {
        self.stages = stages;
    }

    /// What the last change of the index took.
    pub fn reindexed(&self) -> Option<Reindexed> {
        self.reindexed
    }

    /// What picking took.
    pub fn picks(&self) -> PickCounts {
        self.picks
    }

    /// Files the whole model into another index (or anew into the same). Changes of the scene that no frame has seen
    /// yet must not be given to the next frame: they are filed here.
    pub fn reindex(&mut self, kind: IndexKind, occlusion: OcclusionChoice, scene: &Scene, bounds: &Aabb) {
        let start = self.clock.start();
        let root = root_for(bounds);
        let mut pipeline = create(kind, occlusion, root, scene.polygon_count(), self.clock);
        pipeline.load(scene);
        let took = Duration::from_nanos(self.clock.since(start).ns);
        let polygons = pipeline.index().len() as u64;
        (self.kind, self.occlusion, self.root, self.pipeline) = (kind, occlusion, root, pipeline);
        self.reindexed = Some(Reindexed { kind, polygons, took });
    }

    /// The index follows changes without a frame.
    pub fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        self.pipeline.skip(scene, changes);
    }

    /// One frame: the index follows the changes and is asked what each of `views` may see. What others hide is left out
    /// of the first view alone.
    pub fn frame(&mut self, scene: &Scene, changes: &[Change], views: &[View]) -> FrameRecord {
        self.lists.resize_with(views.len(), DrawList::new);
        let Some((first, others)) = views.split_first() else {
            // Nothing is looked at, but nothing may be missed either.
            self.pipeline.skip(scene, changes);
            return FrameRecord::default();
        };
        let mut record = self.pipeline.frame(scene, changes, first);
        for (list, view) in self.lists[1..].iter_mut().zip(others) {
            let start = self.clock.start();
            list.clear();
            record.work += self.pipeline.index().frustum_cull(&view.frustum(), list);
            record.cull.ns += self.clock.since(start).ns;
        }
        if self.stages.frustum {
            self.lists[0].clone_from(self.pipeline.draw_list());
        } else {
            for list in &mut self.lists {
                list.clear();
                list.ids_mut().extend(scene.visible_ids());
            }
        }
        record
    }

    /// The polygons to draw in a view of the last frame; none if there was no such view.
    pub fn drawn(&self, view: usize) -> &[PolygonId] {
        self.lists.get(view).map_or(&[], DrawList::ids)
    }

    /// Appends the polygons that no view of the last frame draws: those outside of all views, and those in view that
    /// others hide.
    pub fn left_out(&mut self, scene: &Scene, outside: &mut Vec<PolygonId>, hidden: &mut Vec<PolygonId>) {
        self.marks.clear();
        self.marks.resize(scene.polygon_count().div_ceil(64), 0);
        for id in self.lists.iter().flat_map(DrawList::ids) {
            self.marks[id.index() / 64] |= 1 << (id.index() % 64);
        }
        let is_drawn = |id: &PolygonId, marks: &[u64]| marks[id.index() / 64] >> (id.index() % 64) & 1 == 1;
        let first_hidden = hidden.len();
        hidden.extend(self.pipeline.in_view().ids().iter().filter(|id| !is_drawn(id, &self.marks)));
        for id in &hidden[first_hidden..] {
            self.marks[id.index() / 64] |= 1 << (id.index() % 64);
        }
        outside.extend(scene.visible_ids().filter(|id| !is_drawn(id, &self.marks)));
    }

    /// The polygon that a ray meets first, and the ray's parameter there; polygons of the stroke `without` do not count.
    /// `waiting` is what no frame has brought to the index yet.
    pub fn pick(
        &mut self,
        scene: &Scene,
        waiting: &[Change],
        ray: &Ray,
        without: Option<StrokeId>,
    ) -> Option<(PolygonId, f32)> {
        let start = self.clock.start();
        let mut tests = 0;
        let mut meet = |id: PolygonId| {
            tests += 1;
            // The index may be a frame behind the scene.
            let is_there = id.index() < scene.polygon_count() && scene.is_visible(id);
            let counts = is_there && (without.is_none() || scene.stroke_of(id).id() != without);
            if counts { meet_polygon(scene, id, ray) } else { None }
        };
        let mut found = self.pipeline.index().ray_nearest(ray, f32::MAX, &mut meet);
        for change in waiting {
            if let Change::Insert(id) | Change::Update(id) = *change
                && let Some(t) = meet(id)
                && found.is_none_or(|(_, nearest)| t < nearest)
            {
                found = Some((id, t));
            }
        }
        self.picks.last_ns = self.clock.since(start).ns;
        self.picks.total_ns += self.picks.last_ns;
        self.picks.rays += 1;
        self.picks.tests += tests;
        self.picks.last = found.map(|(id, _)| id);
        found
    }
}

/// The usual root cube if everything is in it, else one around everything.
fn root_for(bounds: &Aabb) -> Aabb {
    let usual = IndexConfig::default().root;
    if bounds.is_empty() || usual.contains(bounds) {
        return usual;
    }
    Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.25)
}

fn create(
    kind: IndexKind,
    occlusion: OcclusionChoice,
    root: Aabb,
    polygons: usize,
    clock: StageClock,
) -> Pipeline {
    // Room for as much again: growing should not fall into a frame.
    let capacity = IndexConfig::default().capacity.max(polygons * 2);
    let pipeline = Pipeline::new(kind.create(&IndexConfig { root, capacity }), capacity, clock);
    match occlusion {
        NO_OCCLUSION => pipeline,
        choice => pipeline.with_occlusion(OcclusionPass::new(PassConfig::new(choice), capacity)),
    }
}
