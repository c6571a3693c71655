//! What brushes paint: light is added, shapes are cut out, squares face the eye, and culling still changes no pixel.

use std::sync::Arc;

use super::{
    hzb::{HZB, Pair, QUERIES, chunk_len},
    scenes::{all_ids, drawer, gpu, picture, pixel, square, view_from},
};
use glam::{Quat, Vec3};
use osp::view::View;
use osp_render::{Gpu, Image, Offscreen};
use osp_session::{
    brush,
    recording::{Environment, Event, NormalRule, Paint, StrokeId},
    scene::Scene,
};
use osp_testkit::events::{self, Begin};

const SIZE: (u32, u32) = (320, 240);
type Color = (f32, f32, f32, f32);
const RED: Color = (0.8, 0.1, 0.1, 1.0);
const GREY: Color = (0.4, 0.4, 0.4, 1.0);
const BLACK: Color = (0.0, 0.0, 0.0, 1.0);

/// Light from everywhere, a sky from dark red below to blue above.
pub(crate) fn environment() -> Environment {
    Environment {
        sky: [Vec3::new(0.4, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.8)],
        ambient: Vec3::splat(0.5),
        lights: [(Vec3::NEG_Y, Vec3::splat(0.4)), (Vec3::NEG_Z, Vec3::splat(0.3))],
        reflection: 0.3,
        ..Environment::default()
    }
}

/// A stroke of a brush through these points, held so that ribbons face +z.
pub(crate) fn stroke(
    number: u32,
    brush: &str,
    color: Color,
    width: f32,
    points: impl IntoIterator<Item = Vec3>,
) -> Vec<Event> {
    let (t, stroke, normal) = (0.0, StrokeId(number), NormalRule::Travel);
    let paint = Some(Box::new(Paint::new(brush, 7 + number)));
    let begin = Begin { width, color, normal, thinnest: 0.0, paint, ..Begin::of(stroke) };
    let mut events = vec![begin.event()];
    let point = |p| Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure: 1.0 };
    events.extend(points.into_iter().map(point));
    events.push(Event::End { t, stroke });
    events
}

/// A metre from left to right through this place.
pub(crate) fn line(middle: Vec3) -> impl Iterator<Item = Vec3> {
    (0..=20).map(move |i| middle + Vec3::X * (i as f32 * 0.05 - 0.5))
}

fn scene_of(events: &[Event]) -> Scene {
    for event in events {
        if let Event::Begin { paint: Some(paint), .. } = event {
            assert!(brush::find(&paint.brush).is_some(), "{}", paint.brush);
        }
    }
    events::scene_of(events)
}

/// A drawer with that light.
pub(crate) fn lit(gpu: &Arc<Gpu>, size: (u32, u32)) -> Offscreen {
    let mut drawer = drawer(gpu, size);
    drawer.renderer.set_environment(Some(&environment()));
    drawer
}

fn drawn(gpu: &Arc<Gpu>, events: &[Event]) -> Image {
    picture(&mut lit(gpu, SIZE), &scene_of(events), &ahead())
}

fn middle(image: &Image) -> [u8; 3] {
    pixel(image, SIZE.0 / 2, SIZE.1 / 2)
}

fn ahead() -> View {
    view_from(Vec3::ZERO, Vec3::NEG_Z)
}

#[test]
fn added_light_brightens_what_is_behind_and_hides_nothing() {
    let Some(gpu) = gpu() else { return };
    let wall = square(Vec3::Z * -2.0, 2.0, GREY);
    let with = |color, z: f32| {
        let mut events = stroke(1, "Highlighter", color, 0.3, line(Vec3::Z * z));
        // The wall comes after it.
        events.push(wall.clone());
        drawn(&gpu, &events)
    };
    let alone = drawn(&gpu, std::slice::from_ref(&wall));
    let (before, after) = (middle(&alone), middle(&with(RED, -1.0)));
    assert!(after[0] > before[0] + 100, "{before:?} became {after:?}");
    assert!(after[1] >= before[1] && after[2] >= before[2], "{before:?} became {after:?}");
    assert_eq!(with(BLACK, -1.0).differing_pixels(&alone), 0, "black light is none");
    assert_eq!(with(RED, -3.0).differing_pixels(&alone), 0, "it is behind the wall");
    // Of two strokes, none hides the other, whichever is nearer.
    let both = |near: f32, far: f32| {
        let mut events = stroke(1, "Highlighter", (0.3, 0.0, 0.0, 1.0), 0.3, line(Vec3::Z * near));
        events.extend(stroke(2, "Highlighter", (0.0, 0.3, 0.0, 1.0), 0.3, line(Vec3::Z * far)));
        middle(&drawn(&gpu, &events))
    };
    assert_eq!(both(-1.0, -1.5), both(-1.5, -1.0));
}

#[test]
fn what_is_cut_out_is_not_there_where_its_texture_is_empty() {
    let Some(gpu) = gpu() else { return };
    let events = |brush| stroke(1, brush, RED, 0.4, line(Vec3::NEG_Z));
    let [pointed, whole] = ["TaperedMarker", "Flat"].map(|brush| drawn(&gpu, &events(brush)));
    // The ribbon is 0.4 high: near its upper rim, left and right.
    let y = SIZE.1 / 2 - 28;
    let (left, right) = (SIZE.0 / 2 - 50, SIZE.0 / 2 + 80);
    let is_red = |image: &Image, x| {
        let [r, _, b] = pixel(image, x, y);
        r > b
    };
    assert!(is_red(&whole, left) && is_red(&whole, right));
    assert!(is_red(&pointed, left) && !is_red(&pointed, right), "it is pointed at its end");
    // What is not there hides nothing, though it came before.
    let mut with_wall = events("TaperedMarker");
    with_wall.push(square(Vec3::Z * -2.0, 2.0, (0.1, 0.9, 0.1, 1.0)));
    let [r, g, _] = pixel(&drawn(&gpu, &with_wall), right, y);
    assert!(g > 100 && g > r, "the wall is seen beside the point: {r} {g}");
}

#[test]
fn the_sky_is_a_gradient_and_a_floor_hides_it() {
    let Some(gpu) = gpu() else { return };
    let mut drawer = lit(&gpu, SIZE);
    let scene = Scene::new();
    let mut draw = |environment: &Environment, view: &View| {
        drawer.renderer.set_environment(Some(environment));
        let image = picture(&mut drawer, &scene, view);
        [0, SIZE.1 - 1].map(|y| pixel::<3>(&image, SIZE.0 / 2, y))
    };
    let [top, bottom] = draw(&environment(), &ahead());
    assert!(top[2] > bottom[2] + 60 && bottom[0] > top[0] + 30, "{top:?} over {bottom:?}");
    // Thirty degrees up: half of the way and half of that sine.
    let part = 0.5 + 0.5 * (119.5f32 / 120.0 * 30f32.to_radians().tan()).atan().sin();
    let expected = environment().sky[0].lerp(environment().sky[1], part) * 255.0;
    // A twentieth of the light spreads.
    assert!((f32::from(top[2]) - expected.z).abs() < 8.0 && (f32::from(top[0]) - expected.x).abs() < 8.0);
    let [up, _] = draw(&environment(), &view_from(Vec3::ZERO, Vec3::new(0.001, 1.0, 0.0)));
    assert!(up[2] > 180 && up[0] < 20, "{up:?}");
    let turned = Environment { sky_rotation: Quat::from_rotation_z(std::f32::consts::PI), ..environment() };
    let below = draw(&turned, &ahead())[1];
    assert!((0..3).all(|i| below[i].abs_diff(top[i]) <= 2), "upside down: {below:?} and {top:?}");
    let floor = Environment { floor: Some(Vec3::new(0.0, 0.5, 0.0)), ..environment() };
    let [above, below] = draw(&floor, &ahead());
    assert!(above[2] > 140 && below[1] > 110 && below[0].max(below[2]) < 8, "{above:?} over {below:?}");
}

#[test]
fn things_stand_in_their_environments() {
    let Some(gpu) = gpu() else { return };
    let mut drawer = lit(&gpu, SIZE);
    let scene = Scene::new();
    let mut middle = |preset: &str, floor: Option<Vec3>, eye: Vec3, target: Vec3| {
        let black = [Vec3::ZERO; 2];
        let environment = Environment { preset: preset.to_owned(), sky: black, floor, ..environment() };
        drawer.renderer.set_environment(Some(&environment));
        middle(&picture(&mut drawer, &scene, &view_from(eye, target)))[0]
    };
    // The moon, the bust and the pedestal stand half a metre in front of the origin. Each is compared with the sky beside it.
    for (preset, height) in [("Space", 1.3), ("DressForm", 1.6), ("Pedestal", 0.5)] {
        let eye = Vec3::new(0.0, height, 1.0);
        let thing = middle(preset, None, eye, Vec3::new(0.0, height, -0.5));
        let beside = middle(preset, None, eye, Vec3::new(-1.0, height + 0.3, -0.5));
        assert!(thing > beside + 20, "{preset}: {thing} beside {beside}");
    }
    // The slab of Standard is brightest in its middle; it darkens the floor close to its sides.
    let floor = Some(Vec3::splat(0.2));
    let at = [0.1, 1.1, 1.52, 2.2].map(|x| Vec3::new(x, 0.0, 0.1));
    let [pool, slab, close, open] = at.map(|at| middle("Standard", floor, at + Vec3::new(0.1, 1.6, 0.1), at));
    assert!(pool > slab && slab > close && open > close, "{pool} {slab} {close} {open}");
}

#[test]
fn fog_lies_over_what_is_far_but_not_over_light() {
    let Some(gpu) = gpu() else { return };
    let foggy = Environment { fog: (Vec3::ONE, 0.5), ..environment() };
    let middle_of = |brush: &str, z: f32, environment: &Environment| {
        let scene = scene_of(&stroke(1, brush, RED, 0.3 * -z, line(Vec3::Z * z)));
        let mut drawer = lit(&gpu, SIZE);
        drawer.renderer.set_environment(Some(environment));
        middle(&picture(&mut drawer, &scene, &ahead()))
    };
    let [near, far] = [-1.0, -2.0].map(|z| middle_of("Flat", z, &foggy));
    let clear = middle_of("Flat", -1.0, &environment());
    assert!(clear[2] < near[2] && near[2] < far[2], "{clear:?} {near:?} {far:?}");
    assert_eq!(middle_of("Highlighter", -1.0, &foggy), middle_of("Highlighter", -1.0, &environment()));
}

#[test]
fn squares_face_every_eye_and_stay_in_their_boxes() {
    let Some(gpu) = gpu() else { return };
    let lit = lit_from_four_sides(&gpu, "Dots");
    let (least, most) = (lit.iter().min().expect("some"), lit.iter().max().expect("some"));
    assert!(*least > 30 && most * 10 < least * 13, "a disc from everywhere: {lit:?}");
    // These move.
    let lit = lit_from_four_sides(&gpu, "Embers");
    assert!(lit.iter().all(|count| *count > 50), "{lit:?}");
}

/// Pixels that the light of one particle covers, seen from four sides at two moments; all of them lie in its box.
fn lit_from_four_sides(gpu: &Arc<Gpu>, brush: &str) -> Vec<u32> {
    // So short a stroke has one particle.
    let scene = scene_of(&stroke(1, brush, (1.0, 0.9, 0.8, 1.0), 0.4, [Vec3::ZERO, Vec3::X * 0.001]));
    let ids = all_ids(&scene);
    assert!(ids.iter().any(|&id| scene.surface(id).is_facing()), "particles face the eye");
    let mut drawer = lit(gpu, SIZE);
    drawer.renderer.set_environment(Some(&Environment { sky: [Vec3::ZERO; 2], ..environment() }));
    let mut lit = Vec::new();
    for eye in [Vec3::Z, Vec3::X, Vec3::new(0.5, 0.7, -0.5), Vec3::new(0.0, -1.0, 0.01)] {
        let view = view_from(eye * 3.0, Vec3::ZERO);
        for time_s in [0.1, 0.7] {
            drawer.renderer.set_time(time_s);
            let image = picture(&mut drawer, &scene, &view);
            let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
            for id in &ids {
                for corner in scene.bounds(*id).corners() {
                    let at = view.clip_from_world().project_point3(corner);
                    (low, high) = (low.min(at), high.max(at));
                }
            }
            let mut count = 0;
            for (x, y) in (0..SIZE.0).flat_map(|x| (0..SIZE.1).map(move |y| (x, y))) {
                // Less is what spreads.
                if pixel::<3>(&image, x, y)[0] > 40 {
                    count += 1;
                    let at = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0) / Vec3::new(160.0, -120.0, 1.0)
                        - Vec3::new(1.0, -1.0, 0.0);
                    let pixel = Vec3::new(1.0 / 160.0, 1.0 / 120.0, 0.0);
                    let is_in = at.truncate().cmpge((low - pixel).truncate()).all()
                        && at.truncate().cmple((high + pixel).truncate()).all();
                    assert!(is_in, "{x} {y} is out of the box, from {eye} at {time_s} s");
                }
            }
            lit.push(count);
        }
    }
    lit
}

#[test]
fn light_spreads_around_what_shines() {
    let Some(gpu) = gpu() else { return };
    let beside = |brush| {
        let image = drawn(&gpu, &stroke(1, brush, (0.9, 0.9, 0.9, 1.0), 0.05, line(Vec3::NEG_Z)));
        // Well above the stroke.
        u32::from(pixel::<3>(&image, SIZE.0 / 2, SIZE.1 / 2 - 40)[1])
    };
    let (shining, plain) = (beside("Light"), beside("Flat"));
    assert!(shining > plain + 10, "{shining} beside a light, {plain} beside paint");
}

/// A stroke of every brush, around the origin.
fn every_brush() -> Vec<Event> {
    let mut events = vec![square(Vec3::new(0.0, 0.0, -0.4), 0.35, GREY)];
    for (number, brush) in brush::all().iter().enumerate() {
        let part = number as f32 / brush::all().len() as f32;
        let points = (0..12).map(|i| {
            let angle = part * 40.0 + i as f32 * 0.1;
            Vec3::new(angle.cos() * (0.2 + 0.3 * part), part - 0.5, angle.sin() * (0.2 + 0.3 * part))
        });
        events.extend(stroke(number as u32, &brush.name, (0.9, part, 1.0 - part, 1.0), 0.08, points));
    }
    events
}

#[test]
fn culling_while_drawing_changes_no_pixel_of_any_brush() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&every_brush());
    for method in [HZB, QUERIES] {
        let Some(mut pair) = Pair::new(&gpu, SIZE, method, chunk_len()) else { return };
        pair.set_environment(&environment());
        for (i, eye) in [Vec3::new(0.2, 0.3, 1.5), Vec3::new(-0.4, 0.1, -1.2), Vec3::new(0.0, 0.0, 0.9)]
            .into_iter()
            .enumerate()
        {
            let view = view_from(eye, Vec3::ZERO);
            for turn in 0..2 {
                let image = pair.check(&scene, &view, &format!("{method:?}, eye {i}, picture {turn}"));
                assert!(image.drawn_pixels() > 5000);
            }
        }
        assert!(pair.counts.hidden() > 0, "something is hidden: {:?}", pair.counts);
    }
}

#[test]
fn a_picture_is_the_same_every_time_and_moves_with_time() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&every_brush());
    let view = view_from(Vec3::new(0.2, 0.3, 1.5), Vec3::ZERO);
    let mut one = lit(&gpu, SIZE);
    let draw = |drawer: &mut Offscreen, time_s| {
        drawer.renderer.set_time(time_s);
        picture(drawer, &scene, &view)
    };
    let first = draw(&mut one, 1.0);
    let later = draw(&mut one, 1.3);
    assert!(later.differing_pixels(&first) > 20, "brushes move by themselves");
    assert_eq!(draw(&mut one, 1.0).differing_pixels(&first), 0);
    assert_eq!(draw(&mut lit(&gpu, SIZE), 1.0).differing_pixels(&first), 0);
}

#[test]
fn what_no_brush_has_painted_looks_the_same_beside_paint() {
    let Some(gpu) = gpu() else { return };
    let events = [square(Vec3::Z * -2.0, 4.0, (0.8, 0.5, 0.2, 1.0))];
    let plain = {
        let scene = scene_of(&events);
        let mut drawer = lit(&gpu, SIZE);
        drawer.renderer.set_environment(None);
        middle(&picture(&mut drawer, &scene, &ahead()))
    };
    let beside = middle(&drawn(&gpu, &events));
    for (a, b) in plain.into_iter().zip(beside) {
        // A twentieth of the light has spread, most of it to where it came from.
        assert!(a.abs_diff(b) <= 8, "{plain:?} is {beside:?} beside paint");
    }
}
