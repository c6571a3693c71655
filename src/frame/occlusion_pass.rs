use crate::{
    frame::{OcclusionRecord, Pass, PassInput, PreviousFramePass, idle_backoff::IdleBackoff},
    occlusion::{
        AutoConfig, AutoSwitch, CullConfig, MakeCuller, NodeTest, Occlusion, OcclusionConfig, OcclusionStage,
        Outcome, Score, SelectConfig, ShadowVolume, ViewInput, work_ns,
    },
    polygon::{Change, Geometry, VisibleBlocks},
    view::{View, ViewWindow},
};

/// Largest number of changes of an ordinary frame. More changes come from a jump in a replay, or from opening a file.
const FEW_CHANGES: usize = 1024;

/// The measure by which [`Occlusion::Auto`] selects the cheapest method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AutoBasis {
    /// Work counts, which are the same on every machine.
    #[default]
    Work,
    /// Measured times, which adapt to the machine.
    Time,
}

/// Settings of occlusion culling in a [`super::Pipeline`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassConfig {
    /// The method of occlusion culling.
    pub choice: Occlusion,
    /// Largest number of occluders of a view. `None` means 64, or 16 for [`Occlusion::Auto`] if drawing a polygon costs
    /// less than 640 ns.
    pub occluders: Option<usize>,
    /// Time to draw one polygon, nanoseconds. A test takes about 100 ns, and is made only if it may save at least 400
    /// ns of drawing. With 400 ns or more, every polygon is tested. With 10 ns, only nodes of the index with at least
    /// 40 polygons are tested.
    pub polygon_ns: f64,
    /// The measure that [`Occlusion::Auto`] compares.
    #[doc(hidden)]
    pub basis: AutoBasis,
    /// The bounding volume that represents a node in its test.
    #[doc(hidden)]
    pub node_test: NodeTest,
    /// The score by which occluders are selected.
    #[doc(hidden)]
    pub score: Score,
}

impl Default for PassConfig {
    /// The settings of [`Occlusion::Auto`].
    fn default() -> Self {
        Self::new(Occlusion::Auto)
    }
}

impl PassConfig {
    /// Settings for an engine that draws a mesh for each "polygon". Drawing a mesh is assumed to take 10 µs, so every
    /// mesh is tested. The largest number of occluders is the default of `choice`.
    pub fn new(choice: Occlusion) -> Self {
        Self {
            choice,
            occluders: None,
            polygon_ns: MESH_NS,
            basis: AutoBasis::default(),
            node_test: CullConfig::default().node_test,
            score: Score::default(),
        }
    }

    /// Settings for the polygons of strokes, which are drawn by the thousand: drawing a polygon is assumed to take 10
    /// ns.
    pub fn for_strokes(choice: Occlusion) -> Self {
        Self { polygon_ns: AutoConfig::default().polygon_ns, ..Self::new(choice) }
    }

    /// The same settings, but [`Occlusion::Auto`] compares measured times instead of work counts. It then adapts to the
    /// machine, so the drawn polygons may differ from run to run.
    #[must_use]
    pub fn by_measured_times(self) -> Self {
        Self { basis: AutoBasis::Time, ..self }
    }

    /// Configuration of the traversal that tests nodes and polygons.
    fn cull(&self) -> CullConfig {
        CullConfig { node_test: self.node_test, ..CullConfig::for_drawing(self.polygon_ns) }
    }

    /// Largest number of occluders of a view.
    fn occluders(&self) -> usize {
        self.occluders.unwrap_or(match self.choice {
            // The first few occluders hide most. Further occluders pay for their selection only if drawing a polygon costs
            // much.
            Occlusion::Auto if self.polygon_ns < MANY_OCCLUDERS_NS => 16,
            _ => SelectConfig::default().occluders,
        })
    }
}

/// Time to draw a mesh, nanoseconds: a draw call, and a few thousand vertices.
const MESH_NS: f64 = 10_000.0;

/// If drawing a polygon costs at least this, nanoseconds, [`Occlusion::Auto`] selects as many occluders as the other
/// methods.
const MANY_OCCLUDERS_NS: f64 = 640.0;

/// If the previous-frame method was not used for more than this number of frames, its list of hidden polygons is
/// cleared. All polygons in view are then its occluders.
const LONGEST_UNUSED: u32 = 8;

/// Occlusion culling as the pass of a [`super::Pipeline`]. [`super::Pipeline::with_occlusion`] creates it.
#[derive(Debug)]
pub struct OcclusionPass {
    config: PassConfig,
    make: MakeCuller,
    /// Largest number of occluders of a view.
    occluders: usize,
    stage: OcclusionStage,
    switch: Option<AutoSwitch>,
    /// Pauses after frames without hidden polygons; used only if `switch` is `None`.
    idle: IdleBackoff,
    /// Whether many polygons were inserted while no occluders were selected. The best occluders may then not be
    /// candidates yet.
    may_miss_occluders: bool,
    /// The method [`Occlusion::PreviousFrame`] for `switch`, if it can ever save enough time.
    previous_frame: Option<PreviousFramePass>,
    /// Number of frames since `previous_frame` was used.
    since_last: u32,
    /// Whether `previous_frame` culled the last frame.
    by_last: bool,
    /// The polygons to draw in each view.
    drawn: Vec<VisibleBlocks>,
    /// Number of polygons that each set of `drawn` has room for.
    capacity: usize,
}

impl OcclusionPass {
    /// A pass before its first frame, with room for `capacity` polygons.
    pub fn new(config: PassConfig, capacity: usize) -> Self {
        Self::with_culler(config.choice.culler(), config, capacity)
    }

    /// A pass with the caller's own cullers, which `make` creates. [`Occlusion::Auto`] selects in each frame no
    /// culling, culling by `make`'s cullers, or [`Occlusion::PreviousFrame`]. Every other choice always uses `make`'s
    /// cullers.
    pub fn with_culler(make: MakeCuller, config: PassConfig, capacity: usize) -> Self {
        let select =
            SelectConfig { score: config.score, occluders: config.occluders(), ..SelectConfig::default() };
        let cull = config.cull();
        let stage = OcclusionConfig { select, cull, ..OcclusionConfig::default() };
        let mut stage = OcclusionStage::with_culler(make(config.occluders()), stage);
        stage.reserve(capacity);
        let auto = AutoConfig { polygon_ns: config.polygon_ns, ..AutoConfig::default() };
        let is_auto = config.choice == Occlusion::Auto;
        let switch = is_auto.then(|| AutoSwitch::new(auto));
        let has_previous_frame = switch.as_ref().is_some_and(|switch| switch.can_previous_frame_pay());
        Self {
            stage,
            switch,
            idle: IdleBackoff::default(),
            may_miss_occluders: false,
            previous_frame: has_previous_frame.then(|| PreviousFramePass::new(capacity)),
            since_last: u32::MAX,
            by_last: false,
            occluders: config.occluders(),
            config,
            make,
            drawn: vec![VisibleBlocks::with_capacity(capacity)],
            capacity,
        }
    }

    /// The settings of the pass.
    pub fn config(&self) -> &PassConfig {
        &self.config
    }

    /// Largest number of occluders of a view.
    pub fn most_occluders(&self) -> usize {
        self.occluders
    }

    /// The shadows of the first view's occluders, the best first, relative to the eye, for the last frame with
    /// occlusion culling.
    pub fn shadows(&self) -> &[ShadowVolume] {
        self.stage.view().selector().chosen()
    }

    /// Whether the occluders of the last frame were the polygons that were visible in the frame before it.
    pub fn is_by_last(&self) -> bool {
        self.by_last
    }

    /// Passes every change to the previous-frame method, even if the frame does not use this method.
    fn follow_last(&mut self, changes: &[Change]) {
        if let Some(last) = &mut self.previous_frame {
            last.follow(changes);
        }
    }

    /// Updates the candidates within the idle budget of the switch. Returns the time spent, nanoseconds, estimated from
    /// work counts.
    fn follow_roughly(&mut self, geometry: &dyn Geometry, changes: &[Change]) -> f64 {
        let budget_ns = self.switch.as_ref().map_or(0.0, AutoSwitch::idle_budget_ns);
        self.stage.follow_roughly(geometry, changes, budget_ns)
    }

    /// Subtracts the time that a frame spent on candidates from the idle budget.
    fn spend_idle(&mut self, counted_ns: f64, measured_ns: u64) {
        if let Some(switch) = &mut self.switch {
            // The measured time counts only if candidates were updated.
            let is_measured = self.config.basis == AutoBasis::Time && counted_ns > 0.0;
            switch.spend_idle(if is_measured { counted_ns.max(measured_ns as f64) } else { counted_ns });
        }
    }

    /// Passes the counts and cost of a frame to the switch.
    fn note(&mut self, record: &OcclusionRecord, work_ns: f64) {
        if let Some(switch) = &mut self.switch {
            let cost_ns = match self.config.basis {
                AutoBasis::Time => record.total_ns() as f64,
                AutoBasis::Work => work_ns,
            };
            switch.note(Outcome { cost_ns, culled: record.occluded });
        }
    }

    /// Selects occluders, builds the culler and culls for one view. Returns the cost, nanoseconds, computed from work
    /// counts.
    fn cull(
        &mut self,
        frame: &PassInput<'_>,
        view: &View,
        window: &ViewWindow,
        number: usize,
        record: &mut OcclusionRecord,
    ) -> f64 {
        let PassInput { index, geometry, clock, in_view, spaces, .. } = *frame;
        let input =
            ViewInput { index, geometry, view, in_view: &in_view[number], spaces: spaces.get(number) };
        let (pool, occlusion) = self.stage.parts();
        let start = clock.start();
        let select = occlusion.select(pool, geometry, window);
        record.select += clock.since(start);

        let start = clock.start();
        let build = occlusion.build(window);
        record.build += clock.since(start);

        let start = clock.start();
        let cull = occlusion.remove_hidden(&input, &mut self.drawn[number]);
        record.query += clock.since(start);

        record.occluders += u64::from(select.chosen);
        record.nodes += u64::from(build.nodes);
        record.tests += cull.node_tests + cull.polygon_tests;
        work_ns(&select, &build, &cull)
    }
}

impl Pass for OcclusionPass {
    fn load(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.follow_last(changes);
        self.stage.follow(geometry, changes);
    }

    fn skip(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        self.follow_last(changes);
        self.stage.follow_roughly(geometry, changes, 0.0);
        self.may_miss_occluders |= !changes.is_empty();
    }

    /// The views share the candidates. Each view has its own occluders and tree, because the near plane and the sides
    /// of its frustum clip them.
    fn frame(&mut self, frame: &PassInput<'_>) -> OcclusionRecord {
        let PassInput { geometry, changes, views, in_view, clock, .. } = *frame;
        let mut record = OcclusionRecord::default();
        self.follow_last(changes);
        let seen = in_view.iter().map(|list| list.len() as u64).sum();
        if let Some(switch) = &mut self.switch
            && changes.is_empty()
            && !switch.can_pay(seen)
        {
            // The frame ends here, because reading the clock would take longer than the remaining work. A later frame
            // updates the candidates.
            switch.decide(seen);
            self.since_last = self.since_last.saturating_add(1);
            self.by_last = false;
            return record;
        }
        let start = clock.start();
        self.may_miss_occluders |= changes.len() > FEW_CHANGES;
        if self.switch.is_none() {
            let stage = &self.stage;
            let comes_large = || stage.comes_large(geometry, changes, views);
            if self.idle.skips_frame(seen, views, comes_large) {
                self.stage.follow_roughly(geometry, changes, 0.0);
                record.select = clock.since(start);
                return record;
            }
        }
        let decided = match &mut self.switch {
            Some(switch) => switch.decide(seen),
            None => self.config.choice,
        };
        let is_off = (self.switch.is_some() && decided == Occlusion::None)
            || views.iter().all(|view| view.window().is_none());
        let is_by_last = !is_off && self.switch.is_some() && decided == Occlusion::PreviousFrame;
        self.since_last = self.since_last.saturating_add(1);
        self.by_last = false;
        // Unless the kept method (`AutoSwitch::kept`) uses candidates, the idle budget limits their update.
        let spent_ns = match self.switch.as_ref().is_none_or(|switch| switch.kept() == Occlusion::Msvbsp) {
            true if !is_off && !is_by_last => {
                self.stage.follow_in_steps(geometry, changes);
                0.0
            }
            _ => self.follow_roughly(geometry, changes),
        };
        record.select = clock.since(start);
        self.spend_idle(spent_ns, record.select.ns);
        if is_off {
            return record;
        }
        if let Some(last) = self.previous_frame.as_mut().filter(|_| is_by_last) {
            let start = clock.start();
            if self.since_last > LONGEST_UNUSED {
                last.forget(in_view.len());
            }
            record.select += clock.since(start);
            (self.since_last, self.by_last) = (0, true);
            let (by_last, work_ns) = last.cull(frame);
            record = OcclusionRecord { select: record.select, ..by_last };
            self.note(&record, work_ns);
            return record;
        }
        self.drawn.resize_with(views.len(), || VisibleBlocks::with_capacity(self.capacity));
        let mut work_cost_ns = 0.0;
        // The views are culled in reverse order, so that the stage keeps the state of the first view.
        for (i, view) in views.iter().enumerate().rev() {
            let Some(window) = view.window() else {
                self.drawn[i].copy_from(&in_view[i]);
                continue;
            };
            work_cost_ns += self.cull(frame, view, &window, i, &mut record);
        }
        record.used = true;
        let drawn: u64 = self.drawn.iter().map(|list| list.len() as u64).sum();
        record.occluded = seen - drawn.min(seen);
        self.may_miss_occluders &= self.stage.is_behind(geometry);
        if !self.may_miss_occluders {
            self.idle.note(record.occluded, seen, views);
        }
        self.note(&record, work_cost_ns);
        record
    }

    fn drawn(&self) -> &[VisibleBlocks] {
        self.previous_frame.as_ref().filter(|_| self.by_last).map_or(&self.drawn, |last| last.drawn())
    }

    fn set_occluders(&mut self, occluders: Option<usize>) {
        self.config.occluders = occluders;
        self.idle = IdleBackoff::default();
        self.occluders = self.config.occluders();
        self.stage.set_culler((self.make)(self.occluders), self.occluders);
    }

    fn set_polygon_ns(&mut self, polygon_ns: f64) {
        let Some(switch) = &mut self.switch else { return };
        switch.set_polygon_ns(polygon_ns);
        self.config.polygon_ns = polygon_ns;
        self.stage.set_cull(self.config.cull());
        // The number of occluders never decreases, because a measured cost fluctuates.
        if self.config.occluders() > self.occluders {
            self.occluders = self.config.occluders();
            self.stage.set_culler((self.make)(self.occluders), self.occluders);
        }
        if self.previous_frame.is_none() && switch.can_previous_frame_pay() {
            self.previous_frame = Some(PreviousFramePass::new(self.capacity));
        }
    }
}
