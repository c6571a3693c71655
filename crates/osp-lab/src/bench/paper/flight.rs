//! Fig. 20: a flight through the finished model, without culling, with frustum culling, and with every occlusion
//! culler.

use osp_session::platform::time::Instant;
use std::sync::Arc;

use super::{
    drawing::{Adapter, Drawer, Drawn},
    input::{PaperConfig, PaperError, PaperInput, mean},
};
use crate::{
    Method,
    bench::curves::grouped,
    literal, lost_polygons,
    oracle::OracleConfig,
    rows::{Curves, Rows},
    verify,
};
use osp::{
    frame::{PassConfig, Pipeline},
    index::{IndexConfig, SpatialIndex},
    occlusion::{
        CullConfig, Grouping, NodeTest, Occlusion, OcclusionConfig, OcclusionCuller, OcclusionStage,
        PolygonTest, PoolConfig, Score, SelectConfig, Soundness, ViewInput,
    },
    polygon::{Change, VisibleBlocks},
    view::{View, ViewWindow},
};
use osp_rivals::{CutNodes, IndexKind, OspGrid, OspPaper, RivalOcclusion};
use osp_session::scene::Scene;

const PART: &str = "paper-flight";

/// Assumed time to draw a polygon if no frame is drawn, nanoseconds. Occlusion culling skips tests that cost more than
/// drawing.
const POLYGON_NS: f64 = 10.0;

#[derive(Clone, Copy, Debug)]
struct FlownFrame {
    cull_ns: u64,
    /// 0 if the frame was not drawn.
    draw_ns: u64,
    /// Number of polygons passed to the renderer.
    drawn: u64,
}

impl FlownFrame {
    fn total_us(&self) -> f64 {
        (self.cull_ns + self.draw_ns) as f64 / 1000.0
    }
}

/// The method with which the others are compared.
const FRUSTUM: &str = "frustum (osp)";

/// The culling of a method on the CPU.
enum Culling {
    All,
    Frustum(Arc<dyn SpatialIndex>),
    /// The paper's tree with one kind of occlusion culler.
    Staged(Arc<dyn SpatialIndex>, Box<OcclusionStage>),
    /// `osp` as in normal use, with its pipeline.
    Piped(Box<Pipeline>),
}

struct FlightMethod {
    name: String,
    /// Whether the method may cull visible polygons.
    is_unsound: bool,
    culling: Culling,
    /// Occlusion culling that the GPU does while it draws the result.
    while_drawing: Method,
    in_view: VisibleBlocks,
    /// The polygons passed to the renderer.
    list: VisibleBlocks,
    frames: Vec<FlownFrame>,
    /// Number of visible polygons culled in the verified frames.
    wrong: Option<u64>,
}

impl FlightMethod {
    fn new(name: impl Into<String>, culling: Culling) -> Self {
        Self {
            name: name.into(),
            is_unsound: false,
            culling,
            while_drawing: Method::NONE,
            in_view: VisibleBlocks::new(),
            list: VisibleBlocks::new(),
            frames: Vec::new(),
            wrong: Some(0),
        }
    }

    /// Culls; returns the time in nanoseconds.
    fn cull(&mut self, scene: &Scene, view: &View) -> u64 {
        self.list.clear();
        let start = Instant::now();
        match &mut self.culling {
            Culling::All => self.list.extend(scene.visible_ids()),
            Culling::Frustum(index) => {
                index.frustum_cull_blocks(&view.frustum(), &mut self.list);
            }
            Culling::Staged(index, stage) => {
                self.in_view.clear();
                index.frustum_cull_blocks(&view.frustum(), &mut self.in_view);
                let in_view = &self.in_view;
                let input = ViewInput { index: &**index, geometry: scene, view, in_view, spaces: None };
                stage.cull(&input, &mut self.list);
            }
            Culling::Piped(pipeline) => {
                pipeline.frame(scene, &[], view);
            }
        }
        let ns = start.elapsed().as_nanos() as u64;
        if let Culling::Piped(pipeline) = &self.culling {
            self.list.copy_from(pipeline.draw_list());
        }
        ns
    }
}

/// Data that all methods share.
struct Maker<'a> {
    input: &'a PaperInput<'a>,
    config: &'a PaperConfig,
    changes: Vec<Change>,
    polygon_ns: f64,
}

impl Maker<'_> {
    fn index(&self) -> IndexConfig {
        IndexConfig { root: self.input.root, capacity: self.changes.len() }
    }

    fn filled(&self, mut index: Box<dyn SpatialIndex>) -> Arc<dyn SpatialIndex> {
        for &change in &self.changes {
            if let Change::Insert(id) = change {
                // A polygon with an invalid box cannot be drawn and is left out.
                let _ = index.insert(id, &self.input.scene.bounds(id));
            }
        }
        index.commit();
        Arc::from(index)
    }

    fn paper_tree(&self) -> Arc<dyn SpatialIndex> {
        let cube = self.input.cube(self.config.cube());
        let grid = OspGrid::new(cube.center(), cube.extent().max_element(), self.config.depth());
        self.filled(Box::new(OspPaper::new(grid, self.changes.len()).with_cut_nodes(CutNodes::Drawn)))
    }

    /// The paper's tree with a culler. Occluders are single polygons. The culler tests only nodes, not their polygons.
    fn staged(
        &self,
        tree: &Arc<dyn SpatialIndex>,
        name: String,
        culler: Box<dyn OcclusionCuller>,
        (node_test, score): (NodeTest, Score),
    ) -> FlightMethod {
        let select = SelectConfig { score, occluders: self.config.occluders, ..SelectConfig::default() };
        let cull = CullConfig { node_test, polygon_test: PolygonTest::Never, least_polygons: 1 };
        let pool = PoolConfig { grouping: Grouping::Single, ..PoolConfig::default() };
        let is_unsound = culler.soundness() != Soundness::Conservative;
        let mut stage = OcclusionStage::with_culler(culler, OcclusionConfig { pool, select, cull });
        stage.follow(self.input.scene, &self.changes);
        let culling = Culling::Staged(Arc::clone(tree), Box::new(stage));
        FlightMethod { is_unsound, ..FlightMethod::new(name, culling) }
    }

    fn piped(&self, method: Method) -> FlightMethod {
        let capacity = self.changes.len();
        let pass = PassConfig {
            occluders: Some(self.config.occluders),
            polygon_ns: self.polygon_ns,
            node_test: self.config.node_test,
            score: self.config.score,
            ..PassConfig::for_strokes(Occlusion::Auto)
        };
        let index = IndexKind::Osp.create(&self.index());
        let pipeline = Pipeline::new(index, capacity);
        let mut pipeline = method.add_to(pipeline, pass);
        pipeline.load(self.input.scene);
        pipeline.commit();
        FlightMethod {
            while_drawing: if method.is_while_drawing() { method } else { Method::NONE },
            // The list does not show which polygons the renderer culls while drawing.
            wrong: (!method.is_while_drawing()).then_some(0),
            ..FlightMethod::new(format!("osp, {}", method.name()), Culling::Piped(Box::new(pipeline)))
        }
    }

    /// All methods of the flight. The last methods are `while_drawing`.
    fn methods(&self, while_drawing: impl Iterator<Item = Method>) -> Vec<FlightMethod> {
        let occluders = self.config.occluders;
        let capped = || RivalOcclusion::MsvbspPaper.culler()(occluders);
        let capless = || literal::msvbsp_without_caps(occluders);
        let apart = |culler| -> Box<dyn OcclusionCuller> { Box::new(literal::CornersApart::new(culler)) };
        let sphere = (NodeTest::Sphere, Score::Paper);
        let corners = (NodeTest::Corners, Score::Paper);
        let own = (self.config.node_test, self.config.score);
        let name = |what: &str| format!("paper, {what}");
        let tree = &self.paper_tree();
        let frustum = FlightMethod::new(name("frustum"), Culling::Frustum(Arc::clone(tree)));
        let mut methods = vec![
            FlightMethod::new("no culling", Culling::All),
            frustum,
            self.staged(tree, name("msvbsp-paper, sphere, no caps"), capless(), sphere),
            self.staged(tree, name("msvbsp-paper, sphere"), capped(), sphere),
            self.staged(tree, name("msvbsp-paper, 8 corners, no caps"), apart(capless()), corners),
            self.staged(tree, name("msvbsp-paper, 8 corners"), apart(capped()), corners),
            self.staged(
                tree,
                name(&format!("msvbsp, {}, {}", own.0.name(), own.1.name())),
                Occlusion::Msvbsp.create(occluders),
                own,
            ),
            FlightMethod::new(FRUSTUM, Culling::Frustum(self.filled(IndexKind::Osp.create(&self.index())))),
        ];
        let cullers = Method::conservative_cullers().into_iter();
        methods.extend(cullers.chain([Occlusion::PreviousFrame.into()]).map(|method| self.piped(method)));
        methods.extend(while_drawing.map(|method| self.piped(method)));
        methods
    }
}

/// Flies along some of these views, evenly spaced.
pub(super) fn fly(
    rows: &mut Rows,
    input: &PaperInput<'_>,
    config: &PaperConfig,
    views: &[View],
    adapter: Option<&Adapter>,
    progress: &mut dyn FnMut(&str),
) -> Result<(), PaperError> {
    let changes: Vec<Change> = input.scene.visible_ids().map(Change::Insert).collect();
    let (mut drawers, mut lacks) = (Vec::new(), None);
    for occlusion in [Method::NONE, Method::Hzb, Method::Queries] {
        let Some(adapter) = adapter else { continue };
        match adapter.drawer(occlusion) {
            Ok(mut drawer) => {
                drawer.follow(&changes);
                drawers.push((occlusion, drawer));
            }
            Err(PaperError::NoOcclusion(reason)) => lacks = Some(reason),
            Err(error) => return Err(error),
        }
    }
    // Each drawer draws once before the measurement, so that no measured frame includes the upload of the model.
    let mut drawn_ns = Vec::new();
    for ((_, drawer), view) in drawers.iter_mut().zip(views.iter().cycle()) {
        drawn_ns.push(polygon_ns(drawer, input.scene, view)?);
    }
    let polygon_ns = drawn_ns.first().copied().unwrap_or(POLYGON_NS);
    let while_drawing = drawers.iter().map(|(method, _)| *method).filter(|method| method.is_while_drawing());
    let mut methods = Maker { input, config, changes, polygon_ns }.methods(while_drawing);
    let frames = config.frames.min(views.len() as u64);
    let mut verified = 0;
    for frame in 0..frames {
        let view = &views[(frame * views.len() as u64 / frames) as usize];
        let Some(window) = view.window() else { continue };
        progress(&format!("flight, frame {frame} of {frames}"));
        let count = methods.len();
        for i in 0..count {
            // Another method begins in each frame, so that the caches favour none.
            let method = &mut methods[(i + frame as usize) % count];
            let cull_ns = method.cull(input.scene, view);
            let drawer = drawers.iter_mut().find(|(occlusion, _)| *occlusion == method.while_drawing);
            let draw = match drawer {
                Some((_, drawer)) => drawer.draw(input.scene, view, &method.list)?,
                None => Drawn::default(),
            };
            let drawn = method.list.len() as u64;
            method.frames.push(FlownFrame { cull_ns, draw_ns: draw.total_ns(), drawn });
        }
        if (frame + 1) * config.verified / frames > verified {
            verified += 1;
            verify_frame(&mut methods, input.scene, view, &window);
        }
    }
    add(rows, input, &methods, adapter.is_some());
    if let Some(reason) = lacks {
        rows.note(PART, format!("Without hzb and queries: {reason}."));
    }
    Ok(())
}

/// Time to draw a polygon, nanoseconds: the fastest of three drawings of all polygons, divided by their number.
fn polygon_ns(drawer: &mut Drawer, scene: &Scene, view: &View) -> Result<f64, PaperError> {
    let mut all = VisibleBlocks::new();
    all.extend(scene.visible_ids());
    let mut fastest = u64::MAX;
    for _ in 0..3 {
        fastest = fastest.min(drawer.draw(scene, view, &all)?.draw_ns);
    }
    Ok((fastest as f64 / all.len().max(1) as f64).clamp(0.001, 1.0e9))
}

/// Counts the visible polygons that each method has culled.
fn verify_frame(methods: &mut [FlightMethod], scene: &Scene, view: &View, window: &ViewWindow) {
    let Some(frustum) = methods.iter().find(|method| method.name == FRUSTUM) else { return };
    // Also checks the polygons that frustum culling has wrongly culled.
    let mut ids = lost_polygons(scene, view, &frustum.list.to_vec());
    ids.extend(frustum.list.ids());
    let visible = verify::visible_polygons(scene, window, &ids, OracleConfig::default());
    for method in methods {
        if let Some(wrong) = &mut method.wrong {
            *wrong += verify::missing(&visible, &method.list.to_vec());
        }
    }
}

fn add(rows: &mut Rows, input: &PaperInput<'_>, methods: &[FlightMethod], draws: bool) {
    rows.part(PART, "The paper: a flight through the finished model (Fig. 20)");
    rows.note(PART, "osp, hzb and queries may cull while drawing; drawn then includes the hidden polygons.");
    let Some(reference) = methods.iter().find(|method| method.name == FRUSTUM) else { return };
    let mut curves = [Vec::new(), Vec::new()];
    for method in methods {
        let pairs: Vec<(f64, f64)> = method
            .frames
            .iter()
            .zip(&reference.frames)
            .map(|(own, other)| (own.total_us(), other.total_us()))
            .collect();
        let of = |ns: fn(&FlownFrame) -> u64| {
            method.frames.iter().map(|frame| ns(frame) as f64 / 1000.0).collect()
        };
        let slower = pairs.iter().filter(|(own, other)| own > other).count();
        let name = format!("{}{}", method.name, if method.is_unsound { " (not conservative)" } else { "" });
        let drawn = mean(method.frames.iter().map(|frame| frame.drawn).sum(), method.frames.len());
        let mut figures = rows.of(PART, input.recording, &name);
        figures.against(&pairs).median("cull", "µs", of(|frame| frame.cull_ns));
        if draws {
            figures.median("draw", "µs", of(|frame| frame.draw_ns));
        }
        figures
            .value("drawn", "polygons", drawn)
            .maybe("visible_culled", "polygons", method.wrong.map(|wrong| wrong as f64))
            .value("slower_than_frustum", "%", 100.0 * mean(slower as u64, pairs.len()));
        let line = |of: fn(&FlownFrame) -> f64| {
            grouped(method.frames.iter().enumerate().map(|(at, frame)| (at as f64, of(frame))).collect())
        };
        curves[0].push((name.clone(), line(FlownFrame::total_us)));
        curves[1].push((name, line(|frame| frame.drawn as f64)));
    }
    for ((what, y), lines) in
        [("time of a frame", "µs"), ("polygons handed to the renderer", "polygons")].into_iter().zip(curves)
    {
        let title = format!("{}, flight: {what} (Fig. 20)", input.recording);
        rows.curves.push(Curves { part: PART, title, x: "frame", y, lines });
    }
}
