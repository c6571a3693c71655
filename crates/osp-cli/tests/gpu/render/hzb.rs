//! Culling while drawing changes no pixel, whatever comes, goes and moves; and it does find something.

use std::{path::Path, sync::Arc};

use super::{
    identity::shipped,
    scenes::{all_ids, apply, drawer, gpu, set, sketch, square, view_from, winding_stroke},
};
use glam::Vec3;
use osp::{
    frame::Pipeline,
    index::IndexConfig,
    polygon::{Change, PolygonId},
    view::View,
};
use osp_render::{
    DrawnCounts, Gpu, GpuOcclusion, GpuTimer, Image, Layer, Offscreen, PyramidLevel, RenderError, Renderer,
    RendererConfig, Style, Target,
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{self, Environment, Event, OpenOptions, Pace, Pacer, StrokeId, Tool},
    replay::{CameraChoice, CameraPath, Moment, summarize},
    scene::Scene,
};
use osp_testkit::events::SOLE;

const SIZE: (u32, u32) = (481, 361);

/// Draws the same frame twice: with culling while drawing, and without.
pub(crate) struct Pair {
    pub(crate) culled: Offscreen,
    whole: Offscreen,
    pub(crate) counts: DrawnCounts,
}

impl Pair {
    /// `None`, with a line, on an adapter that cannot.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        (width, height): (u32, u32),
        occlusion: GpuOcclusion,
        chunk_len: usize,
    ) -> Option<Self> {
        // Several draw calls a page where chunks are small.
        let config_of = RendererConfig { chunk_len, draw_len: chunk_len / 4, ..RendererConfig::default() };
        let drawer = || Offscreen::on(Arc::clone(gpu), width, height, &config_of).expect("a drawer");
        let mut culled = drawer();
        match culled.set_occlusion(occlusion) {
            Err(error @ RenderError::NoOcclusion { .. }) if !osp_testkit::nothing_may_be_skipped() => {
                eprintln!("skipped: {error}");
                return None;
            }
            outcome => outcome.expect("what hzb needs"),
        }
        Some(Self { culled, whole: drawer(), counts: DrawnCounts::default() })
    }

    pub(crate) fn set_environment(&mut self, environment: &Environment) {
        self.culled.renderer.set_environment(Some(environment));
        self.whole.renderer.set_environment(Some(environment));
    }

    pub(crate) fn follow(&mut self, changes: &[Change]) {
        self.culled.renderer.follow(changes);
        self.whole.renderer.follow(changes);
    }

    /// Pixels that differ, and the picture without culling.
    pub(crate) fn compare(&mut self, scene: &Scene, view: &View, ids: &[PolygonId]) -> (usize, Image) {
        let times = self.culled.draw(scene, view, &[Layer::plain(&set(ids))]).expect("a drawn frame");
        let counts = times.occlusion.expect("counts");
        assert_eq!(counts.in_view, ids.len() as u64);
        assert!(counts.second_pass <= counts.in_view && counts.first_pass <= counts.in_view, "{counts:?}");
        self.counts.in_view += counts.in_view;
        self.counts.groups_tested += counts.groups_tested;
        self.counts.first_pass += counts.first_pass;
        self.counts.second_pass += counts.second_pass;
        self.whole.draw(scene, view, &[Layer::plain(&set(ids))]).expect("a drawn frame");
        let whole = self.whole.image().expect("a picture");
        (self.culled.image().expect("a picture").differing_pixels(&whole), whole)
    }

    pub(crate) fn check(&mut self, scene: &Scene, view: &View, what: &dyn std::fmt::Display) -> Image {
        let (differing, whole) = self.compare(scene, view, &all_ids(scene));
        assert_eq!(differing, 0, "{what}");
        whole
    }

    fn hidden_share(&self) -> f64 {
        self.counts.hidden() as f64 / self.counts.in_view.max(1) as f64
    }
}

pub(crate) const HZB: GpuOcclusion = GpuOcclusion::Hzb;
pub(crate) const QUERIES: GpuOcclusion = GpuOcclusion::Queries;
const BOTH: [GpuOcclusion; 2] = [HZB, QUERIES];

pub(crate) fn chunk_len() -> usize {
    RendererConfig::default().chunk_len
}

/// A wall in front of the sketch, so that much is hidden.
fn walled_sketch() -> Scene {
    let mut scene = Scene::new();
    apply(&mut scene, &sketch());
    apply(&mut scene, &[square(Vec3::new(0.0, 0.6, 0.7), 0.45, (0.3, 0.5, 0.2, 1.0))]);
    scene
}

fn eyes() -> Vec<View> {
    let target = Vec3::new(0.0, 0.6, 0.0);
    let eyes = [
        (1.6, 0.9, 1.2),
        (-0.5, 0.7, 0.1),
        (0.0, 3.0, 0.0),
        (0.2, 0.6, 2.0),
        (9.0, 3.0, 8.0),
        (0.0, 0.6, 0.72),
    ];
    eyes.into_iter().map(|(x, y, z)| view_from(Vec3::new(x, y, z), target)).collect()
}

#[test]
fn what_comes_goes_and_moves_is_right_in_the_same_frame() {
    let Some(gpu) = gpu() else { return };
    for (occlusion, chunk_len) in [(HZB, chunk_len()), (HZB, 112), (QUERIES, 112)] {
        let Some(mut pair) = Pair::new(&gpu, SIZE, occlusion, chunk_len) else { return };
        let mut scene = Scene::new();
        let mut steps: Vec<Vec<Event>> = sketch().chunks(301).map(<[Event]>::to_vec).collect();
        let wall = |z: f32| square(Vec3::new(0.0, 0.6, z), 0.5, (0.3, 0.5, 0.2, 1.0));
        let moved =
            |strokes: &[u32], by| SOLE.moved(strokes.iter().map(|&n| StrokeId(n)).collect::<Vec<_>>(), by);
        steps.push(vec![wall(0.8)]);
        steps.push(vec![SOLE.undo()]);
        steps.push(vec![SOLE.redo()]);
        // Hidden strokes move in front of the wall, then one of them moves back behind it.
        steps.push(vec![moved(&[2, 9, 15], Vec3::new(0.0, 0.1, 1.1))]);
        steps.push(vec![moved(&[2], Vec3::new(0.0, 0.0, -1.1))]);
        steps.push(vec![SOLE.erase(StrokeId(9))]);
        steps.push(vec![SOLE.undo(); 2]);
        steps.push(winding_stroke(100, Tool::Tube, 30, (1.0, 0.2, 0.2, 1.0)));
        steps.push(winding_stroke(101, Tool::Ribbon, 30, (1.0, 0.2, 0.2, 0.5)));
        steps.push(vec![moved(&[101], Vec3::new(0.0, 0.0, -2.0))]);
        for (number, events) in steps.iter().enumerate() {
            let changes = apply(&mut scene, events);
            pair.follow(&changes);
            pair.check(&scene, &eyes()[3], &format!("{occlusion:?}, chunks of {chunk_len}, step {number}"));
        }
        let least = if occlusion == HZB { 0.1 } else { 0.0 };
        assert!(pair.hidden_share() > least, "{:?}", pair.counts);
    }
}

/// From far to near and back, each view twice: every frame but the second of two is a jump.
#[test]
fn no_method_changes_a_pixel_of_any_size_and_the_pyramid_hides_something() {
    let Some(gpu) = gpu() else { return };
    let scene = walled_sketch();
    let sizes = [(1, 1), (1, 7), (5, 1), (2, 3), (17, 333), (641, 359)];
    for (size, occlusion) in sizes.into_iter().flat_map(|size| BOTH.map(|occlusion| (size, occlusion))) {
        let Some(mut pair) = Pair::new(&gpu, size, occlusion, chunk_len()) else { return };
        for view in eyes() {
            for time in 0..2 {
                let what = format!("{occlusion:?}, {size:?}, {}, time {time}", view.eye_in_world);
                pair.check(&scene, &view, &what);
            }
        }
        // Queries hide whole groups of 64 only.
        let least = if occlusion == HZB { 0.3 } else { 0.0 };
        let is_large = size.0 * size.1 > 100_000;
        assert!(!is_large || pair.hidden_share() > least, "{occlusion:?} hides {}", pair.hidden_share());
    }
}

/// The level above, as it should be.
fn halved(below: &PyramidLevel) -> PyramidLevel {
    let (width, height) = (below.width.div_ceil(2), below.height.div_ceil(2));
    let mut depths = vec![f32::INFINITY; (width * height) as usize];
    for y in 0..below.height {
        for x in 0..below.width {
            let to = &mut depths[(y / 2 * width + x / 2) as usize];
            *to = to.min(below.depths[(y * below.width + x) as usize]);
        }
    }
    PyramidLevel { width, height, depths }
}

#[test]
fn the_pyramid_of_every_size_is_the_farthest_depth() {
    let Some(gpu) = gpu() else { return };
    let scene = walled_sketch();
    for size in [(1, 1), (1, 9), (6, 1), (3, 2), (17, 333), (128, 64), (641, 359)] {
        let Some(mut pair) = Pair::new(&gpu, size, HZB, chunk_len()) else { return };
        for _ in 0..2 {
            pair.check(&scene, &eyes()[3], &format!("{size:?}"));
        }
        let levels = pair.culled.pyramid().expect("a device").expect("a pyramid");
        assert_eq!((levels[0].width, levels[0].height), (size.0.div_ceil(2), size.1.div_ceil(2)));
        for pair in levels.windows(2) {
            assert_eq!(pair[1], halved(&pair[0]), "{size:?}");
        }
        let top = levels.last().expect("a level");
        assert_eq!((top.width, top.height), (1, 1));
        // The sketch does not fill the picture, and fills some of it, where pixels are small enough.
        if size.0 * size.1 > 1000 {
            assert_eq!(top.depths, [0.0]);
            let filled = levels[0].depths.iter().filter(|depth| **depth > 0.0).count();
            assert!(filled * 20 > levels[0].depths.len(), "{size:?}: {filled}");
        }
    }
}

#[test]
fn the_pyramid_holds_the_farthest_sample_of_four_pixels() {
    let Some(gpu) = gpu() else { return };
    // A square that fills the picture, and one before it that ends within pixels.
    let mut scene = Scene::new();
    let white = (1.0, 1.0, 1.0, 1.0);
    apply(&mut scene, &[square(Vec3::Z * -4.0, 9.0, white), square(Vec3::new(0.003, 0.0, -2.0), 0.5, white)]);
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    let Some(mut pair) = Pair::new(&gpu, SIZE, HZB, chunk_len()) else { return };
    for _ in 0..2 {
        pair.check(&scene, &view, &"two squares");
    }
    let depth = |distance_m: f32| {
        let clip = view.clip_from_world() * Vec3::new(0.0, 0.0, -distance_m).extend(1.0);
        clip.z / clip.w
    };
    let (near, far) = (depth(2.0), depth(4.0));
    let levels = pair.culled.pyramid().expect("a device").expect("a pyramid");
    let is = |depth: f32, expected: f32| (depth - expected).abs() < expected * 1.0e-5;
    let count = |expected| levels[0].depths.iter().filter(|depth| is(**depth, expected)).count();
    assert_eq!(count(near) + count(far), levels[0].depths.len());
    // Squares of 2 x 2 pixels that the near square covers in part belong to the far one.
    let half_px = 0.5 / 2.0 / (30.0f32.to_radians().tan()) * (SIZE.1 as f32 / 2.0) / 2.0;
    let inner = (2.0 * half_px - 2.0).floor() as usize * (2.0 * half_px - 2.0).floor() as usize;
    let outer = (2.0 * half_px) * (2.0 * half_px * 4.0 / 3.0 / (SIZE.0 as f32 / SIZE.1 as f32));
    assert!(count(near) >= inner && (count(near) as f32) < outer, "{inner} {} {outer}", count(near));
}

#[test]
fn several_views_of_one_renderer_do_not_disturb_each_other() {
    let Some(gpu) = gpu() else { return };
    let scene = walled_sketch();
    let ids = all_ids(&scene);
    let mut renderer = Renderer::new(Arc::clone(&gpu), &RendererConfig::default());
    let sizes = [(200, 150), (97, 61)];
    let mut panes = Vec::new();
    for culls in [true, false] {
        for size in sizes {
            let mut slot = renderer.create_view_slot();
            if culls && let Err(error) = renderer.set_occlusion(&mut slot, GpuOcclusion::Hzb) {
                eprintln!("skipped: {error}");
                return;
            }
            let target = Target::new(&gpu, size.0, size.1).expect("a target");
            panes.push((slot, target, GpuTimer::new(&gpu)));
        }
    }
    renderer.send(&scene);
    let mut hidden = 0;
    for view in eyes() {
        for _ in 0..2 {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            for (number, (slot, target, timer)) in panes.iter_mut().enumerate() {
                // Two eyes beside each other.
                let mut view = view.with_aspect(target.aspect());
                view.eye_in_world.x += 0.3 * (number % 2) as f32;
                renderer.prepare(slot, &scene, &view, &[Layer::plain(&set(&ids))]);
                renderer.encode(&mut encoder, target, slot, timer, |_| {});
            }
            gpu.queue.submit([encoder.finish()]);
            for (slot, _, timer) in &mut panes {
                slot.submitted();
                timer.submitted();
            }
            gpu.wait().expect("a device");
            let images: Vec<Image> =
                panes.iter().map(|(_, target, _)| target.image(&gpu).expect("a picture")).collect();
            assert_eq!(images[0].differing_pixels(&images[2]), 0, "{}", view.eye_in_world);
            assert_eq!(images[1].differing_pixels(&images[3]), 0, "{}", view.eye_in_world);
            for (slot, ..) in &mut panes[..2] {
                hidden += slot.take_counts().expect("counts").hidden();
            }
        }
    }
    assert!(hidden > 1000, "{hidden}");
}

#[test]
fn with_more_than_one_layer_it_is_drawn_as_ever() {
    let Some(gpu) = gpu() else { return };
    let scene = walled_sketch();
    let Some(mut pair) = Pair::new(&gpu, SIZE, HZB, chunk_len()) else { return };
    let ids = all_ids(&scene);
    let (some, others) = ids.split_at(ids.len() / 2);
    let tint = Style { tint: [1.0, 0.0, 0.0], amount: 0.5, opacity: 0.6, glow: 0.0 };
    let (some, others, none) = (set(some), set(others), set(&[]));
    for layers in [
        &[Layer::plain(&some), Layer { polygons: &others, style: tint }][..],
        &[Layer::plain(&some), Layer::plain(&none)],
    ] {
        for view in eyes() {
            let times = pair.culled.draw(&scene, &view, layers).expect("a frame");
            assert_eq!(times.occlusion.is_some(), layers[1].polygons.is_empty());
            pair.whole.draw(&scene, &view, layers).expect("a frame");
            let whole = pair.whole.image().expect("a picture");
            assert_eq!(pair.culled.image().expect("a picture").differing_pixels(&whole), 0);
        }
    }
}

/// Plays a session and compares at evenly spaced frames, each with the one before it, and once more without a change.
fn compare_session(
    gpu: &Arc<Gpu>,
    path: &Path,
    choice: CameraChoice,
    occlusion: GpuOcclusion,
    frames: u64,
) -> Option<DrawnCounts> {
    let open = || recording::open(path, &OpenOptions::default()).expect("a recording");
    let (summary, _, read) = summarize(&mut open(), Pace::Samples(16));
    read.expect("a whole recording");
    let pace = Pace::Samples((summary.frames as u32 * 16 / 200).max(16));
    let session = open();
    let camera = CameraPath::new(choice, session.header.camera, &summary.bounds);
    let capacity = summary.counts.polygons as usize;
    let config = IndexConfig { capacity, ..IndexConfig::default() };
    let mut pipeline = Pipeline::new(IndexKind::Osp.create(&config), capacity);
    let mut pair = Pair::new(gpu, SIZE, occlusion, chunk_len())?;
    let (mut scene, mut moment, mut shown) = (Scene::new(), Moment::default(), 0);
    let (mut pacer, mut events, mut changes) = (Pacer::new(session, pace), Vec::new(), Vec::new());
    let total = summarize(&mut open(), pace).0.frames;
    while pacer.next_frame(&mut events).expect("a whole recording") {
        changes.clear();
        for event in &events {
            moment.note(event);
            scene.apply(event, &mut changes);
        }
        pair.follow(&changes);
        let view = camera.view(&moment).with_aspect(pair.whole.aspect());
        let part = |frame: u64| frame * frames / total;
        let is_looked_at = |frame: u64| part(frame + 1) > part(frame);
        if is_looked_at(moment.frame) || is_looked_at(moment.frame + 1) || moment.frame + 1 == total {
            pipeline.frame(&scene, &changes, &view);
            for time in 0..1 + u64::from(is_looked_at(moment.frame)) {
                let (differing, whole) = pair.compare(&scene, &view, &pipeline.draw_list().to_vec());
                shown += whole.drawn_pixels();
                let at = moment.frame;
                assert_eq!(
                    differing,
                    0,
                    "{}, {choice:?}, {occlusion:?}, frame {at}, time {time}",
                    path.display()
                );
            }
        } else {
            pipeline.skip(&scene, &changes);
        }
        moment.frame += 1;
    }
    // From inside of some, all is behind the eye.
    assert!(shown > 1000 || choice == CameraChoice::Inside, "{}: {shown} pixels drawn", path.display());
    Some(pair.counts)
}

/// Of all that are shipped, and of some of the corpus.
#[test]
fn culling_while_drawing_changes_no_pixel_of_any_session() {
    let Some(gpu) = gpu() else { return };
    let mut paths = shipped();
    paths.extend(std::env::var_os("OSP_CORPUS").into_iter().flat_map(|folder| {
        [
            "tilt/ob_one-nreal-picnic_by_Kevin_Ang.tilt",
            "tilt/benfoxall_hello-world.tilt",
            "apa/dancer.apa",
            "cassie/raw_data/guitar.json",
            "scenes/Castle.obj",
        ]
        .map(|name| Path::new(&folder).join(name))
    }));
    let mut all = DrawnCounts::default();
    for path in paths {
        for choice in [CameraChoice::Auto, CameraChoice::Inside] {
            for occlusion in BOTH {
                let Some(counts) = compare_session(&gpu, &path, choice, occlusion, 5) else { return };
                let (hidden, in_view) = (counts.hidden(), counts.in_view);
                eprintln!("{}, {choice:?}, {occlusion:?}: {hidden} of {in_view} hidden", path.display());
                all.in_view += counts.in_view;
                all.second_pass += counts.second_pass;
            }
        }
    }
    assert!(all.hidden() * 20 > all.in_view, "{} of {} hidden", all.hidden(), all.in_view);
}

/// Inside of a large model, where the picture's borders cut many long triangles, at rest.
#[test]
fn culling_while_drawing_changes_no_pixel_inside_a_real_building() {
    let Some(folder) = std::env::var_os("OSP_CORPUS") else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    let Some(gpu) = gpu() else { return };
    let path = Path::new(&folder).join("scenes/Sponza.obj.gz");
    let open = || recording::open(&path, &OpenOptions::default()).expect("a recording");
    let (summary, _, read) = summarize(&mut open(), Pace::Samples(16));
    read.expect("a whole recording");
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    open().for_each(|event| scene.apply(&event.expect("an event"), &mut changes));
    let camera = CameraPath::new(CameraChoice::Inside, None, &summary.bounds);
    let Some(mut pair) = Pair::new(&gpu, (1920, 1080), HZB, chunk_len()) else { return };
    for part in 1..=6 {
        let view = camera.view(&Moment { frame: summary.frames * part / 6, ..Moment::default() });
        let frustum = view.frustum();
        let ids: Vec<_> = scene.visible_ids().filter(|id| frustum.may_see(&scene.bounds(*id))).collect();
        for frame in 0..4 {
            assert_eq!(pair.compare(&scene, &view, &ids).0, 0, "view {part}, frame {frame}");
        }
    }
    // What the borders cut is drawn; most of the rest is found.
    assert!(pair.hidden_share() > 0.4, "{:?}", pair.counts);
}

/// `auto` tries culling after some frames: the frames of the try, and those around it, show the same.
#[test]
fn auto_changes_no_pixel_when_it_tries_the_other_way() {
    let Some(gpu) = gpu() else { return };
    let [mut auto, mut whole] = [(); 2].map(|()| drawer(&gpu, (161, 121)));
    auto.set_occlusion(GpuOcclusion::Auto).expect("auto asks for nothing");
    let mut scene = Scene::new();
    for i in 0..2200 {
        let at =
            Vec3::new((i % 50) as f32 * 0.02 - 0.5, (i / 50 % 22) as f32 * 0.05, (i / 1100) as f32 * 0.1);
        apply(&mut scene, &[square(at, 0.01, (0.3, 0.5, 0.2, 1.0))]);
    }
    apply(&mut scene, &[square(Vec3::new(0.0, 0.6, 0.7), 0.45, (0.3, 0.5, 0.2, 1.0))]);
    let ids = all_ids(&scene);
    let (mut culled, mut plain) = (0, 0);
    for frame in 0..32 {
        let eye = Vec3::new(0.02 * frame as f32, 0.7, 2.5);
        let view = view_from(eye, Vec3::new(0.0, 0.6, 0.0));
        let times = auto.draw(&scene, &view, &[Layer::plain(&set(&ids))]).expect("a drawn frame");
        match times.occlusion {
            Some(counts) => {
                culled += 1;
                assert_eq!(counts.in_view, ids.len() as u64);
            }
            None => plain += 1,
        }
        whole.draw(&scene, &view, &[Layer::plain(&set(&ids))]).expect("a drawn frame");
        let picture = auto.image().expect("a picture");
        assert_eq!(picture.differing_pixels(&whole.image().expect("a picture")), 0, "frame {frame}");
    }
    // Where the adapter cannot cull, all frames are plain.
    let can_cull = drawer(&gpu, (161, 121)).set_occlusion(GpuOcclusion::Hzb).is_ok();
    assert!(plain > 10 && (culled > 0) == can_cull, "{culled} culled, {plain} not");
}
