//! Shadows of the first light: who throws them, and that they do not depend on what is culled.

use std::sync::Arc;

use super::{
    painted,
    scenes::{all_ids, apply, drawer, gpu, picture_of, pixel, view_from},
};
use glam::Vec3;
use osp::{polygon::PolygonId, view::View};
use osp_render::{Gpu, Image, Offscreen};
use osp_session::{
    recording::{Author, Environment, Event, StrokeId},
    scene::Scene,
};

const SIZE: (u32, u32) = (160, 120);

/// A first light that travels forwards and down, none else but a little of everywhere.
fn environment() -> Environment {
    let lights = [(Vec3::new(0.0, -1.0, -1.0).normalize(), Vec3::ONE), Default::default()];
    let (sky, ambient) = ([Vec3::ZERO; 2], Vec3::splat(0.2));
    Environment { sky, ambient, lights, reflection: 0.0, ..painted::environment() }
}

/// A stroke across the picture, half a metre wide, that faces +z.
fn across(number: u32, brush: &str, middle: Vec3) -> Vec<Event> {
    let points = (0..=20).map(|i| middle + Vec3::X * (i as f32 * 0.1 - 1.0));
    painted::stroke(number, brush, (0.8, 0.8, 0.8, 1.0), 0.5, points)
}

/// In the middle of the picture; what throws a shadow on it is above and behind the eye.
const SEEN: Vec3 = Vec3::new(0.0, 0.0, -1.0);
const ABOVE: Vec3 = Vec3::new(0.0, 2.0, 1.0);

fn view() -> View {
    view_from(Vec3::ZERO, Vec3::NEG_Z)
}

fn lit(gpu: &Arc<Gpu>) -> Offscreen {
    let mut drawer = drawer(gpu, SIZE);
    drawer.renderer.set_environment(Some(&environment()));
    drawer
}

fn drawn(drawer: &mut Offscreen, scene: &Scene, ids: &[PolygonId]) -> Image {
    picture_of(drawer, scene, &view(), ids)
}

fn brightness(image: &Image) -> u8 {
    let [red] = pixel(image, SIZE.0 / 2, SIZE.1 / 2);
    red
}

#[test]
fn what_answers_to_light_throws_a_shadow_on_what_answers_to_light() {
    let Some(gpu) = gpu() else { return };
    let with = |seen: &str, above: Option<&str>| {
        let mut scene = Scene::new();
        apply(&mut scene, &across(1, seen, SEEN));
        if let Some(brush) = above {
            apply(&mut scene, &across(2, brush, ABOVE));
        }
        let ids = all_ids(&scene);
        brightness(&drawn(&mut lit(&gpu), &scene, &ids))
    };
    let lit = with("Flat", None);
    let shaded = with("Flat", Some("Flat"));
    // Ambient light alone: 0.8 x 0.2.
    assert!((38..=44).contains(&shaded) && lit > shaded + 60, "{lit} became {shaded}");
    assert_eq!(with("Flat", Some("Wire")), lit, "unlit paint throws none");
    assert_eq!(with("Flat", Some("Light")), lit, "light throws none");
    assert_eq!(with("Flat", Some("Toon")), shaded, "of unlit paint, Toon alone throws one");
    assert_eq!(with("DoubleTaperedMarker", Some("Flat")), with("DoubleTaperedMarker", None), "it is unlit");
}

#[test]
fn what_is_culled_throws_its_shadow_all_the_same() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    apply(&mut scene, &across(1, "Flat", SEEN));
    let in_view = all_ids(&scene);
    apply(&mut scene, &across(2, "Flat", ABOVE));
    let every = drawn(&mut lit(&gpu), &scene, &all_ids(&scene));
    let culled = drawn(&mut lit(&gpu), &scene, &in_view);
    assert!(brightness(&every) < 50);
    assert_eq!(every.differing_pixels(&culled), 0);
}

#[test]
fn a_shadow_comes_and_goes_with_its_stroke() {
    let Some(gpu) = gpu() else { return };
    let mut drawer = lit(&gpu);
    let mut scene = Scene::new();
    let mut step = |events: &[Event]| {
        let changes = apply(&mut scene, events);
        drawer.renderer.follow(&changes);
        let ids = all_ids(&scene);
        brightness(&drawn(&mut drawer, &scene, &ids))
    };
    let lit = step(&across(1, "Flat", SEEN));
    assert!(step(&across(2, "Flat", ABOVE)) < 50);
    assert_eq!(step(&[Event::Erase { author: Author::SOLE, t: 0.0, stroke: StrokeId(2) }]), lit);
    assert!(step(&[Event::Undo { author: Author::SOLE, t: 0.0 }]) < 50);
}
