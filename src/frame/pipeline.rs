use std::any::Any;

use crate::{
    frame::{
        FrameRecord, OcclusionPass, Pass, PassConfig, PassInput, PreviousFramePass, StageClock,
        spaces::Spaces,
    },
    index::{IndexConfig, IndexError, SpatialIndex, WorkCounts},
    math::{Aabb, Frustum, Ray, Sphere},
    occlusion::{MakeCuller, Occlusion},
    polygon::{Change, Geometry, PolygonId, SpacesInView, VisibleBlocks},
    view::View,
};

static NOTHING: VisibleBlocks = VisibleBlocks::new();

/// Number of changes that are announced to the index together.
const ANNOUNCED: usize = 16;

/// Number of polygons that a step of loading inserts. It is a multiple of [`ANNOUNCED`], so that the same changes are
/// announced together.
const LOADED_AT_ONCE: usize = 64 * ANNOUNCED;

/// Largest number of updates in one call of [`SpatialIndex::update_all`].
const MOST_TOGETHER: usize = 256;
/// Fewer consecutive updates than this are passed to the index one by one.
const LEAST_TOGETHER: usize = 4;

/// An index, and all state that culling keeps from frame to frame. No frame allocates once the draw lists have
/// grown.
pub struct Pipeline {
    index: Box<dyn SpatialIndex>,
    /// The polygons in spaces that move as a whole. They are not in the index.
    spaces: Spaces,
    /// For each view, the polygons of these spaces in its frustum.
    in_spaces: Vec<SpacesInView>,
    /// The frustum of each view, in reused memory.
    frusta: Vec<Frustum>,
    /// For each view, the polygons in its frustum.
    in_view: Vec<VisibleBlocks>,
    /// Number of polygons that each set of `in_view` has room for.
    capacity: usize,
    pass: Option<Box<dyn Pass>>,
    /// Whether occlusion culling ran in the last frame.
    occluded: bool,
    clock: StageClock,
    /// Buffer for the updates of one call of [`SpatialIndex::update_all`].
    together: Vec<(PolygonId, Aabb)>,
    /// Buffer for the errors of this call.
    rejected: Vec<IndexError>,
    refused: u64,
    /// While a model is loaded in steps: the insertions of all polygons, and the number of insertions already done.
    loading: Option<(Vec<Change>, usize)>,
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
    /// A pipeline around an empty index. The lists have room for `capacity` polygons, at most
    /// [`IndexConfig::MOST_RESERVED`]. While all numbers lie below twice this capacity, the list of a view does not grow
    /// after the view's first frame. More polygons are accepted, too.
    pub fn new(index: Box<dyn SpatialIndex>, capacity: usize) -> Self {
        // The room is twice the capacity, because some numbers are unused if polygons come and go.
        let capacity = 2 * capacity.min(IndexConfig::MOST_RESERVED);
        Self {
            index,
            spaces: Spaces::new(),
            in_spaces: Vec::new(),
            frusta: Vec::with_capacity(1),
            in_view: vec![VisibleBlocks::with_capacity(capacity)],
            capacity,
            pass: None,
            occluded: false,
            clock: StageClock::default(),
            together: Vec::with_capacity(MOST_TOGETHER),
            rejected: Vec::with_capacity(MOST_TOGETHER),
            refused: 0,
            loading: None,
            frame: 0,
        }
    }

    /// Measures the stages of a frame by the caller's own clock.
    #[doc(hidden)]
    #[must_use]
    pub fn with_clock(self, clock: StageClock) -> Self {
        Self { clock, ..self }
    }

    /// Sets the caller's own pass, which replaces the former pass. Call it before the first frame.
    #[doc(hidden)]
    #[must_use]
    pub fn with_pass(mut self, pass: impl Pass) -> Self {
        self.pass = Some(Box::new(pass));
        self
    }

    /// Adds occlusion culling after the frustum. Call it before the first frame.
    #[must_use]
    pub fn with_occlusion(self, config: PassConfig) -> Self {
        let capacity = self.capacity;
        match config.choice {
            Occlusion::None => self,
            Occlusion::PreviousFrame => self.with_pass(PreviousFramePass::new(capacity)),
            Occlusion::Msvbsp | Occlusion::Depth | Occlusion::Auto => {
                self.with_pass(OcclusionPass::new(config, capacity))
            }
        }
    }

    /// Adds occlusion culling with the caller's own cullers ([`OcclusionPass::with_culler`]).
    #[doc(hidden)]
    #[must_use]
    pub fn with_culler(self, make: MakeCuller, config: PassConfig) -> Self {
        let capacity = self.capacity;
        self.with_pass(OcclusionPass::with_culler(make, config, capacity))
    }

    /// Runs one frame: applies the changes, culls by the frustum and by occlusion. [`Pipeline::draw_list`] then
    /// contains the polygons to draw. `changes` are the changes since the previous frame, in their order. `geometry`
    /// must already contain these changes, because the index reads the boxes from it.
    pub fn frame(&mut self, geometry: &dyn Geometry, changes: &[Change], view: &View) -> FrameRecord {
        self.frame_of_views(geometry, changes, std::slice::from_ref(view))
    }

    /// Runs a frame with several views (screens, eyes), each culled separately. [`Pipeline::draw_lists`] has a list for
    /// each view; the record is the sum over the views. Some indexes cull both eyes of a headset in one traversal.
    pub fn frame_of_views(
        &mut self,
        geometry: &dyn Geometry,
        changes: &[Change],
        views: &[View],
    ) -> FrameRecord {
        let mut record = FrameRecord { frame: self.frame, ..FrameRecord::default() };
        self.in_view.resize_with(views.len(), || VisibleBlocks::with_capacity(self.capacity));
        self.in_view.iter_mut().for_each(VisibleBlocks::clear);

        let stage = self.clock.start();
        self.apply(geometry, changes, &mut record);
        self.index.commit();
        if !self.spaces.is_unused() {
            self.spaces.commit();
        }
        record.insert = self.clock.since(stage);

        let stage = self.clock.start();
        self.frusta.clear();
        self.frusta.extend(views.iter().map(View::frustum));
        record.work = self.index.frustum_cull_views(&self.frusta, &mut self.in_view);
        if !self.spaces.is_unused() {
            record.work += self.cull_spaces(geometry);
        }
        record.cull = self.clock.since(stage);

        record.polygons = self.polygon_count() as u64;
        record.views = views.len() as u64;
        record.visible = self.in_view.iter().map(|list| list.len() as u64).sum();
        if let Some(pass) = &mut self.pass {
            let (index, in_view, spaces) = (&*self.index, &*self.in_view, &*self.in_spaces);
            let input = PassInput { index, geometry, changes, views, in_view, spaces, clock: &self.clock };
            record.occlusion = pass.frame(&input);
        }
        self.occluded = record.occlusion.used;
        self.frame += 1;
        record
    }

    /// Adds the polygons in view that belong to spaces.
    fn cull_spaces(&mut self, geometry: &dyn Geometry) -> WorkCounts {
        let mut work = WorkCounts::default();
        self.in_spaces.resize_with(self.frusta.len(), SpacesInView::default);
        for ((frustum, in_spaces), in_view) in
            self.frusta.iter().zip(&mut self.in_spaces).zip(&mut self.in_view)
        {
            in_spaces.clear();
            work += self.spaces.frustum_cull(geometry, frustum, in_spaces);
            in_spaces.add_to(in_view);
        }
        work
    }

    /// Applies the changes of a frame that is not drawn. Nothing is measured or culled. The index does its upkeep as in
    /// any frame, so that a query finds it in the same state.
    pub fn skip(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.apply(geometry, changes, &mut FrameRecord::default());
        if !self.index.may_skip_commits() {
            self.index.commit();
        }
        if let Some(pass) = &mut self.pass {
            pass.skip(geometry, changes);
        }
        self.frame += 1;
    }

    /// Inserts all present polygons before the first frame. No frame's time includes this work.
    pub fn load(&mut self, geometry: &dyn Geometry) {
        let all = present(geometry);
        self.apply(geometry, &all, &mut FrameRecord::default());
        if let Some(pass) = &mut self.pass {
            pass.load(geometry, &all);
        }
    }

    /// Ends a series of calls of [`Pipeline::skip`]: prepares the index for queries.
    pub fn commit(&mut self) {
        self.index.commit();
        if !self.spaces.is_unused() {
            self.spaces.commit();
        }
    }

    /// Does one step of [`Pipeline::load`], for callers with little time in each frame. All steps together insert the
    /// polygons that were present at the first step. Returns whether polygons are left.
    pub fn load_some(&mut self, geometry: &dyn Geometry) -> bool {
        let (all, at) = self.loading.take().unwrap_or_else(|| (present(geometry), 0));
        let end = all.len().min(at + LOADED_AT_ONCE);
        self.apply(geometry, &all[at..end], &mut FrameRecord::default());
        if let Some(pass) = &mut self.pass {
            pass.load(geometry, &all[at..end]);
        }
        let are_left = end < all.len();
        if are_left {
            self.loading = Some((all, end));
        }
        are_left
    }

    /// Passes the changes to the index. A polygon whose box is not finite cannot be drawn. The pipeline refuses
    /// and counts it. An `Update` with a finite box inserts it.
    fn apply(&mut self, geometry: &dyn Geometry, changes: &[Change], record: &mut FrameRecord) {
        let (mut at, mut announced) = (0, 0);
        while let Some(&change) = changes.get(at) {
            let together = leading_updates(&changes[at..]);
            if together >= LEAST_TOGETHER {
                record.updated += together as u64;
                self.index.announce(geometry, &changes[at..at + together]);
                self.apply_updates(geometry, &changes[at..at + together]);
                at += together;
                continue;
            }
            if at >= announced {
                announced = changes.len().min(at + ANNOUNCED);
                self.index.announce(geometry, &changes[at..announced]);
            }
            at += 1;
            let outcome = match change {
                Change::Insert(id) => {
                    record.inserted += 1;
                    match geometry.space(id) {
                        Some(space) => self.spaces.set(geometry, id, space),
                        None => self.index.insert(id, &geometry.bounds(id)),
                    }
                }
                Change::Remove(id) => {
                    record.removed += 1;
                    let outcome =
                        if self.spaces.holds(id) { self.spaces.remove(id) } else { self.index.remove(id) };
                    match outcome {
                        // The insertion of the polygon was refused.
                        Err(IndexError::Unknown(_)) => Ok(()),
                        outcome => outcome,
                    }
                }
                Change::Update(id) => {
                    record.updated += 1;
                    self.apply_update(geometry, id)
                }
                Change::Repaint(_) => continue,
                Change::Place(space) => {
                    self.spaces.place(geometry, space);
                    continue;
                }
            };
            self.refused += u64::from(outcome.is_err());
        }
    }

    /// Applies updates. Updates of polygons in the index are passed in one call. The result is the same as with single
    /// updates.
    fn apply_updates(&mut self, geometry: &dyn Geometry, updates: &[Change]) {
        self.together.clear();
        for &update in updates {
            let Change::Update(id) = update else { continue };
            if self.spaces.holds(id) || geometry.space(id).is_some() {
                self.refused += u64::from(self.apply_update(geometry, id).is_err());
            } else {
                self.together.push((id, geometry.bounds(id)));
            }
        }
        let mut rejected = std::mem::take(&mut self.rejected);
        self.index.update_all(&self.together, &mut rejected);
        for why in rejected.drain(..) {
            self.refused += u64::from(self.apply_update(geometry, why.polygon()).is_err());
        }
        self.rejected = rejected;
    }

    fn apply_update(&mut self, geometry: &dyn Geometry, id: PolygonId) -> Result<(), IndexError> {
        if let Some(space) = geometry.space(id) {
            // The polygon may have been in the index before.
            if !self.spaces.holds(id) {
                let _ = self.index.remove(id);
            }
            return self.spaces.set(geometry, id, space);
        }
        if self.spaces.holds(id) {
            self.spaces.remove(id)?;
        }
        let bounds = geometry.bounds(id);
        match self.index.update(id, &bounds) {
            Err(IndexError::Unknown(_)) => self.index.insert(id, &bounds),
            Err(refusal) => {
                // The polygon is removed, because it would still be drawn at its old place.
                self.index.remove(id)?;
                Err(refusal)
            }
            Ok(()) => Ok(()),
        }
    }

    /// The polygons to draw in each view, after the last frame.
    pub fn draw_lists(&self) -> &[VisibleBlocks] {
        self.pass.as_ref().filter(|_| self.occluded).map_or(&self.in_view, |pass| pass.drawn())
    }

    /// The polygons to draw in the first view; none if the last frame had no view.
    pub fn draw_list(&self) -> &VisibleBlocks {
        self.draw_lists().first().unwrap_or(&NOTHING)
    }

    /// The polygons in the frustum of each view, hidden or not, after the last frame.
    pub fn in_view_lists(&self) -> &[VisibleBlocks] {
        &self.in_view
    }

    /// The polygons in the frustum of the first view, hidden or not.
    pub fn in_view(&self) -> &VisibleBlocks {
        self.in_view.first().unwrap_or(&NOTHING)
    }

    /// Sets the largest number of occluders of a view, if the pipeline culls by occlusion; `None` sets the default of
    /// the method.
    pub fn set_occluders(&mut self, occluders: Option<usize>) {
        if let Some(pass) = &mut self.pass {
            pass.set_occluders(occluders);
        }
    }

    /// Sets the time to draw a polygon, nanoseconds. After the first frame only [`Occlusion::Auto`] adapts to a new value.
    pub fn set_polygon_ns(&mut self, polygon_ns: f64) {
        if let Some(pass) = &mut self.pass {
            pass.set_polygon_ns(polygon_ns);
        }
    }

    /// Whether occlusion culling ran in the last frame.
    pub fn is_occluded(&self) -> bool {
        self.occluded
    }

    /// The pass, if it is an [`OcclusionPass`].
    #[doc(hidden)]
    pub fn occlusion(&self) -> Option<&OcclusionPass> {
        let pass: &dyn Any = self.pass.as_deref()?;
        pass.downcast_ref()
    }

    /// Number of polygons in the index and in spaces that move as a whole.
    pub fn polygon_count(&self) -> usize {
        self.index.len() + self.spaces.len()
    }

    /// Memory of the index and the spaces, bytes.
    pub fn bytes(&self) -> usize {
        self.index.bytes() + self.spaces.bytes()
    }

    /// The nearest polygon that a ray meets, as [`SpatialIndex::ray_nearest`] finds it, also in spaces that move as a
    /// whole. `geometry` must return the current places of the spaces.
    pub fn ray_nearest(
        &self,
        geometry: &dyn Geometry,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let in_index = self.index.ray_nearest(ray, t_max, hit);
        let nearest = in_index.map_or(t_max, |(_, t)| t);
        let in_spaces = self.spaces.ray_nearest(geometry, ray, nearest, hit);
        match (in_index, in_spaces) {
            (Some(a), Some(b)) => Some(if (b.1, b.0) < (a.1, a.0) { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// Appends the polygons whose boxes share a point with `bounds`, as [`SpatialIndex::box_query`] finds them, also in
    /// spaces that move as a whole.
    pub fn box_query(&self, geometry: &dyn Geometry, bounds: &Aabb, out: &mut Vec<PolygonId>) {
        self.index.box_query(bounds, out);
        self.spaces.box_query(geometry, bounds, out);
    }

    /// Appends the polygons in a sphere that `is_in` accepts, as [`SpatialIndex::sphere_query`] finds them, also in spaces
    /// that move as a whole.
    pub fn sphere_query(
        &self,
        geometry: &dyn Geometry,
        sphere: &Sphere,
        is_in: &mut dyn FnMut(PolygonId) -> bool,
        out: &mut Vec<PolygonId>,
    ) {
        self.index.sphere_query(sphere, is_in, out);
        let first = out.len();
        self.spaces.box_query(geometry, &Aabb::cube(sphere.center, 2.0 * sphere.radius_m), out);
        let mut kept = first;
        for at in first..out.len() {
            if is_in(out[at]) {
                out.swap(kept, at);
                kept += 1;
            }
        }
        out.truncate(kept);
    }

    /// The index. Polygons in spaces that move as a whole are not in it.
    pub fn index(&self) -> &dyn SpatialIndex {
        &*self.index
    }

    /// The clock that measures the stages.
    #[doc(hidden)]
    pub fn clock(&self) -> &StageClock {
        &self.clock
    }

    /// Number of changes that the index has refused: the box was empty, infinite or NaN, or the number was inserted twice
    /// or is not below [`PolygonId::LIMIT`]. A polygon that was inserted and removed within one frame may count, too,
    /// because its box is already empty; this does no harm.
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

/// Returns an insertion for each present polygon.
fn present(geometry: &dyn Geometry) -> Vec<Change> {
    let ids = (0..geometry.id_end() as u32).map(PolygonId);
    ids.filter(|&id| geometry.is_present(id)).map(Change::Insert).collect()
}

/// Number of consecutive updates at the beginning of `changes`, at most [`MOST_TOGETHER`].
fn leading_updates(changes: &[Change]) -> usize {
    changes.iter().take(MOST_TOGETHER).take_while(|change| matches!(change, Change::Update(_))).count()
}
