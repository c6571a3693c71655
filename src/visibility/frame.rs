use crate::{
    index::{DrawList, IndexError, SpatialIndex},
    math::Aabb,
    metrics::{FrameRecord, StageClock, fingerprint_of_views},
    scene::{Change, PolygonId, Scene},
    visibility::{LastPass, OcclusionChoice, OcclusionPass, PassConfig, View, pvs::PvsPass},
};

static NOTHING: DrawList = DrawList::new();

/// An index with everything it needs from frame to frame. Nothing here allocates once the draw list has grown.
pub struct Pipeline {
    index: Box<dyn SpatialIndex>,
    /// What the frustum of each view may see.
    in_view: Vec<DrawList>,
    /// Polygons that each of these has room for.
    capacity: usize,
    occlusion: Option<OcclusionPass>,
    pvs: Option<PvsPass>,
    last: Option<LastPass>,
    /// Whether the last frame was culled by occlusion.
    occluded: bool,
    clock: StageClock,
    refused: u64,
    frame: u64,
}

impl std::fmt::Debug for Pipeline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pipeline")
            .field("index", &self.index.name())
            .field("frame", &self.frame)
            .finish_non_exhaustive()
    }
}

impl Pipeline {
    /// A pipeline around an empty index. `capacity` is the number of polygons that the draw list of each view has room for:
    /// as long as there are no more, no list grows after the first frame with its view.
    pub fn new(index: Box<dyn SpatialIndex>, capacity: usize, clock: StageClock) -> Self {
        Self {
            index,
            in_view: vec![DrawList::with_capacity(capacity)],
            capacity,
            occlusion: None,
            pvs: None,
            last: None,
            occluded: false,
            clock,
            refused: 0,
            frame: 0,
        }
    }

    /// The pipeline with culling by occlusion after the frustum; before the first frame.
    #[must_use]
    pub fn with_occlusion(mut self, pass: OcclusionPass) -> Self {
        self.occlusion = Some(pass);
        self
    }

    /// The pipeline with the culling by occlusion that a choice names; before the first frame. Methods that need more than
    /// the scene, or work while drawing, are not a pipeline's: nothing is added for them.
    #[must_use]
    pub fn with_choice(self, config: PassConfig, capacity: usize) -> Self {
        match config.choice {
            OcclusionChoice::DepthLast => self.with_last(LastPass::new(capacity)),
            choice if choice.has_pass() => self.with_occlusion(OcclusionPass::new(config, capacity)),
            _ => self,
        }
    }

    /// The pipeline with what was visible in the last frame as occluders, in the place of culling by large ones.
    #[must_use]
    pub fn with_last(mut self, pass: LastPass) -> Self {
        self.last = Some(pass);
        self
    }

    /// The pipeline with the sets of what can be seen from where, in the place of culling by occlusion.
    #[must_use]
    pub fn with_pvs(mut self, pass: PvsPass) -> Self {
        self.pvs = Some(pass);
        self
    }

    /// One frame: file what came, cull by the frustum and by occlusion, and leave the polygons to draw in the draw list.
    pub fn frame(&mut self, scene: &Scene, changes: &[Change], view: &View) -> FrameRecord {
        self.frame_of_views(scene, changes, std::slice::from_ref(view))
    }

    /// A frame that is looked at in several views (screens, eyes), each culled for itself. The record is of all of them
    /// together.
    pub fn frame_of_views(&mut self, scene: &Scene, changes: &[Change], views: &[View]) -> FrameRecord {
        let mut record = FrameRecord { frame: self.frame, ..FrameRecord::default() };
        self.in_view.resize_with(views.len(), || DrawList::with_capacity(self.capacity));
        self.in_view.iter_mut().for_each(DrawList::clear);

        let stage = self.clock.start();
        self.file(scene, changes, &mut record);
        self.index.commit();
        record.insert = self.clock.since(stage);

        let stage = self.clock.start();
        for (view, list) in views.iter().zip(&mut self.in_view) {
            record.work += self.index.frustum_cull(&view.frustum(), list);
        }
        record.cull = self.clock.since(stage);

        record.polygons = self.index.len() as u64;
        record.visible = self.in_view.iter().map(|list| list.len() as u64).sum();
        record.fingerprint = fingerprint_of_views(&self.in_view);
        if let Some(pass) = &mut self.occlusion {
            record.occlusion = pass.frame(&*self.index, scene, changes, views, &self.in_view, &self.clock);
        }
        if let Some(pass) = &mut self.pvs {
            pass.follow(changes);
            record.occlusion = pass.frame(scene, views, &self.in_view, &self.clock);
        }
        if let Some(pass) = &mut self.last {
            (record.occlusion, _) = pass.frame(scene, views, &self.in_view, &self.clock);
        }
        self.occluded = record.occlusion.used;
        self.frame += 1;
        record
    }

    /// A frame that is not looked at: the index follows the changes, nothing is measured or culled.
    pub fn skip(&mut self, scene: &Scene, changes: &[Change]) {
        self.file(scene, changes, &mut FrameRecord::default());
        if let Some(pass) = &mut self.occlusion {
            pass.skip(scene, changes);
        }
        if let Some(pass) = &mut self.pvs {
            pass.follow(changes);
        }
        self.frame += 1;
    }

    /// Takes a whole model at once, before the first frame: nothing of it is left for later frames to look at.
    pub fn load(&mut self, scene: &Scene) {
        let all: Vec<Change> = scene.visible_ids().map(Change::Insert).collect();
        self.file(scene, &all, &mut FrameRecord::default());
        if let Some(pass) = &mut self.occlusion {
            pass.follow(scene, &all);
        }
        if let Some(pass) = &mut self.pvs {
            pass.follow(&all);
        }
    }

    /// Ends a row of frames that were not looked at: the index does what it has to do before it can be asked.
    pub fn commit(&mut self) {
        self.index.commit();
    }

    /// Hands the changes to the index. A polygon whose box is not finite (it cannot be drawn) is refused, counted, and
    /// filed once its box is finite again.
    fn file(&mut self, scene: &Scene, changes: &[Change], record: &mut FrameRecord) {
        let wants_shapes = self.index.wants_shapes();
        for &change in changes {
            let outcome = match change {
                Change::Insert(id) => {
                    record.inserted += 1;
                    self.index.insert(id, scene.bounds(id))
                }
                Change::Remove(id) => {
                    record.removed += 1;
                    match self.index.remove(id) {
                        // It was refused when it came.
                        Err(IndexError::Unknown(_)) => Ok(()),
                        outcome => outcome,
                    }
                }
                Change::Update(id) => {
                    record.updated += 1;
                    self.follow(id, scene.bounds(id))
                }
            };
            if let (true, Ok(()), Change::Insert(id) | Change::Update(id)) = (wants_shapes, outcome, change) {
                self.index.shape(id, &scene.polygon(id));
            }
            self.refused += u64::from(outcome.is_err());
        }
    }

    fn follow(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        match self.index.update(id, bounds) {
            Err(IndexError::Unknown(_)) => self.index.insert(id, bounds),
            Err(refusal) => {
                // At its old place it would be drawn where it no longer is.
                self.index.remove(id)?;
                Err(refusal)
            }
            Ok(()) => Ok(()),
        }
    }

    /// The polygons to draw in each view, as the last frame left them.
    pub fn draw_lists(&self) -> &[DrawList] {
        let of_last = self.last.as_ref().map(LastPass::drawn);
        let of_pvs = self.pvs.as_ref().map(PvsPass::drawn);
        let of_occluders = self.occlusion.as_ref().map(OcclusionPass::drawn);
        of_last.or(of_pvs).or(of_occluders).filter(|_| self.occluded).unwrap_or(&self.in_view)
    }

    /// The polygons to draw in the first view; none if the last frame had no view.
    pub fn draw_list(&self) -> &DrawList {
        self.draw_lists().first().unwrap_or(&NOTHING)
    }

    /// The polygons that the frustum of each view may see, occluded or not, as the last frame left them.
    pub fn in_view_lists(&self) -> &[DrawList] {
        &self.in_view
    }

    /// The polygons that the frustum of the first view may see.
    pub fn in_view(&self) -> &DrawList {
        self.in_view.first().unwrap_or(&NOTHING)
    }

    /// Changes the most occluders of a frame, if occlusion is looked for; `None` is the method's own number.
    pub fn set_occluders(&mut self, occluders: Option<usize>) {
        if let Some(pass) = &mut self.occlusion {
            pass.set_occluders(occluders);
        }
    }

    /// Says what drawing a polygon costs, nanoseconds, if occlusion is looked for where it pays.
    pub fn set_polygon_ns(&mut self, polygon_ns: f64) {
        if let Some(pass) = &mut self.occlusion {
            pass.set_polygon_ns(polygon_ns);
        }
    }

    /// Whether the last frame was culled by occlusion.
    pub fn is_occluded(&self) -> bool {
        self.occluded
    }

    /// Culling by occlusion, if there is any.
    pub fn occlusion(&self) -> Option<&OcclusionPass> {
        self.occlusion.as_ref()
    }

    /// The index.
    pub fn index(&self) -> &dyn SpatialIndex {
        &*self.index
    }

    /// Changes that the index refused since the beginning.
    pub fn refused(&self) -> u64 {
        self.refused
    }
}
