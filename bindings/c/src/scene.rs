//! A scene of boxes and triangles, culled frame by frame by the frustum and by what hides what.

use osp::{
    frame::{FrameRecord, PassConfig, Pipeline, StageClock},
    glam::Vec3,
    index::Osp,
    math::{Aabb, Frustum},
    occlusion::Occlusion,
    polygon::{Change, PolygonId},
    view::View,
};

use crate::{
    border::Answer,
    index::{AskedRay, answer_frustum, answer_list, index_config, not_committed},
    status::{Failure, OspStatus, Outcome},
    things::{Thing, Things, is_in_reach},
    types::{OspBox, OspFrame, OspHit, OspOcclusion, OspRayMode, OspSceneConfig},
};

pub(crate) struct Scene {
    things: Things,
    pipeline: Pipeline,
    /// Since the last frame; kept for its memory.
    changes: Vec<Change>,
    /// Whether the pipeline has taken the first things.
    is_loaded: bool,
    /// Views of the last frame.
    views: usize,
}

impl Scene {
    pub(crate) fn new(config: Option<OspSceneConfig>) -> Outcome<Self> {
        let occlusion = config.map_or(Ok(Occlusion::Auto), |config| occlusion_of(config.occlusion))?;
        let index = index_config(config.map(|config| config.index))?;
        let mut pass = PassConfig::new(occlusion);
        if let Some(OspSceneConfig { draw_ns, .. }) = config {
            if !draw_ns.is_finite() || draw_ns <= 0.0 {
                let message = format!("draw_ns: expected a finite number above 0, found {draw_ns}");
                return Err(Failure::new(OspStatus::InvalidArgument, message));
            }
            pass.polygon_ns = f64::from(draw_ns);
        }
        let capacity = index.capacity;
        let pipeline = Pipeline::new(Box::new(Osp::new(&index)), capacity, StageClock::default());
        let pipeline = pipeline.with_occlusion(pass);
        let (things, changes) = (Things::with_capacity(capacity), Vec::with_capacity(capacity));
        Ok(Self { things, pipeline, changes, is_loaded: false, views: 0 })
    }

    pub(crate) fn insert(&mut self, things: Vec<Thing>) -> Outcome<Vec<u32>> {
        self.things.insert(things.into_iter())
    }

    pub(crate) fn update(&mut self, id: u32, thing: Thing) -> Outcome<()> {
        self.things.update(id, thing)
    }

    /// Moves a triangle; it is as opaque as it was.
    pub(crate) fn update_triangle(&mut self, id: u32, corners: [Vec3; 3]) -> Outcome<()> {
        let is_opaque = matches!(self.things.get(id), Some(Thing::Triangle { is_opaque: true, .. }));
        self.things.update(id, Thing::Triangle { corners, is_opaque })
    }

    pub(crate) fn remove(&mut self, id: u32) -> Outcome<()> {
        self.things.remove(id)
    }

    pub(crate) fn count(&self) -> usize {
        self.things.count()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.pipeline.bytes() + self.things.bytes() + self.changes.capacity() * size_of::<Change>()
    }

    /// Lets the pipeline take the first things, which it does in another way than changes.
    fn load(&mut self) {
        if !self.is_loaded {
            self.is_loaded = true;
            self.things.take_changes(&mut self.changes);
            self.pipeline.load(&self.things);
        }
    }

    pub(crate) fn commit(&mut self) {
        self.load();
        if self.things.is_touched() {
            self.things.take_changes(&mut self.changes);
            self.pipeline.skip(&self.things, &self.changes);
        }
        self.pipeline.commit();
    }

    pub(crate) fn frame(&mut self, views: &[View]) -> OspFrame {
        self.load();
        self.views = views.len();
        self.things.take_changes(&mut self.changes);
        let record: FrameRecord = self.pipeline.frame_of_views(&self.things, &self.changes, views);
        OspFrame {
            count: record.polygons,
            in_view: record.visible,
            visible: record.drawn(),
            occluders: record.occlusion.occluders,
            insert_ns: record.insert.ns,
            cull_ns: record.cull.ns,
            occlusion_ns: record.occlusion.total_ns(),
        }
    }

    /// What the last frame has left of a view.
    pub(crate) fn visible(&self, view: u32, answer: &Answer) -> Outcome<()> {
        let list = self.pipeline.draw_lists().get(view as usize).filter(|_| (view as usize) < self.views);
        let list = list.ok_or_else(|| {
            let message = format!("view: expected one of the {} of the last frame, found {view}", self.views);
            Failure::new(OspStatus::InvalidArgument, message)
        })?;
        answer.write(list.len(), list.ids().map(|id| id.0))
    }

    fn committed(&self) -> Outcome<&Pipeline> {
        if self.is_loaded && !self.things.is_touched() {
            return Ok(&self.pipeline);
        }
        Err(not_committed("osp_scene_commit or osp_scene_frame"))
    }

    pub(crate) fn frustum(&self, frustum: &Frustum, answer: &Answer) -> Outcome<()> {
        answer_frustum(self.committed()?.index(), frustum, answer)
    }

    pub(crate) fn box_query(&self, bounds: &Aabb, answer: &Answer) -> Outcome<()> {
        let pipeline = self.committed()?;
        answer_list(answer, |found| pipeline.box_query(&self.things, bounds, found))
    }

    pub(crate) fn ray(&self, asked: &AskedRay) -> Outcome<OspHit> {
        let AskedRay { ray, t_max, mode } = asked;
        let pipeline = self.committed()?;
        let mut meet = |id: PolygonId| self.things.get(id.0)?.meet(ray, *t_max);
        Ok(OspHit::from(match mode {
            OspRayMode::Nearest => pipeline.ray_nearest(&self.things, ray, *t_max, &mut meet),
            OspRayMode::Any => pipeline.index().ray_any(ray, *t_max, &mut meet),
        }))
    }
}

fn occlusion_of(occlusion: i32) -> Outcome<Occlusion> {
    let all = [
        (OspOcclusion::None, Occlusion::None),
        (OspOcclusion::Msvbsp, Occlusion::Msvbsp),
        (OspOcclusion::Depth, Occlusion::Depth),
        (OspOcclusion::DepthLast, Occlusion::PreviousFrame),
        (OspOcclusion::Auto, Occlusion::Auto),
    ];
    let found = all.iter().find(|(number, _)| *number as i32 == occlusion).map(|(_, method)| *method);
    found.ok_or_else(|| {
        let message = format!("occlusion: expected one of OspOcclusion, found {occlusion}");
        Failure::new(OspStatus::InvalidArgument, message)
    })
}

/// A box as a scene takes it.
pub(crate) fn box_of(bounds: &OspBox, at: usize) -> Outcome<Thing> {
    let bounds = bounds.checked(at)?;
    if is_in_reach(bounds.min) && is_in_reach(bounds.max) {
        return Ok(Thing::Box(bounds));
    }
    let message = format!("box {at}: expected coordinates up to 1e15, found {bounds:?}");
    Err(Failure::new(OspStatus::InvalidBox, message))
}

/// Corners as a scene takes them. `at` is the triangle's place in a list.
pub(crate) fn corners_of(corners: [Vec3; 3], at: usize) -> Outcome<[Vec3; 3]> {
    if corners.iter().all(|&corner| is_in_reach(corner)) {
        return Ok(corners);
    }
    let message = format!("triangle {at}: expected coordinates up to 1e15, found {corners:?}");
    Err(Failure::new(OspStatus::InvalidTriangle, message))
}
