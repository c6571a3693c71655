//! What was right for an earlier frame must not be taken for this one: another picture, other polygons of the same numbers.

use std::sync::Arc;

use super::scenes::{all_ids, apply, gpu, set, square, view_from};
use glam::Vec3;
use osp::view::View;
use osp_render::{Gpu, GpuOcclusion, GpuTimer, Image, Layer, Renderer, RendererConfig, Target, ViewSlot};
use osp_session::{
    recording::{Author, Event, StrokeId},
    scene::Scene,
};
use osp_testkit::events::scene_of;

const GREEN: (f32, f32, f32, f32) = (0.2, 0.8, 0.3, 1.0);
const RED: (f32, f32, f32, f32) = (0.9, 0.2, 0.2, 1.0);
const GLASS: (f32, f32, f32, f32) = (0.2, 0.2, 0.9, 0.4);

fn view() -> View {
    view_from(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO)
}

fn draw(renderer: &mut Renderer, slot: &mut ViewSlot, target: &Target, scene: &Scene, view: &View) -> Image {
    let gpu = Arc::clone(&renderer.gpu);
    let mut timer = GpuTimer::new(&gpu);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.send(scene);
    renderer.prepare(slot, scene, &view.with_aspect(target.aspect()), &[Layer::plain(&set(&all_ids(scene)))]);
    renderer.encode(&mut encoder, target, slot, &mut timer, |_| {});
    gpu.queue.submit([encoder.finish()]);
    slot.submitted();
    timer.submitted();
    gpu.wait().expect("a device");
    target.image(&gpu).expect("a picture")
}

fn fresh(gpu: &Arc<Gpu>, target: &Target, scene: &Scene, view: &View) -> Image {
    let mut renderer = Renderer::new(Arc::clone(gpu), &RendererConfig::default());
    let mut slot = renderer.create_view_slot();
    draw(&mut renderer, &mut slot, target, scene, view)
}

/// A square that is a stroke of its own.
fn plate(number: u32, center: Vec3, half_m: f32, color: (f32, f32, f32, f32)) -> Event {
    match square(center, half_m, color) {
        Event::Polygon { t, vertices, color, .. } => Event::Polygon {
            author: Author::SOLE,
            t,
            stroke: Some(StrokeId(number)),
            vertices,
            shading: None,
            color,
        },
        other => other,
    }
}

fn moved(number: u32, by: Vec3) -> Event {
    Event::Move { author: Author::SOLE, t: 0.0, strokes: vec![StrokeId(number)], by }
}

/// A picture that becomes smaller, or changes its depth only, needs no larger memory, but its bindings must be made again.
/// The depth of a finished picture is not kept. In a picture of another size, the wall hides the same polygons again.
#[test]
fn the_depth_of_a_larger_picture_is_not_asked_for_a_smaller_one() {
    let Some(gpu) = gpu() else { return };
    let mut scene =
        scene_of(&[plate(1, Vec3::new(0.0, 0.0, 1.0), 3.0, GREEN), plate(2, Vec3::ZERO, 0.5, RED)]);
    let mut renderer = Renderer::new(Arc::clone(&gpu), &RendererConfig::default());
    let mut slot = renderer.create_view_slot();
    if let Err(error) = renderer.set_occlusion(&mut slot, GpuOcclusion::Hzb) {
        assert!(!osp_testkit::nothing_may_be_skipped(), "{error}");
        eprintln!("skipped: {error}");
        return;
    }
    let target = |width, height| Target::new(&gpu, width, height).expect("a target");
    for size in [(200, 150), (100, 75), (100, 75), (64, 48), (200, 150)] {
        let target = target(size.0, size.1);
        for _ in 0..2 {
            draw(&mut renderer, &mut slot, &target, &scene, &view());
        }
        assert_eq!(slot.take_counts().expect("counts").hidden(), 1, "{size:?}: the wall hides the other");
    }
    // The wall goes out of the picture; in the old depth it is still there, before everything.
    renderer.follow(&apply(&mut scene, &[moved(1, Vec3::new(50.0, 0.0, 0.0))]));
    for size in [(100, 75), (100, 75), (64, 48)] {
        let small = target(size.0, size.1);
        for time in 0..2 {
            let drawn = draw(&mut renderer, &mut slot, &small, &scene, &view());
            let expected = fresh(&gpu, &small, &scene, &view());
            assert!(expected.drawn_pixels() > 50);
            assert_eq!(drawn.differing_pixels(&expected), 0, "{size:?}, time {time}");
        }
    }
}

/// A green square and glass before it are drawn, and the glass is taken back: its number is free.
fn glass_that_is_taken_back(gpu: &Arc<Gpu>) -> (Target, Renderer, ViewSlot, Event) {
    let target = Target::new(gpu, 160, 120).expect("a target");
    let mut renderer = Renderer::new(Arc::clone(gpu), &RendererConfig::default());
    let mut slot = renderer.create_view_slot();
    let back = square(Vec3::new(0.0, 0.0, -0.5), 0.8, GREEN);
    let glass = scene_of(&[back.clone(), square(Vec3::ZERO, 0.5, GLASS)]);
    draw(&mut renderer, &mut slot, &target, &glass, &view());
    renderer.forget_from(1);
    (target, renderer, slot, back)
}

/// Numbers are given out again when a session is taken back: what could be seen through was another polygon.
#[test]
fn a_number_that_was_transparent_is_opaque_when_it_is_given_out_again() {
    let Some(gpu) = gpu() else { return };
    let (target, mut renderer, mut slot, back) = glass_that_is_taken_back(&gpu);
    // Drawn after, as what can be seen through is, it would hide what is before it.
    let front = square(Vec3::new(0.2, 0.0, 0.5), 0.3, GLASS);
    let solid = scene_of(&[back, square(Vec3::ZERO, 0.5, RED), front]);
    for _ in 0..2 {
        let drawn = draw(&mut renderer, &mut slot, &target, &solid, &view());
        assert_eq!(drawn.differing_pixels(&fresh(&gpu, &target, &solid, &view())), 0);
    }
    // Taken back to nothing, and something else drawn: the numbers before count, too.
    renderer.forget_from(0);
    let other = scene_of(&[square(Vec3::new(0.1, 0.1, 0.0), 0.4, RED)]);
    let drawn = draw(&mut renderer, &mut slot, &target, &other, &view());
    assert_eq!(drawn.differing_pixels(&fresh(&gpu, &target, &other, &view())), 0);
}

/// What could be seen through was drawn last, from back to front by its middle, and blended: an opaque polygon that takes its
/// number must not be, or it covers glass before it whose middle is farther away.
#[test]
fn an_opaque_polygon_with_the_number_of_a_transparent_one_does_not_cover_glass() {
    let Some(gpu) = gpu() else { return };
    let (target, mut renderer, mut slot, back) = glass_that_is_taken_back(&gpu);
    // Before the opaque one in the picture's right half; its middle lies far to the side.
    let wide = square(Vec3::new(2.5, 0.0, 0.3), 2.4, GLASS);
    let solid = scene_of(&[back, square(Vec3::ZERO, 0.5, RED), wide]);
    let drawn = draw(&mut renderer, &mut slot, &target, &solid, &view());
    assert_eq!(drawn.differing_pixels(&fresh(&gpu, &target, &solid, &view())), 0);
}

/// A polygon that has moved and is taken back before it was sent again: there is none to send.
#[test]
fn what_has_moved_and_is_taken_back_is_not_sent() {
    let Some(gpu) = gpu() else { return };
    let target = Target::new(&gpu, 160, 120).expect("a target");
    let mut renderer = Renderer::new(Arc::clone(&gpu), &RendererConfig::default());
    let mut slot = renderer.create_view_slot();
    let first = plate(1, Vec3::ZERO, 0.5, GREEN);
    let mut scene = scene_of(&[first.clone(), plate(2, Vec3::new(0.0, 0.0, 0.3), 0.2, RED)]);
    draw(&mut renderer, &mut slot, &target, &scene, &view());
    let changes = apply(&mut scene, &[moved(2, Vec3::new(0.3, 0.0, 0.0))]);
    assert!(!changes.is_empty());
    renderer.follow(&changes);
    renderer.forget_from(1);
    let taken_back = scene_of(&[first]);
    assert_eq!(renderer.send(&taken_back), 0, "nothing is new");
    let drawn = draw(&mut renderer, &mut slot, &target, &taken_back, &view());
    assert_eq!(drawn.differing_pixels(&fresh(&gpu, &target, &taken_back, &view())), 0);
}
