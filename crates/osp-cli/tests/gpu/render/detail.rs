//! Merged polygons of strokes far away, against pictures of all polygons.

use std::sync::Arc;

use super::scenes::{all_ids, drawer, gpu, set, sketch, square, view_from, winding_stroke};
use glam::{Quat, Vec3};
use osp::{
    math::Aabb,
    polygon::Change,
    view::{Projection, View},
};
use osp_render::{DrawTimes, Gpu, Image, Layer, Offscreen};
use osp_session::{
    brush::{self, Brush, Draw},
    recording::{Event, NormalRule, Paint, StrokeId, SynthKind, Tool, synthesize},
    scene::{Scene, Stroke},
};
use osp_testkit::events::{Begin, SOLE, scene_of};

const SIZE: (u32, u32) = (640, 480);
/// Largest mean difference of a channel, steps of 8 bits.
const MOST_MEAN: f64 = 0.05;
/// Largest share of pixels whose colour lies outside the colours of their neighbourhood in the other picture.
const MOST_UNLIKE: f64 = 0.0003;
/// Largest number of pixels that change within a surface: another surface is at nearly the same depth.
const MOST_CHANGED: usize = 3;

fn detailed(gpu: &Arc<Gpu>, is_auto: bool) -> Offscreen {
    let mut drawer = drawer(gpu, SIZE);
    drawer.set_detail(is_auto);
    drawer
}

fn drawn(drawer: &mut Offscreen, scene: &Scene, view: &View) -> (DrawTimes, Image) {
    let times = drawer.draw(scene, view, &[Layer::plain(&set(&all_ids(scene)))]).expect("a drawn frame");
    (times, drawer.image().expect("a picture"))
}

/// Ribbons and tubes without brushes.
fn scribble(polygons: u32) -> Vec<Event> {
    let events: Result<Vec<Event>, _> = synthesize(SynthKind::Scribble, polygons, 1).collect();
    events.expect("a model")
}

/// A view from a multiple of the scene's size.
fn view_of(scene: &Scene, times: f32) -> View {
    let bounds = scene.visible_ids().fold(Aabb::EMPTY, |all, id| all.union(&scene.bounds(id)));
    let (middle, size_m) = (bounds.center(), bounds.extent().max_element());
    let away = Vec3::new(0.2, 0.3, 1.0) * size_m * times;
    let projection = Projection::symmetric(60.0, 4.0 / 3.0, 0.01 * size_m, 100.0 * size_m);
    View::look_at(middle + away, middle, projection)
}

/// A stroke of every opaque brush, each on a helix of its own.
fn brushes() -> Scene {
    let is_opaque = |brush: &&Brush| matches!(brush.draw, Draw::Opaque | Draw::Cutout);
    let mut events = Vec::new();
    for (number, brush) in brush::all().iter().filter(|brush| brush.is_offered).filter(is_opaque).enumerate()
    {
        let (t, stroke) = (0.0, StrokeId(number as u32 + 1));
        let paint = Some(Box::new(Paint::new(&brush.name, number as u32)));
        let part = number as f32 / 40.0;
        let (tool, normal, color) =
            (Tool::Ribbon, NormalRule::Travel, (0.3 + 0.7 * part, 0.9 - part * 0.5, 0.5, 1.0));
        events.push(
            Begin { tool, width: 0.05, color, normal, thinnest: 0.3, paint, ..Begin::of(stroke) }.event(),
        );
        let middle = Vec3::new((number % 7) as f32 * 0.35 - 1.05, (number / 7) as f32 * 0.35 - 0.9, 0.0);
        events.extend((0..160).map(|i| {
            let angle = i as f32 * 0.08;
            let p = middle + Vec3::new(angle.cos(), i as f32 * 0.006 - 0.5, angle.sin()) * 0.13;
            Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure: 0.6 + 0.3 * (angle * 0.4).sin() }
        }));
        events.push(Event::End { t, stroke });
    }
    scene_of(&events)
}

/// Mean difference of all channels, steps of 8 bits.
fn mean_difference(a: &Image, b: &Image) -> f64 {
    let sum: u64 = a.rgba().iter().zip(b.rgba()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.rgba().len() as f64
}

/// Number of pixels that differ by more than `steps` although all pixels within two pixels have nearly one colour.
fn changed_surfaces(full: &Image, other: &Image, steps: u8) -> usize {
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    let pixel = |image: &Image, x: usize, y: usize| -> [u8; 3] {
        let at = (y * width + x) * 4;
        std::array::from_fn(|i| image.rgba()[at + i])
    };
    let far = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).any(|(a, b)| a.abs_diff(b) > steps);
    let is_changed = |at: &usize| {
        let (x, y) = (at % width, at / width);
        let own = pixel(full, x, y);
        far(own, pixel(other, x, y))
            && (x.saturating_sub(2)..(x + 3).min(width))
                .all(|x| (y.saturating_sub(2)..(y + 3).min(height)).all(|y| !far(own, pixel(full, x, y))))
    };
    (0..width * height).filter(is_changed).count()
}

#[test]
fn far_strokes_have_fewer_vertices_and_no_edge_moves() {
    let Some(gpu) = gpu() else { return };
    let mut wrong = Vec::new();
    for (name, scene) in [("plain", scene_of(&scribble(20_000))), ("brushes", brushes())] {
        let (mut full, mut auto) = (detailed(&gpu, false), detailed(&gpu, true));
        for (times, most_listed) in [(1.0, 1.0), (4.0, 0.65), (16.0, 0.5)] {
            let view = view_of(&scene, times);
            let (all, expected) = drawn(&mut full, &scene, &view);
            let (fewer, found) = drawn(&mut auto, &scene, &view);
            let share = fewer.listed as f64 / all.listed as f64;
            let mean = mean_difference(&expected, &found);
            let pixels = f64::from(SIZE.0 * SIZE.1);
            let unlike = expected.unlike_pixels(&found).max(found.unlike_pixels(&expected)) as f64 / pixels;
            let changed = changed_surfaces(&expected, &found, 4);
            let what = format!(
                "{name}, {times} times as far: {share:.2} listed, mean {mean:.4}, unlike {unlike:.6}, surfaces {changed}"
            );
            if share > most_listed || mean > MOST_MEAN || unlike > MOST_UNLIKE || changed > MOST_CHANGED {
                wrong.push(what);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn where_nothing_is_merged_the_picture_is_the_same() {
    let Some(gpu) = gpu() else { return };
    let place = |i: u32| Vec3::new((i % 20) as f32 * 0.1 - 1.0, (i / 20) as f32 * 0.1, -(i as f32) * 0.01);
    let squares: Vec<Event> =
        (0..300).map(|i| square(place(i), 0.04, (i as f32 / 300.0, 0.5, 0.8, 1.0))).collect();
    let scene = scene_of(&squares);
    let view = view_from(Vec3::new(0.3, 0.9, 3.0), Vec3::new(0.0, 0.7, 0.0));
    let mut auto = detailed(&gpu, true);
    let (all, expected) = drawn(&mut detailed(&gpu, false), &scene, &view);
    let (same, found) = drawn(&mut auto, &scene, &view);
    assert_eq!((same.listed, found.differing_pixels(&expected)), (all.listed, 0));
    // Switched off, it leaves nothing behind.
    let scene = scene_of(&sketch());
    let (_, expected) = drawn(&mut detailed(&gpu, false), &scene, &view);
    auto.renderer.forget_from(0);
    drawn(&mut auto, &scene, &view);
    auto.set_detail(false);
    assert_eq!(drawn(&mut auto, &scene, &view).1.differing_pixels(&expected), 0);
}

#[test]
fn merged_polygons_follow_every_change() {
    let Some(gpu) = gpu() else { return };
    let events = scribble(3000);
    let view = view_of(&scene_of(&events), 2.0);
    let mut scene = Scene::new();
    let mut auto = detailed(&gpu, true);
    let mut step = |scene: &mut Scene, events: &[Event], what: &str| {
        let mut changes: Vec<Change> = Vec::new();
        scene.apply_all(events, &mut changes);
        auto.renderer.follow(&changes);
        let (times, found) = drawn(&mut auto, scene, &view);
        let (fresh, expected) = drawn(&mut detailed(&gpu, true), scene, &view);
        assert_eq!(found.differing_pixels(&expected), 0, "{what}");
        assert_eq!(times.listed, fresh.listed, "{what}");
        let (full, _) = drawn(&mut detailed(&gpu, false), scene, &view);
        assert!(times.listed < full.listed, "{what}");
        found
    };
    for (number, some) in events.chunks(events.len() / 7).enumerate() {
        step(&mut scene, some, &format!("part {number}"));
    }
    let all = scene.strokes().iter().filter_map(Stroke::id).collect::<Vec<_>>();
    let before = step(&mut scene, &[SOLE.erase(all[3])], "erased");
    step(&mut scene, &[SOLE.undo()], "restored");
    let after = step(&mut scene, &[SOLE.moved(all, Vec3::new(0.2, 0.1, 0.0))], "moved");
    assert!(before.differing_pixels(&after) > 1000);
    step(&mut scene, &winding_stroke(9000, Tool::Tube, 60, (0.9, 0.2, 0.1, 1.0)), "another stroke");
}

#[test]
fn a_replay_that_goes_back_drops_merged_polygons() {
    let Some(gpu) = gpu() else { return };
    let events = scribble(3000);
    let view = view_of(&scene_of(&events), 2.0);
    let is_end = |event: &Event| matches!(event, Event::End { .. });
    let half = &events[..=events[..events.len() / 2].iter().rposition(is_end).expect("a stroke")];
    let before = scene_of(half);
    let stroke = winding_stroke(9000, Tool::Tube, 70, (0.1, 0.2, 0.9, 1.0));
    let other = scene_of(&[half, &stroke].concat());
    let mut auto = detailed(&gpu, true);
    drawn(&mut auto, &scene_of(&events), &view);
    for scene in [before.clone(), other] {
        auto.renderer.forget_from(before.polygon_count());
        let (times, found) = drawn(&mut auto, &scene, &view);
        let (fresh, expected) = drawn(&mut detailed(&gpu, true), &scene, &view);
        assert_eq!((times.listed, found.differing_pixels(&expected)), (fresh.listed, 0));
    }
}
