//! Time of a frame from the changes to the bytes that a renderer sends, compared with the bare query of the index.
//!
//! `cargo bench --bench frame --features render [-- --quick] [NAME ...]` measures all variants, or only the variants
//! with these names. Each frame removes sixteen polygons, and inserts the polygons that the previous frame removed, so
//! every stage has work. Each frame measures all variants, in rotating order. The printed times are medians.

#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::{hint::black_box, time::Instant};

use osp::{
    frame::{PassConfig, Pipeline},
    index::IndexConfig,
    math::Aabb,
    occlusion::Occlusion,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_render::{Classes, DrawOrder};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Number of polygons that each frame removes; it inserts the same number.
const CHANGED: usize = 16;
/// Polygons of one buffer of the renderer.
const PAGE: usize = 1 << 20;

struct Variant {
    name: &'static str,
    pipeline: Pipeline,
    order: DrawOrder,
    /// Whether a frame also prepares the bytes for the renderer.
    to_bytes: bool,
    us: Vec<f64>,
    /// Sums over all frames, nanoseconds: selecting occluders, building the culler, testing.
    stages_ns: [u64; 3],
    /// Number of polygons found hidden in all frames.
    occluded: u64,
}

impl Variant {
    fn new(name: &'static str, scene: &Scene, bounds: &Aabb, choice: Occlusion, to_bytes: bool) -> Self {
        let capacity = scene.polygon_count();
        let root = Aabb::cube(bounds.center(), bounds.extent().max_element());
        let index = IndexKind::Osp.create(&IndexConfig { root, capacity });
        let pipeline = Pipeline::new(index, capacity);
        let mut pipeline = pipeline.with_occlusion(PassConfig::for_strokes(choice).by_measured_times());
        pipeline.load(scene);
        Self {
            name,
            pipeline,
            order: DrawOrder::new(),
            to_bytes,
            us: Vec::new(),
            stages_ns: [0; 3],
            occluded: 0,
        }
    }

    fn frame(&mut self, scene: &Scene, changes: &[Change], view: &View) {
        let start = Instant::now();
        let record = self.pipeline.frame(scene, changes, view);
        if self.to_bytes {
            self.order.clear();
            self.order
                .add(scene, self.pipeline.draw_list(), 0, view.eye_in_world, PAGE, |_| Classes::default());
            self.order.finish(PAGE);
            black_box(self.order.ids());
        }
        self.us.push(start.elapsed().as_secs_f64() * 1.0e6);
        let stages = [record.occlusion.select, record.occlusion.build, record.occlusion.query];
        for (sum, stage) in self.stages_ns.iter_mut().zip(stages) {
            *sum += stage.ns;
        }
        self.occluded += record.occlusion.occluded;
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn measure(polygons: u32, frames: usize, only: &[String]) {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, polygons, 1) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut changes);
    }
    let bounds = scene.visible_ids().fold(Aabb::EMPTY, |all, id| all.union(&scene.bounds(id)));
    for camera in [CameraChoice::Inside, CameraChoice::Orbit] {
        let view = CameraPath::new(camera, None, &bounds).view(&Moment::default());
        let mut variants = vec![
            Variant::new("frustum", &scene, &bounds, Occlusion::None, false),
            Variant::new("to bytes", &scene, &bounds, Occlusion::None, true),
            Variant::new("msvbsp", &scene, &bounds, Occlusion::Msvbsp, false),
            Variant::new("auto", &scene, &bounds, Occlusion::Auto, false),
        ];
        variants.retain(|variant| only.is_empty() || only.iter().any(|name| name == variant.name));
        let (mut bare, mut visible) = (Vec::new(), VisibleBlocks::with_capacity(scene.polygon_count()));
        let ids: Vec<PolygonId> = scene.visible_ids().collect();
        for frame in 0..frames {
            // Inserts the polygons that the previous frame removed.
            let some = |frame: usize| (0..CHANGED).map(move |i| frame * 7919 + i * 104_729);
            let removed = some(frame).map(|i| Change::Remove(ids[i % ids.len()]));
            let back = frame.checked_sub(1).into_iter().flat_map(some);
            let changes: Vec<Change> =
                back.map(|i| Change::Insert(ids[i % ids.len()])).chain(removed).collect();
            for turn in 0..variants.len() {
                let at = (turn + frame) % variants.len();
                variants[at].frame(&scene, &changes, &view);
            }
            let frustum = view.frustum();
            let start = Instant::now();
            visible.clear();
            black_box(variants[0].pipeline.index().frustum_cull_blocks(&frustum, &mut visible));
            bare.push(start.elapsed().as_secs_f64() * 1.0e6);
        }
        let bare = median(&mut bare);
        println!(
            "{} polygons, {}, {} in view: the bare query {bare:.1} us",
            ids.len(),
            camera.name(),
            visible.len()
        );
        for variant in &mut variants {
            let us = median(&mut variant.us);
            print!("  {:10} {us:9.1} us, {:5.2} times the query", variant.name, us / bare);
            let frames = variant.us.len() as f64;
            let [select, build, query] = variant.stages_ns.map(|ns| ns as f64 * 1.0e-3 / frames);
            if select > 0.0 {
                let found = variant.occluded as f64 / frames;
                print!(", means: select {select:.1}, build {build:.1}, test {query:.1}, {found:.0} hidden");
            }
            println!();
        }
    }
}

fn main() {
    let quick = std::env::args().any(|word| word == "--quick" || word == "--test");
    let only: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for polygons in [100_000, 1_000_000] {
        measure(polygons, if quick { 60 } else { 600 }, &only);
    }
}
