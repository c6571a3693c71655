//! The two eyes of a headset share a draw list, which is uploaded once. Each eye's picture equals that of a single view.

use std::{slice, sync::Arc};

use super::{
    hzb::chunk_len,
    painted::{environment, line, stroke},
    scenes::{apply, gpu, sketch, square, view_from, winding_stroke},
};
use glam::Vec3;
use osp::{frame::Pipeline, index::IndexConfig, polygon::Change, view::View};
use osp_render::{DrawTimes, Gpu, GpuOcclusion, Layer, Offscreen, RenderError, RendererConfig};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{SynthKind, Tool, synthesize},
    scene::Scene,
};
use osp_testkit::events::SOLE;

const SIZE: (u32, u32) = (241, 181);

/// Draws the same frame twice: both eyes together, and each alone.
struct Stereo {
    together: Offscreen,
    alone: Offscreen,
    pipeline: Pipeline,
}

impl Stereo {
    /// `None`, with a line, on an adapter that cannot.
    fn new(gpu: &Arc<Gpu>, occlusion: GpuOcclusion, chunk_len: usize) -> Option<Self> {
        let config = RendererConfig { chunk_len, draw_len: chunk_len / 4, ..RendererConfig::default() };
        let drawer = || {
            let mut drawer = Offscreen::on(Arc::clone(gpu), SIZE.0, SIZE.1, &config).expect("a drawer");
            drawer.add_view(SIZE.0, SIZE.1).expect("a second view");
            drawer.renderer.set_environment(Some(&environment()));
            match drawer.set_occlusion(occlusion) {
                Err(error @ RenderError::NoOcclusion { .. }) if !osp_testkit::nothing_may_be_skipped() => {
                    eprintln!("skipped: {error}");
                    None
                }
                outcome => outcome.map(|()| Some(drawer)).expect("what the method needs"),
            }
        };
        let (together, alone) = (drawer()?, drawer()?);
        let pipeline = Pipeline::new(IndexKind::Osp.create(&IndexConfig::default()), 1000);
        Some(Self { together, alone, pipeline })
    }

    /// Draws a frame and compares both pictures; what was drawn together, and alone.
    fn frame(&mut self, scene: &Scene, changes: &[Change], views: &[View; 2], what: &str) -> [DrawTimes; 2] {
        self.together.renderer.follow(changes);
        self.alone.renderer.follow(changes);
        self.pipeline.frame_of_views(scene, changes, views);
        let layers: Vec<Layer<'_>> = self.pipeline.draw_lists().iter().map(Layer::plain).collect();
        let numbered = views.iter().zip(&layers).enumerate();
        let numbered: Vec<_> = numbered.map(|(i, (view, layer))| (i, view, slice::from_ref(layer))).collect();
        let together = self.together.draw_views(scene, &numbered).expect("a frame");
        let mut alone = DrawTimes::default();
        for eye in numbered {
            let times = self.alone.draw_views(scene, &[eye]).expect("a frame");
            alone.list_bytes += times.list_bytes;
            alone.listed += times.listed;
        }
        for eye in 0..2 {
            let [together, alone] =
                [&self.together, &self.alone].map(|drawer| drawer.image_of(eye).expect("a picture"));
            assert!(alone.drawn_pixels() > 0);
            assert_eq!(together.differing_pixels(&alone), 0, "{what}, eye {eye}");
        }
        [together, alone]
    }
}

/// Two eyes beside each other.
fn eyes(from: Vec3, apart_m: f32) -> [View; 2] {
    let middle = view_from(from, Vec3::new(0.0, 0.6, 0.0));
    let right = osp::math::rotate(middle.world_from_view, Vec3::X) * apart_m;
    [-0.5, 0.5].map(|by| View { eye_in_world: middle.eye_in_world + right * by, ..middle })
}

#[test]
fn both_eyes_together_draw_what_each_draws_alone() {
    let Some(gpu) = gpu() else { return };
    let methods = [
        (GpuOcclusion::None, chunk_len()),
        (GpuOcclusion::None, 112),
        (GpuOcclusion::Hzb, chunk_len()),
        (GpuOcclusion::Hzb, 112),
        (GpuOcclusion::Queries, chunk_len()),
    ];
    for (occlusion, chunk_len) in methods {
        let Some(mut stereo) = Stereo::new(&gpu, occlusion, chunk_len) else { return };
        let mut scene = Scene::new();
        let mut events = sketch();
        events.push(square(Vec3::new(0.0, 0.6, 0.7), 0.45, (0.3, 0.5, 0.2, 1.0)));
        for i in 0..9 {
            let middle = Vec3::new(0.0, 0.1 * i as f32, 0.4 - 0.1 * i as f32);
            events.extend(stroke(200 + i, "Highlighter", (0.1, 0.2, 0.3, 1.0), 0.2, line(middle)));
        }
        let mut changes = apply(&mut scene, &events);
        // The eyes of the third view see different polygons. Those of the others share a list.
        let from = [
            ((0.2, 0.6, 2.0), 0.064),
            ((-0.5, 0.7, 0.1), 0.064),
            ((1.6, 0.9, 1.2), 3.0),
            ((9.0, 3.0, 8.0), 0.064),
        ];
        for (number, ((x, y, z), apart_m)) in from.into_iter().enumerate() {
            for time in 0..2 {
                let what = format!("{occlusion:?}, chunks of {chunk_len}, view {number}, time {time}");
                let [together, alone] =
                    stereo.frame(&scene, &changes, &eyes(Vec3::new(x, y, z), apart_m), &what);
                let shares = number != 2 && occlusion != GpuOcclusion::Queries;
                assert_eq!(together.list_bytes < alone.list_bytes, shares, "{what}: {together:?}, {alone:?}");
                let color = (1.0, 0.2, 0.2, if time == 1 { 0.5 } else { 1.0 });
                let new = winding_stroke(300 + number as u32 * 2 + time, Tool::Ribbon, 30, color);
                changes = apply(&mut scene, &new);
                changes.extend(apply(&mut scene, &[SOLE.undo(), SOLE.redo()]));
            }
        }
    }
}

#[test]
fn the_list_of_two_eyes_is_sent_once() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    let events = synthesize(SynthKind::Scribble, 20_000, 1).map(|event| event.expect("an event"));
    let changes = apply(&mut scene, &events.collect::<Vec<_>>());
    let views = eyes(Vec3::new(0.0, 1.0, 4.0), 0.064);
    for (occlusion, most) in [(GpuOcclusion::None, 0.6), (GpuOcclusion::Hzb, 0.75)] {
        let Some(mut stereo) = Stereo::new(&gpu, occlusion, chunk_len()) else { return };
        for time in 0..3 {
            let changes = if time == 0 { &changes[..] } else { &[] };
            let [together, alone] = stereo.frame(&scene, changes, &views, &format!("{occlusion:?}, {time}"));
            let part = together.list_bytes as f64 / alone.list_bytes as f64;
            eprintln!("{occlusion:?}, {time}: {} of {} bytes", together.list_bytes, alone.list_bytes);
            // The first frame also sends constants.
            assert!(part < most || time == 0, "{occlusion:?}: {part}");
            assert!(together.listed as f64 <= alone.listed as f64 * 1.01, "{together:?}, {alone:?}");
        }
    }
}
