//! Compares occlusion culling with the true visibility. Measures the visible polygons that a method culls, the share of
//! the hidden polygons that it culls, and its cost.

use crate::{
    Method, lost_polygons,
    oracle::{Oracle, OracleConfig, Sight, Subject},
    pvs::Pvs,
};
use osp::{
    frame::StageClock,
    index::SpatialIndex,
    occlusion::{
        CullConfig, OccluderPool, Occlusion, OcclusionConfig, OcclusionCuller, PoolConfig,
        PreviousFrameOccluders, SelectConfig, Soundness, ViewInput, ViewOcclusion,
    },
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
    view::{View, ViewWindow},
};
use osp_session::scene::Scene;

#[derive(Clone, Debug, PartialEq)]
pub struct VerifyConfig {
    pub kinds: Vec<Method>,
    /// Numbers of occluders, each used with every method.
    pub occluders: Vec<usize>,
    /// Settings of the pool of occluder candidates.
    pub pool: PoolConfig,
    /// Settings of the selection of a view's occluders, except for their number.
    pub select: SelectConfig,
    /// Settings of the node tests.
    pub cull: CullConfig,
    /// Resolution of the [`Oracle`], which finds the visible polygons.
    pub oracle: OracleConfig,
    /// Number of times that each stage is measured; the fastest counts.
    pub repeats: u32,
}

/// Number of frames for which a camera rests at each view, for methods that depend on the previous frame. All these
/// methods have the same measured frames. Other methods do the same work in each frame, so they cull a single frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtRest {
    /// Number of frames before the measured frames. These frames only add culled visible polygons to the sums.
    pub settle: u32,
    /// Number of measured frames, at least 1.
    pub frames: u32,
}

impl Default for AtRest {
    /// One frame before three measured frames.
    fn default() -> Self {
        Self { settle: 1, frames: 3 }
    }
}

/// One method with one number of occluders, and its sums over all views so far.
pub struct Trial {
    occluders: usize,
    source: OccluderSource,
    totals: Totals,
}

enum OccluderSource {
    /// The best-scored polygons of the pool.
    Chosen(Box<ViewOcclusion>),
    /// The polygons that were visible in the previous frame.
    Last(Box<PreviousFrameOccluders>),
}

impl std::fmt::Debug for Trial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trial")
            .field("method", &self.name())
            .field("totals", &self.totals)
            .finish_non_exhaustive()
    }
}

/// Sums over the views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Totals {
    pub views: u64,
    /// Number of measured frames of these views; the sums are over these frames.
    pub frames: u64,
    /// Number of visible polygons that were culled, in all frames, measured or not.
    pub false_culls: u64,
    /// The first such polygon, with the number of its view.
    pub first_false: Option<(u64, PolygonId)>,
    /// Number of hidden polygons that were culled.
    pub hidden_culled: u64,
    pub hidden: u64,
    /// Number of polygons that the method left to draw.
    pub drawn: u64,
    /// Number of polygons that the method reported more than once, or that are not in the view.
    pub misreported: u64,
    pub occluders: u64,
    /// Number of nodes of the culler, or of covered tiles.
    pub planes: u64,
    pub node_tests: u64,
    pub polygon_tests: u64,
    pub select_ns: u64,
    pub build_ns: u64,
    /// Time to remove hidden polygons from the result of frustum culling, with all tests, as in a frame, nanoseconds.
    pub query_ns: u64,
}

impl Totals {
    /// Share of the hidden polygons that were culled, per cent.
    pub fn hidden_culled_percent(&self) -> f64 {
        if self.hidden == 0 { 0.0 } else { self.hidden_culled as f64 * 100.0 / self.hidden as f64 }
    }

    /// The mean of a sum over the measured frames.
    pub fn mean(&self, sum: u64) -> f64 {
        sum as f64 / self.frames.max(1) as f64
    }
}

impl Trial {
    pub fn name(&self) -> &'static str {
        match &self.source {
            OccluderSource::Chosen(occlusion) => occlusion.culler().name(),
            OccluderSource::Last(_) => Occlusion::PreviousFrame.name(),
        }
    }

    /// Whether the method guarantees that it culls no visible polygon.
    pub fn soundness(&self) -> Soundness {
        match &self.source {
            OccluderSource::Chosen(occlusion) => occlusion.culler().soundness(),
            OccluderSource::Last(_) => Soundness::Conservative,
        }
    }

    pub fn occluders(&self) -> usize {
        self.occluders
    }

    /// The sums so far.
    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Whether a conservative method has culled a visible polygon, or any method has misreported a polygon.
    pub fn failed(&self) -> bool {
        let broken = self.totals.false_culls > 0 && self.soundness() == Soundness::Conservative;
        broken || self.totals.misreported > 0
    }
}

/// Sums over the views that do not depend on a method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewTotals {
    pub views: u64,
    /// Number of polygons in the frustum.
    pub in_view: u64,
    /// Number of visible polygons among them.
    pub visible: u64,
    /// Number of polygons among them that are in the window but hidden.
    pub hidden: u64,
    /// Number of polygons that intersect a view, hidden or not, but that frustum culling removed.
    pub lost: u64,
    /// The first such polygon, with the number of its view.
    pub first_lost: Option<(u64, PolygonId)>,
    /// Time of frustum culling alone, nanoseconds.
    pub frustum_ns: u64,
}

/// Culls a model by each method in several views, and compares the result with the visible polygons.
pub struct Verifier {
    config: VerifyConfig,
    index: Box<dyn SpatialIndex>,
    pool: OccluderPool,
    trials: Vec<Trial>,
    pvs: Option<(Pvs, Totals)>,
    views: ViewTotals,
    has_truth: bool,
    at_rest: AtRest,
    clock: StageClock,
    in_view: Vec<PolygonId>,
    /// Scratch: the result of frustum culling in blocks, and the polygons that a method leaves of it.
    blocks: [VisibleBlocks; 2],
    drawn: Vec<PolygonId>,
    /// By polygon, for one view: the true visibility, and the number of times that a method drew it.
    truth: Vec<(Option<Sight>, u8)>,
}

impl std::fmt::Debug for Verifier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Verifier").field("trials", &self.trials).finish_non_exhaustive()
    }
}

impl Verifier {
    /// A verifier with an empty index.
    pub fn new(index: Box<dyn SpatialIndex>, config: VerifyConfig, clock: StageClock) -> Self {
        let mut verifier = Self {
            pool: OccluderPool::new(config.pool),
            config,
            index,
            trials: Vec::new(),
            pvs: None,
            views: ViewTotals::default(),
            has_truth: true,
            at_rest: AtRest::default(),
            clock,
            in_view: Vec::new(),
            blocks: Default::default(),
            drawn: Vec::new(),
            truth: Vec::new(),
        };
        for kind in verifier.config.kinds.clone() {
            for occluders in verifier.config.occluders.clone() {
                verifier.add(kind.create(occluders), occluders);
            }
        }
        verifier
    }

    /// Adds a method with this number of occluders per view. Call it before the first view.
    pub fn add(&mut self, culler: Box<dyn OcclusionCuller>, occluders: usize) {
        let VerifyConfig { pool, cull, select, .. } = self.config;
        let config = OcclusionConfig { pool, select: SelectConfig { occluders, ..select }, cull };
        let source = OccluderSource::Chosen(Box::new(ViewOcclusion::with_culler(culler, &config)));
        self.trials.push(Trial { occluders, source, totals: Totals::default() });
    }

    /// Adds the method whose occluders are the polygons visible in the previous frame. Call it before the first view.
    /// The camera then rests at each view.
    pub fn add_last(&mut self, last: PreviousFrameOccluders) {
        let source = OccluderSource::Last(Box::new(last));
        self.trials.push(Trial {
            occluders: PreviousFrameOccluders::MOST_OCCLUDERS,
            source,
            totals: Totals::default(),
        });
    }

    /// Also verifies potentially visible sets, which must belong to the verified model.
    #[must_use]
    pub fn with_pvs(mut self, pvs: Pvs) -> Self {
        self.pvs = Some((pvs, Totals::default()));
        self
    }

    /// Skips the search for the visible polygons, which takes minutes in a model of a million polygons. The verifier
    /// then counts and times, but does not compare.
    #[must_use]
    pub fn without_truth(mut self) -> Self {
        self.has_truth = false;
        self
    }

    /// Sets the number of frames for which the camera rests at each view.
    #[must_use]
    pub fn with_rest(mut self, at_rest: AtRest) -> Self {
        self.at_rest = at_rest;
        self
    }

    /// Whether culled polygons are compared with the visible polygons.
    pub fn has_truth(&self) -> bool {
        self.has_truth
    }

    /// The potentially visible sets, with the results of their verification.
    pub fn pvs(&self) -> Option<&(Pvs, Totals)> {
        self.pvs.as_ref()
    }

    /// Applies the changes of a frame. The index does its upkeep as in a frame that culls.
    pub fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        for &change in changes {
            // The index refuses only boxes that are not finite. Their polygons cannot be drawn, so culling cannot be
            // wrong.
            let _ = match change {
                Change::Insert(id) => self.index.insert(id, &scene.bounds(id)),
                Change::Remove(id) => self.index.remove(id),
                Change::Update(id) => self.index.update(id, &scene.bounds(id)),
                // The verified scenes report each polygon instead of whole groups.
                Change::Repaint(_) | Change::Place(_) => Ok(()),
            };
        }
        if !self.index.may_skip_commits() {
            self.index.commit();
        }
        self.pool.follow(scene, changes);
        for trial in &mut self.trials {
            if let OccluderSource::Last(last) = &mut trial.source {
                last.follow(changes);
            }
        }
    }

    /// Verifies one view: determines the visible polygons, then runs every method.
    pub fn verify_view(&mut self, scene: &Scene, view: &View) {
        // A degenerate projection shows no polygon.
        let Some(window) = view.window() else { return };
        // Other indexes have committed at the end of the frame.
        if self.index.may_skip_commits() {
            self.index.commit();
        }
        let frustum = view.frustum();
        fastest(&self.clock, self.config.repeats, &mut self.views.frustum_ns, &mut || {
            self.in_view.clear();
            self.index.frustum_cull(&frustum, &mut self.in_view);
        });
        let [blocks, left] = &mut self.blocks;
        blocks.clear();
        self.index.frustum_cull_blocks(&frustum, blocks);
        self.truth.clear();
        self.truth.resize(scene.polygon_count(), (None, 0));
        if self.has_truth {
            let lost = lost_polygons(scene, view, &self.in_view);
            self.views.lost += lost.len() as u64;
            self.views.first_lost = self.views.first_lost.or(lost.first().map(|&id| (self.views.views, id)));
            let oracle = Oracle::new(&window, subjects(scene, &window, &self.in_view), self.config.oracle);
            for (id, sight) in oracle.answers() {
                self.truth[id.index()].0 = Some(sight);
                self.views.visible += u64::from(sight == Sight::Visible);
                self.views.hidden += u64::from(sight == Sight::Hidden);
            }
        } else {
            // Polygons in the frustum are `Outside` by default: culling them is neither wrong nor counted.
            self.in_view.iter().for_each(|id| self.truth[id.index()].0 = Some(Sight::Outside));
        }
        self.views.in_view += self.in_view.len() as u64;
        let data = ViewData {
            scene,
            window: &window,
            index: &*self.index,
            in_view: &self.in_view,
            clock: &self.clock,
            repeats: self.config.repeats,
            at_rest: self.at_rest,
            number: self.views.views,
        };
        for Trial { source, totals, .. } in &mut self.trials {
            totals.views += 1;
            match source {
                OccluderSource::Chosen(occlusion) => {
                    // Each view is a jump of the camera, so each repeat starts without data of a previous view.
                    let select = &mut || {
                        occlusion.forget();
                        occlusion.select(&self.pool, scene, &window)
                    };
                    let select = data.fastest(&mut totals.select_ns, select);
                    let build = data.fastest(&mut totals.build_ns, &mut || occlusion.build(&window));
                    let input =
                        ViewInput { index: data.index, geometry: scene, view, in_view: blocks, spaces: None };
                    let cull = &mut || occlusion.remove_hidden(&input, left);
                    let cull = data.fastest(&mut totals.query_ns, cull);
                    self.drawn.clear();
                    self.drawn.extend(left.ids());
                    totals.occluders += u64::from(select.chosen);
                    totals.planes += u64::from(build.nodes);
                    totals.node_tests += cull.node_tests;
                    totals.polygon_tests += cull.polygon_tests;
                    totals.add(data.number, &self.drawn, &mut self.truth, &self.in_view);
                }
                OccluderSource::Last(last) => {
                    let input =
                        ViewInput { index: data.index, geometry: scene, view, in_view: blocks, spaces: None };
                    data.at_rest(last, &input, totals, left, &mut self.truth);
                }
            }
        }
        if let Some((pvs, totals)) = &mut self.pvs {
            fastest(&self.clock, self.config.repeats, &mut totals.query_ns, &mut || {
                self.drawn.clear();
                pvs.cull(view.eye_in_world, self.in_view.iter().copied(), &mut self.drawn);
            });
            totals.views += 1;
            totals.add(self.views.views, &self.drawn, &mut self.truth, &self.in_view);
        }
        self.views.views += 1;
    }

    /// The polygons in the frustum of the last view.
    pub fn in_view(&self) -> &[PolygonId] {
        &self.in_view
    }

    /// Compares the polygons that another method draws in a frame of the last view with the visible polygons. The
    /// caller counts the views.
    pub fn judge(&mut self, drawn: &[PolygonId], totals: &mut Totals) {
        let view = self.views.views.saturating_sub(1);
        totals.add(view, drawn, &mut self.truth, &self.in_view);
    }

    /// The methods with their results.
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    /// The sums over the views that do not depend on a method.
    pub fn views(&self) -> &ViewTotals {
        &self.views
    }
}

struct ViewData<'a> {
    scene: &'a Scene,
    window: &'a ViewWindow,
    index: &'a dyn SpatialIndex,
    in_view: &'a [PolygonId],
    clock: &'a StageClock,
    repeats: u32,
    at_rest: AtRest,
    number: u64,
}

impl ViewData<'_> {
    fn fastest<T: Default>(&self, ns: &mut u64, stage: &mut impl FnMut() -> T) -> T {
        fastest(self.clock, self.repeats, ns, stage)
    }

    fn at_rest(
        &self,
        last: &mut PreviousFrameOccluders,
        input: &ViewInput<'_>,
        totals: &mut Totals,
        left: &mut VisibleBlocks,
        truth: &mut [(Option<Sight>, u8)],
    ) {
        let list = |left: &VisibleBlocks| {
            let mut drawn = Vec::new();
            drawn.extend(left.ids());
            drawn
        };
        for _ in 0..self.at_rest.settle {
            let mut counts = last.build(0, self.scene, self.window, input.in_view);
            last.cull(0, input, left, &mut counts);
            totals.add_faults(self.number, &list(left), truth, self.in_view);
        }
        for _ in 0..self.at_rest.frames.max(1) {
            let build = &mut || last.build(0, self.scene, self.window, input.in_view);
            let built = self.fastest(&mut totals.build_ns, build);
            // The polygons of this frame replace the polygons of the previous frame. The depth buffer does not change,
            // so every repeat does the same work.
            let cull = &mut || {
                let mut counts = built;
                last.cull(0, input, left, &mut counts);
                counts
            };
            let counts = self.fastest(&mut totals.query_ns, cull);
            totals.occluders += counts.occluders;
            totals.planes += counts.tiles;
            totals.polygon_tests += counts.tests;
            totals.add(self.number, &list(left), truth, self.in_view);
        }
    }
}

impl Totals {
    fn add(
        &mut self,
        view: u64,
        drawn: &[PolygonId],
        truth: &mut [(Option<Sight>, u8)],
        in_view: &[PolygonId],
    ) {
        self.drawn += drawn.len() as u64;
        for &id in drawn {
            let (sight, times) = &mut truth[id.index()];
            *times += 1;
            self.misreported += u64::from(sight.is_none() || *times > 1);
        }
        for &id in in_view {
            let (sight, times) = &mut truth[id.index()];
            let culled = std::mem::take(times) == 0;
            match sight {
                Some(Sight::Visible) if culled => {
                    self.false_culls += 1;
                    self.first_false.get_or_insert((view, id));
                }
                Some(Sight::Hidden) => {
                    self.hidden += 1;
                    self.hidden_culled += u64::from(culled);
                }
                _ => {}
            }
        }
        self.frames += 1;
    }

    /// Adds only the culled visible polygons of a frame that is not measured.
    fn add_faults(
        &mut self,
        view: u64,
        drawn: &[PolygonId],
        truth: &mut [(Option<Sight>, u8)],
        in_view: &[PolygonId],
    ) {
        let mut frame = Self { first_false: self.first_false, ..Self::default() };
        frame.add(view, drawn, truth, in_view);
        self.first_false = frame.first_false;
        self.false_culls += frame.false_culls;
        self.misreported += frame.misreported;
    }
}

/// The visible polygons of a view, as found by the oracle, sorted by id.
pub fn visible_polygons(
    scene: &Scene,
    window: &ViewWindow,
    in_view: &[PolygonId],
    config: OracleConfig,
) -> Vec<PolygonId> {
    let is_visible = |&(_, sight): &(PolygonId, Sight)| sight == Sight::Visible;
    let mut visible: Vec<PolygonId> = Oracle::new(window, subjects(scene, window, in_view), config)
        .answers()
        .filter(is_visible)
        .map(|(id, _)| id)
        .collect();
    visible.sort_unstable();
    visible
}

/// Number of visible polygons that are not drawn.
pub fn missing(visible: &[PolygonId], drawn: &[PolygonId]) -> u64 {
    let mut drawn = drawn.to_vec();
    drawn.sort_unstable();
    visible.iter().filter(|id| drawn.binary_search(id).is_err()).count() as u64
}

/// Converts the polygons to the form that an oracle requires.
pub(crate) fn subjects<'a>(
    scene: &'a Scene,
    window: &ViewWindow,
    ids: &'a [PolygonId],
) -> impl Iterator<Item = Subject> + use<'a> {
    let (eye, up) = (window.eye_in_world().as_vec3(), (window.corners()[3] - window.corners()[0]).as_vec3());
    ids.iter().map(move |&id| {
        let polygon = scene.polygon_from(id, eye, up);
        Subject { id, polygon, occluder: scene.occluder(id) }
    })
}

/// Runs `stage` several times, adds the shortest time to `ns`, and returns the last result.
fn fastest<T: Default>(clock: &StageClock, repeats: u32, ns: &mut u64, stage: &mut impl FnMut() -> T) -> T {
    let (mut outcome, mut least_ns) = (T::default(), u64::MAX);
    for _ in 0..repeats.max(1) {
        let start = clock.start();
        outcome = stage();
        least_ns = least_ns.min(clock.since(start).ns);
    }
    *ns += least_ns;
    outcome
}

#[cfg(test)]
#[path = "verify_tests.rs"]
mod tests;
