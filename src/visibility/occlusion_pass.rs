use crate::{
    index::{DrawList, SpatialIndex},
    metrics::{OcclusionRecord, StageClock, fingerprint_of_frame},
    occlusion::{
        AutoConfig, AutoSwitch, CullConfig, CullerKind, OcclusionConfig, OcclusionStage, Outcome,
        SelectConfig, Soundness, work_ns,
    },
    scene::{Change, Scene},
    visibility::View,
};

/// Which culling by occlusion a pipeline does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OcclusionChoice {
    /// This method, in every frame.
    Always(CullerKind),
    /// [`CullerKind::Msvbsp`] in the frames in which it pays.
    Auto,
}

impl OcclusionChoice {
    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Always(kind) => kind.name(),
            Self::Auto => "auto",
        }
    }

    /// The choice with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "auto" => Some(Self::Auto),
            name => CullerKind::from_name(name).map(Self::Always),
        }
    }

    /// All names.
    pub fn names() -> impl Iterator<Item = &'static str> {
        CullerKind::ALL.iter().map(|kind| kind.name()).chain(["auto"])
    }

    /// Whether its answers can be relied upon.
    pub fn soundness(self) -> Soundness {
        self.kind().soundness()
    }

    fn kind(self) -> CullerKind {
        match self {
            Self::Always(kind) => kind,
            Self::Auto => CullerKind::Msvbsp,
        }
    }
}

/// What `auto` goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AutoBasis {
    /// The clock: it adapts to the machine.
    #[default]
    Time,
    /// Work counts: it decides the same on every machine.
    Work,
}

/// Settings of an [`OcclusionPass`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassConfig {
    /// Which method.
    pub choice: OcclusionChoice,
    /// Most occluders of a frame; `None` is 64, and 16 for `auto`.
    pub occluders: Option<usize>,
    /// What drawing a polygon costs, nanoseconds: what is worth a test, and what pays.
    pub polygon_ns: f64,
    /// What `auto` goes by.
    pub basis: AutoBasis,
}

impl PassConfig {
    /// The default settings of a method.
    pub fn new(choice: OcclusionChoice) -> Self {
        let AutoConfig { polygon_ns, .. } = AutoConfig::default();
        Self { choice, occluders: None, polygon_ns, basis: AutoBasis::default() }
    }

    /// Most occluders of a frame.
    fn occluders(&self) -> usize {
        self.occluders.unwrap_or(match self.choice {
            OcclusionChoice::Always(_) => SelectConfig::default().occluders,
            // The first few hide most: what the others add seldom pays for choosing them.
            OcclusionChoice::Auto => 16,
        })
    }
}

/// Culling by occlusion as a stage of a [`super::Pipeline`]: with what it keeps from frame to frame.
#[derive(Debug)]
pub struct OcclusionPass {
    config: PassConfig,
    stage: OcclusionStage,
    switch: Option<AutoSwitch>,
    drawn: DrawList,
}

impl OcclusionPass {
    /// A pass that has seen nothing yet, with room for this many polygons.
    pub fn new(config: PassConfig, capacity: usize) -> Self {
        let select = SelectConfig { occluders: config.occluders(), ..SelectConfig::default() };
        let cull = CullConfig::for_drawing(config.polygon_ns);
        let stage = OcclusionConfig { select, cull, ..OcclusionConfig::default() };
        let mut drawn = DrawList::new();
        drawn.reserve(capacity);
        let mut stage = OcclusionStage::new(config.choice.kind(), stage);
        stage.reserve(capacity);
        Self {
            stage,
            switch: (config.choice == OcclusionChoice::Auto).then(|| {
                AutoSwitch::new(AutoConfig { polygon_ns: config.polygon_ns, ..AutoConfig::default() })
            }),
            config,
            drawn,
        }
    }

    /// Its settings.
    pub fn config(&self) -> &PassConfig {
        &self.config
    }

    /// What is left of the last frame in which it was used.
    pub(super) fn drawn(&self) -> &DrawList {
        &self.drawn
    }

    /// All of the changes at once.
    pub(super) fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        self.stage.follow(scene, changes);
    }

    /// A frame that is not looked at.
    pub(super) fn skip(&mut self, scene: &Scene, changes: &[Change]) {
        self.stage.follow_roughly(scene, changes, 0.0);
    }

    fn follow_roughly(&mut self, scene: &Scene, changes: &[Change]) {
        let budget_ns = self.switch.as_ref().map_or(0.0, AutoSwitch::idle_budget_ns);
        let spent_ns = self.stage.follow_roughly(scene, changes, budget_ns);
        if let Some(switch) = &mut self.switch {
            switch.spend_idle(spent_ns);
        }
    }

    /// A frame: `in_view` is what the frustum may see.
    pub(super) fn frame(
        &mut self,
        index: &dyn SpatialIndex,
        scene: &Scene,
        changes: &[Change],
        view: &View,
        in_view: &DrawList,
        clock: &StageClock,
    ) -> OcclusionRecord {
        let mut record = OcclusionRecord::default();
        let seen = in_view.len() as u64;
        let start = clock.start();
        let wanted = self.switch.as_mut().is_none_or(|switch| switch.decide(seen));
        let Some(window) = wanted.then(|| view.window()).flatten() else {
            self.follow_roughly(scene, changes);
            record.select = clock.since(start);
            record.fingerprint = fingerprint_of_frame(in_view.ids());
            return record;
        };
        // A try makes do with the candidates that there are.
        match self.switch.as_ref().is_none_or(AutoSwitch::is_on) {
            true => self.stage.follow(scene, changes),
            false => self.follow_roughly(scene, changes),
        }
        let select = self.stage.select(scene, &window);
        record.select = clock.since(start);

        let start = clock.start();
        let build = self.stage.build(&window);
        record.build = clock.since(start);

        let start = clock.start();
        self.drawn.clear();
        let (cull, _) = self.stage.cull(index, scene, &view.frustum(), &mut self.drawn);
        record.query = clock.since(start);

        record.used = true;
        record.occluded = seen - (self.drawn.len() as u64).min(seen);
        record.occluders = u64::from(select.chosen);
        record.tests = cull.node_tests + cull.polygon_tests;
        record.fingerprint = fingerprint_of_frame(self.drawn.ids());
        if let Some(switch) = &mut self.switch {
            let cost_ns = match self.config.basis {
                AutoBasis::Time => record.total_ns() as f64,
                AutoBasis::Work => work_ns(&select, &build, &cull),
            };
            switch.note(Outcome { cost_ns, culled: record.occluded });
        }
        record
    }
}
