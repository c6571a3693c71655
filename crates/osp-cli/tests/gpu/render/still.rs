//! Brushes at rest, as exported models have them, against the renderer's shaders at time 0.

use std::sync::Arc;

use super::{
    painted,
    scenes::{drawer, gpu, picture, view_from},
};
use glam::{Vec2, Vec3};
use osp::view::View;
use osp_render::{Gpu, Image};
use osp_session::{
    brush::{self, Brush, BrushAtRest, Draw, Family, Outline, Seen, texture},
    recording::Environment,
    scene::Scene,
};
use osp_testkit::events::scene_of;

const SIDE: u32 = 512;
/// Samples of a polygon along each of its sides.
const STEPS: usize = 12;
/// Largest share of samples of which one of the two is bright and the other dark. Rims of textures are some texels apart.
const MOST_DIFFERENT: f32 = 0.12;
/// The same of a texture with fewer texels, which fills the holes of glaring light.
const MOST_DIFFERENT_OF_GLARE: f32 = 0.4;

/// A white ribbon across the picture, 0.6 m wide, that faces the eye.
fn ribbon(brush: &Brush) -> Scene {
    let points = (0..=20).map(|i| Vec3::new(i as f32 * 0.08 - 0.8, 0.0, -1.0));
    scene_of(&painted::stroke(1, &brush.name, (1.0, 1.0, 1.0, 1.0), 0.6, points))
}

fn drawn(gpu: &Arc<Gpu>, scene: &Scene, view: &View) -> Image {
    let mut drawer = drawer(gpu, (SIDE, SIDE));
    let (sky, lights) = ([Vec3::ZERO; 2], Default::default());
    let light = Environment { sky, ambient: Vec3::ONE, lights, reflection: 0.0, ..painted::environment() };
    drawer.renderer.set_environment(Some(&light));
    picture(&mut drawer, scene, view)
}

/// Share of the samples of all polygons that are bright in one way of drawing and dark in the other.
fn difference(brush: &'static Brush, scene: &Scene, image: &Image, view: &View) -> f32 {
    let at_rest = BrushAtRest::of(brush);
    let side = at_rest.side();
    let (mut different, mut count) = (0, 0);
    for id in scene.visible_ids() {
        let (polygon, surface) = (scene.polygon(id), scene.surface(id));
        let corners = polygon.vertices();
        let [a, b, c, d] = [0, 1, 2, corners.len() - 1];
        for (s, t) in (0..STEPS * STEPS).map(|i| (i % STEPS, i / STEPS)) {
            let [s, t] = [s, t].map(|i| (i as f32 + 0.5) / STEPS as f32);
            let weights = [(a, (1.0 - s) * (1.0 - t)), (b, s * (1.0 - t)), (c, s * t), (d, (1.0 - s) * t)];
            let place: Vec3 = weights.iter().map(|&(i, weight)| corners[i] * weight).sum();
            let uv: Vec2 = weights.iter().map(|&(i, weight)| surface.uv(i) * weight).sum();
            let own: f32 = weights.iter().map(|&(i, weight)| surface.alpha(i) * weight).sum();
            let Some(shown) = pixel(image, view, place) else { continue };
            let at = at_rest.uv(uv);
            let texel = [at.x, at.y].map(|x| ((x.rem_euclid(1.0) * side as f32) as usize).min(side - 1));
            let paint = at_rest.paint(Vec3::ONE, own, uv, Seen { view_cosine: 1.0, light: Vec3::ONE });
            let texel = if at_rest.has_texture() { at_rest.texel(texel[0], texel[1]) } else { [1.0; 4] };
            let alpha = match brush.draw {
                Draw::Cutout => f32::from(u8::from(paint[3] * texel[3] >= brush.cutoff)),
                _ => paint[3] * texel[3],
            };
            let exported = (0..3).map(|i| paint[i] * texel[i] * alpha).fold(0.0, f32::max);
            count += 1;
            different += usize::from((exported > 0.8 && shown < 0.3) || (exported < 0.05 && shown > 0.8));
        }
    }
    assert!(count > 1000, "{}: {count} samples", brush.name);
    different as f32 / count as f32
}

/// The brightest channel of the pixel at which a place is seen.
fn pixel(image: &Image, view: &View, place: Vec3) -> Option<f32> {
    let half = (60.0_f32.to_radians() * 0.5).tan();
    let at = view.world_from_view.inverse() * (place - view.eye_in_world);
    let [x, y] = [at.x / (-at.z * half * 4.0 / 3.0), -at.y / (-at.z * half)].map(|x| 0.5 + 0.5 * x);
    let inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
    let [x, y] = [x, y].map(|x| (x * SIDE as f32) as u32);
    inside.then(|| {
        let first = ((y * SIDE + x) * 4) as usize;
        f32::from(image.rgba()[first..first + 3].iter().copied().max().unwrap_or(0)) / 255.0
    })
}

#[test]
fn what_is_exported_is_bright_where_the_renderer_draws_light() {
    let Some(gpu) = gpu() else { return };
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    // A bolt winds: few of its samples lie where they are seen.
    let is_ribbon = |brush: &&Brush| match brush.family {
        Family::QuadStrip(_) => true,
        Family::Welded { shape, .. } => shape != Outline::Bolt,
        _ => false,
    };
    let mut wrong = Vec::new();
    let mut tested = 0;
    for brush in brush::all().iter().filter(|brush| brush.is_offered).filter(is_ribbon) {
        let scene = ribbon(brush);
        let found = difference(brush, &scene, &drawn(&gpu, &scene, &view), &view);
        tested += 1;
        let is_coarse = BrushAtRest::of(brush).side() < texture::SIDE;
        if found > if is_coarse { MOST_DIFFERENT_OF_GLARE } else { MOST_DIFFERENT } {
            wrong.push(format!("{} {found:.3}", brush.name));
        }
    }
    assert!(tested > 20 && wrong.is_empty(), "of {tested}: {wrong:?}");
}
