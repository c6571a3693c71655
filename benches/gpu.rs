//! Frame times by stage on this machine's graphics adapter, as Markdown tables.
//!
//! `cargo bench --bench gpu --features render [-- --sizes 10000,100000] [--files F,G] [--methods none,hzb] [--frames 360]
//! [--mono]`
//!
//! The model is synthetic, or the final model of a session. The camera turns. Each frame removes sixteen polygons, and
//! inserts the polygons that the previous frame removed. Each frame measures all methods, in rotating order; they share
//! the polygons on the adapter. A frame draws one picture of 1,920 x 1,080 pixels, or two pictures of 2,000 x 2,000
//! pixels for a headset. `--mono` omits the headset. At the headset's 90 Hz, a frame has 11.1 ms.
//!
//! Three counts predict the times on other adapters: the vertices, the tests and the bytes sent by the CPU in a frame.

#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::{collections::VecDeque, error::Error, path::PathBuf, slice, sync::Arc, time::Instant};

use hdrhistogram::Histogram;
use osp::{
    frame::{PassConfig, Pipeline},
    index::IndexConfig,
    math::{Aabb, rotate},
    occlusion::Occlusion,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_lab::Method;
use osp_render::{Gpu, Layer, Offscreen, RendererConfig};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, OpenOptions, SynthKind, open, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Number of polygons that each frame removes; it inserts the same number.
const CHANGED: usize = 16;
/// Number of frames of each method before the measured frames.
const WARM_UP: usize = 4;
/// Distance between the eyes, metres.
const EYES_APART_M: f32 = 0.064;
/// Frame time of a headset, nanoseconds.
const FRAME_OF_90_HZ_NS: u64 = 11_111_111;
/// A camera: its path, the factor that scales its distance from the model's centre, and its name.
const CAMERAS: [(CameraChoice, f32, &str); 3] = [
    (CameraChoice::Inside, 1.0, "from inside"),
    (CameraChoice::Orbit, 1.0, "from outside"),
    (CameraChoice::Orbit, 4.0, "from four times as far"),
];
/// Vertices of a polygon; its two triangles share two vertices.
const VERTICES: u64 = 4;

/// The pictures of a frame.
struct Pictures {
    name: &'static str,
    size: (u32, u32),
    /// Offset of each eye to the right of the camera, as a fraction of the distance between the eyes.
    eyes: &'static [f32],
}

const PICTURES: [Pictures; 2] = [
    Pictures { name: "1,920 x 1,080", size: (1920, 1080), eyes: &[0.0] },
    Pictures { name: "stereo, 2 x 2,000 x 2,000", size: (2000, 2000), eyes: &[-0.5, 0.5] },
];

/// Measurements of one method.
struct Measured {
    pipeline: Pipeline,
    /// The number of the method's first view in the drawer.
    first_view: usize,
    /// Times of each frame, nanoseconds: whole frame, changes and query, occlusion culling on the CPU, lists for the
    /// adapter, submission to completion; then, measured by the adapter, the depth, test and colour pass.
    ns: [Histogram<u64>; 8],
    late: u64,
    frames: u64,
    in_view: u64,
    drawn: u64,
    vertices: u64,
    tests: u64,
    bytes: u64,
    calls: u64,
}

impl Measured {
    fn new(method: Method, scene: &Scene, bounds: &Aabb, first_view: usize) -> Result<Self, Box<dyn Error>> {
        let capacity = scene.polygon_count();
        let root = Aabb::cube(bounds.center(), bounds.extent().max_element());
        let index = IndexKind::Osp.create(&IndexConfig { root, capacity });
        let pipeline = Pipeline::new(index, capacity);
        // For a method on the adapter, the pipeline culls only by the frustum.
        let mut pipeline =
            method.add_to(pipeline, PassConfig::for_strokes(Occlusion::Auto).by_measured_times());
        pipeline.load(scene);
        let histogram = || Histogram::new(3);
        let ns = [
            histogram()?,
            histogram()?,
            histogram()?,
            histogram()?,
            histogram()?,
            histogram()?,
            histogram()?,
            histogram()?,
        ];
        Ok(Self {
            pipeline,
            first_view,
            ns,
            late: 0,
            frames: 0,
            in_view: 0,
            drawn: 0,
            vertices: 0,
            tests: 0,
            bytes: 0,
            calls: 0,
        })
    }

    fn frame(
        &mut self,
        drawer: &mut Offscreen,
        scene: &Scene,
        changes: &[Change],
        views: &[View],
        counts: bool,
    ) -> Result<(), Box<dyn Error>> {
        let start = Instant::now();
        let record = self.pipeline.frame_of_views(scene, changes, views);
        let lists = self.pipeline.draw_lists();
        let layers: Vec<Layer<'_>> = lists.iter().map(Layer::plain).collect();
        let times = drawer.draw_views(scene, &numbered(self.first_view, views, &layers))?;
        let in_lists: u64 = lists.iter().map(|list| list.len() as u64).sum();
        let (drawn, vertices, tests) = match times.occlusion {
            Some(on_gpu) => {
                let run = on_gpu.first_pass + on_gpu.second_pass;
                (on_gpu.second_pass, run * VERTICES, on_gpu.groups_tested)
            }
            None => (in_lists, times.listed * VERTICES, 0),
        };
        let all = u64::try_from(start.elapsed().as_nanos())?;
        if drawn > 0 {
            self.pipeline.set_polygon_ns(times.draw.ns as f64 / drawn as f64);
        }
        if !counts {
            return Ok(());
        }
        let follow = record.insert.ns + record.cull.ns;
        let passes = times.passes.unwrap_or_default();
        let stages = [
            all,
            follow,
            record.occlusion.total_ns(),
            times.prepare.ns,
            times.draw.ns,
            passes.depth_ns,
            passes.test_ns,
            passes.color_ns,
        ];
        for (histogram, ns) in self.ns.iter_mut().zip(stages) {
            histogram.record(ns)?;
        }
        self.frames += 1;
        self.late += u64::from(all > FRAME_OF_90_HZ_NS);
        self.in_view += record.visible;
        self.drawn += drawn;
        self.vertices += vertices;
        self.tests += tests;
        self.bytes += times.polygon_bytes + times.list_bytes;
        self.calls += times.draw_calls;
        Ok(())
    }

    fn row(&self, name: &str) -> String {
        let ms = |ns: u64| format!("{:.2}", ns as f64 * 1.0e-6);
        let median = |at: usize| ms(self.ns[at].value_at_quantile(0.5));
        let mean = |sum: u64| sum / self.frames.max(1);
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} of {} | {} | {} | {} | {} | {} | {} |",
            median(0),
            ms(self.ns[0].value_at_quantile(0.99)),
            median(1),
            median(2),
            median(3),
            median(4),
            median(5),
            median(6),
            median(7),
            self.late,
            self.frames,
            mean(self.in_view),
            mean(self.drawn),
            mean(self.vertices),
            mean(self.tests),
            mean(self.bytes),
            mean(self.calls),
        )
    }
}

/// Returns the views with one layer each, numbered from `first`.
fn numbered<'a>(
    first: usize,
    views: &'a [View],
    layers: &'a [Layer<'a>],
) -> Vec<(usize, &'a View, &'a [Layer<'a>])> {
    let numbered = (first..).zip(views).zip(layers);
    numbered.map(|((number, view), layer)| (number, view, slice::from_ref(layer))).collect()
}

/// Prints the time of frames that draw no polygon into these pictures.
fn measure_nothing(
    drawer: &mut Offscreen,
    scene: &Scene,
    views: &[View],
    frames: usize,
) -> Result<(), Box<dyn Error>> {
    let nothing = VisibleBlocks::default();
    let layers = vec![Layer::plain(&nothing); views.len()];
    let mut ns = Histogram::<u64>::new(3)?;
    for frame in 0..WARM_UP + frames {
        let times = drawer.draw_views(scene, &numbered(0, views, &layers))?;
        if frame >= WARM_UP {
            ns.record(times.draw.ns)?;
        }
    }
    let ms = |quantile| ns.value_at_quantile(quantile) as f64 * 1.0e-6;
    println!("\nNothing drawn: {:.2} ms, p99 {:.2}.", ms(0.5), ms(0.99));
    Ok(())
}

const HEAD: &str = "\
| method | frame | p99 | changes, query | occlusion, CPU | lists | drawing | depth pass | test | colour pass | over 11.1 ms | in view | drawn | vertices | tests | bytes sent | calls |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|";

/// The options of the command line.
struct Wanted {
    sizes: Vec<u32>,
    /// Sessions in place of synthetic models.
    files: Vec<PathBuf>,
    methods: Vec<Method>,
    frames: usize,
    /// Whether to measure only the first of [`PICTURES`].
    is_mono: bool,
}

impl Wanted {
    fn read(is_software: bool) -> Result<Self, Box<dyn Error>> {
        let mut wanted = Self {
            // A software adapter takes seconds for a frame of a million polygons.
            sizes: if is_software {
                vec![10_000, 100_000]
            } else {
                vec![10_000, 100_000, 1_000_000, 10_000_000]
            },
            files: Vec::new(),
            methods: vec![Method::NONE, Method::Hzb, Occlusion::Auto.into(), Occlusion::Msvbsp.into()],
            frames: if is_software { 12 } else { 360 },
            is_mono: false,
        };
        let mut words: VecDeque<String> = std::env::args().skip(1).collect();
        while let Some(word) = words.pop_front() {
            let mut value = || words.pop_front().ok_or(format!("{word}: expected a value"));
            match word.as_str() {
                "--sizes" => wanted.sizes = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?,
                "--files" => wanted.files = value()?.split(',').map(PathBuf::from).collect(),
                "--frames" => wanted.frames = value()?.parse()?,
                "--mono" => wanted.is_mono = true,
                "--methods" => {
                    let found = |name: &str| {
                        Method::from_name(name).ok_or(format!("--methods: no method is called `{name}`"))
                    };
                    wanted.methods = value()?.split(',').map(found).collect::<Result<_, _>>()?;
                }
                // Cargo passes `--bench` to every bench, or `--test` when it runs tests.
                "--bench" => {}
                "--test" => (wanted.sizes, wanted.frames) = (vec![1000], 2),
                _ => {
                    return Err(format!(
                        "`{word}`: expected --sizes, --files, --methods, --frames or --mono"
                    )
                    .into());
                }
            }
        }
        if wanted.sizes.iter().any(|&size| size < 1000) {
            return Err("--sizes: expected at least 1000 polygons".into());
        }
        Ok(wanted)
    }
}

/// Returns the scene at the end of a session.
fn end_of<E: Error + 'static>(
    events: impl Iterator<Item = Result<Event, E>>,
) -> Result<Scene, Box<dyn Error>> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in events {
        scene.apply(&event?, &mut changes);
        changes.clear();
    }
    Ok(scene)
}

/// Returns the view with the eye's distance from `middle` and the clip distances multiplied by `times`.
fn farther(view: View, middle: glam::Vec3, times: f32) -> View {
    let mut farther = view;
    farther.eye_in_world = middle + (view.eye_in_world - middle) * times;
    farther.projection.near_m *= times;
    farther.projection.far_m *= times;
    farther
}

fn measure(gpu: &Arc<Gpu>, wanted: &Wanted, name: &str, scene: &Scene) -> Result<(), Box<dyn Error>> {
    let ids: Vec<PolygonId> = scene.visible_ids().collect();
    let bounds = ids.iter().fold(Aabb::EMPTY, |all, &id| all.union(&scene.bounds(id)));
    let all: Vec<Change> = ids.iter().copied().map(Change::Insert).collect();
    for pictures in &PICTURES[..if wanted.is_mono { 1 } else { PICTURES.len() }] {
        let (width, height) = pictures.size;
        let mut drawer = Offscreen::on(Arc::clone(gpu), width, height, &RendererConfig::default())?;
        drawer.renderer.follow(&all);
        for number in 1..wanted.methods.len() * pictures.eyes.len() {
            assert_eq!(drawer.add_view(width, height)?, number, "views are numbered one after the other");
        }
        for (camera, times, camera_name) in CAMERAS {
            let path = CameraPath::new(camera, None, &bounds);
            let mut lanes = Vec::new();
            for (number, &method) in wanted.methods.iter().enumerate() {
                let first_view = number * pictures.eyes.len();
                for view in first_view..first_view + pictures.eyes.len() {
                    drawer.set_occlusion_of(view, method.while_drawing())?;
                }
                lanes.push(Measured::new(method, scene, &bounds, first_view)?);
            }
            for frame in 0..WARM_UP + wanted.frames {
                // Inserts the polygons that the previous frame removed.
                let some = |frame: usize| (0..CHANGED).map(move |i| frame * 7919 + i * 104_729);
                let back = frame.checked_sub(1).into_iter().flat_map(some);
                let removed = some(frame).map(|i| Change::Remove(ids[i % ids.len()]));
                let changes: Vec<Change> =
                    back.map(|i| Change::Insert(ids[i % ids.len()])).chain(removed).collect();
                drawer.renderer.follow(&changes);
                let middle = path.view(&Moment { frame: frame as u64, ..Moment::default() });
                let middle =
                    farther(middle, bounds.center(), times).with_aspect(width as f32 / height as f32);
                let right = rotate(middle.world_from_view, glam::Vec3::X) * EYES_APART_M;
                let eyes = pictures.eyes.iter();
                let views: Vec<View> = eyes
                    .map(|by| View { eye_in_world: middle.eye_in_world + right * *by, ..middle })
                    .collect();
                for turn in 0..lanes.len() {
                    let at = (turn + frame) % lanes.len();
                    lanes[at].frame(&mut drawer, scene, &changes, &views, frame >= WARM_UP)?;
                }
            }
            let middle = path.view(&Moment::default()).with_aspect(width as f32 / height as f32);
            measure_nothing(&mut drawer, scene, &vec![middle; pictures.eyes.len()], wanted.frames)?;
            println!("\n{name}{} polygons, {camera_name}, {}:\n\n{HEAD}", ids.len(), pictures.name);
            for (method, lane) in wanted.methods.iter().zip(&lanes) {
                println!("{}", lane.row(method.name()));
            }
            println!("\nPolygons on the adapter: {} kB.", drawer.renderer.bytes() / 1000);
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = match Gpu::headless() {
        Ok(gpu) => Arc::new(gpu),
        Err(error) => {
            println!("skipped: {error}");
            return Ok(());
        }
    };
    let wanted = Wanted::read(gpu.is_software())?;
    println!("{}, milliseconds, medians of {} frames", gpu.name(), wanted.frames);
    for path in &wanted.files {
        let scene = end_of(open(path, &OpenOptions::LENIENT)?)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        measure(&gpu, &wanted, &format!("{name}: "), &scene)?;
    }
    let sizes = if wanted.files.is_empty() { &wanted.sizes[..] } else { &[] };
    sizes.iter().try_for_each(|&polygons| {
        measure(&gpu, &wanted, "", &end_of(synthesize(SynthKind::Scribble, polygons, 1))?)
    })
}
