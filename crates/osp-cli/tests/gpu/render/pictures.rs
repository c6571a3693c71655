use std::sync::Arc;

use super::scenes::{
    all_ids, apply, drawer, gpu, picture, picture_of, pixel, read_png, set, sketch, square, view_from,
    winding_stroke,
};
use glam::Vec3;
use osp::{polygon::PolygonId, view::View};
use osp_render::{Gpu, Image, Layer, Offscreen, RenderError, RendererConfig, Style};
use osp_session::{
    recording::{Event, StrokeId},
    scene::Scene,
};
use osp_testkit::events::SOLE;

const SIZE: (u32, u32) = (320, 240);

fn fresh_picture(gpu: &Arc<Gpu>, scene: &Scene, view: &View) -> Image {
    picture(&mut drawer(gpu, SIZE), scene, view)
}

fn middle(image: &Image) -> [u8; 4] {
    pixel(image, SIZE.0 / 2, SIZE.1 / 2)
}

fn eyes() -> Vec<View> {
    let target = Vec3::new(0.0, 0.6, 0.0);
    let eyes = [(1.6, 0.9, 1.2), (-0.5, 0.7, 0.1), (0.0, 3.0, 0.0), (0.2, 0.4, -2.0), (9.0, 3.0, 8.0)];
    eyes.into_iter().map(|(x, y, z)| view_from(Vec3::new(x, y, z), target)).collect()
}

#[test]
fn a_scene_that_grew_moved_and_shrank_looks_like_one_made_at_once() {
    let Some(gpu) = gpu() else { return };
    let view = eyes()[0];
    let mut scene = Scene::new();
    let mut growing = drawer(&gpu, SIZE);
    let mut steps: Vec<Vec<Event>> = sketch().chunks(97).map(<[Event]>::to_vec).collect();
    let moved =
        |strokes: &[u32], by| SOLE.moved(strokes.iter().map(|&n| StrokeId(n)).collect::<Vec<_>>(), by);
    steps.push(vec![moved(&[2, 9, 15], Vec3::new(0.3, 0.1, 0.0)), moved(&[9], Vec3::Y * 0.2)]);
    steps.push(vec![SOLE.erase(StrokeId(4)), SOLE.erase(StrokeId(15))]);
    steps.push(vec![SOLE.undo(); 3]);
    steps.push(vec![SOLE.redo()]);
    steps.push(winding_stroke(100, osp_session::recording::Tool::Tube, 30, (1.0, 0.2, 0.2, 1.0)));
    for (number, events) in steps.iter().enumerate() {
        let changes = apply(&mut scene, events);
        growing.renderer.follow(&changes);
        // Some frames are not drawn; what changed in them must not be forgotten.
        if number % 3 == 2 || number + 6 > steps.len() {
            let ids = all_ids(&scene);
            let grown = picture_of(&mut growing, &scene, &view, &ids);
            let at_once = fresh_picture(&gpu, &scene, &view);
            assert_eq!(grown.differing_pixels(&at_once), 0, "after step {number}");
        }
    }
}

#[test]
fn a_polygon_is_sent_once_and_again_only_when_it_moves() {
    let Some(gpu) = gpu() else { return };
    let view = eyes()[0];
    let mut scene = Scene::new();
    let mut drawer = drawer(&gpu, SIZE);
    let mut draw = |scene: &Scene, changes: &[osp::polygon::Change]| {
        drawer.renderer.follow(changes);
        drawer.draw(scene, &view, &[Layer::plain(&set(&all_ids(scene)))]).expect("a frame").polygon_bytes
    };
    let changes = apply(&mut scene, &sketch());
    assert_eq!(draw(&scene, &changes), scene.polygon_count() as u64 * 96, "all of them once");
    assert_eq!(draw(&scene, &[]), 0, "a frame in which nothing comes sends no polygon");

    let before = scene.polygon_count();
    let changes = apply(
        &mut scene,
        &winding_stroke(50, osp_session::recording::Tool::Ribbon, 20, (1.0, 1.0, 1.0, 1.0)),
    );
    let came = (scene.polygon_count() - before) as u64;
    assert!(came > 10);
    assert_eq!(draw(&scene, &changes), came * 96, "only the new ones");

    let changes = apply(&mut scene, &[SOLE.undo(), SOLE.redo()]);
    assert_eq!(draw(&scene, &changes), 0, "taken away and brought back: still there");

    let changes = apply(&mut scene, &[SOLE.moved([StrokeId(50)], Vec3::new(0.1, 0.0, 0.0))]);
    assert_eq!(draw(&scene, &changes), came * 96, "what has moved");
}

#[test]
fn small_chunks_and_many_pages_give_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    apply(&mut scene, &sketch());
    // Opaque scenes only: transparent ones are sorted over all pages, which the other tests see.
    let config = RendererConfig { chunk_len: 100, draw_len: 30, ..RendererConfig::default() };
    let mut paged = Offscreen::on(Arc::clone(&gpu), SIZE.0, SIZE.1, &config).expect("a drawer");
    let mut whole = drawer(&gpu, SIZE);
    for view in eyes() {
        let ids = all_ids(&scene);
        let one = picture_of(&mut paged, &scene, &view, &ids);
        assert_eq!(one.differing_pixels(&picture_of(&mut whole, &scene, &view, &ids)), 0);
    }
    let times = paged.draw(&scene, &eyes()[0], &[Layer::plain(&set(&all_ids(&scene)))]).expect("a frame");
    assert!(times.draw_calls > 4, "several pages: {} draw calls", times.draw_calls);
}

#[test]
fn nearer_polygons_hide_farther_ones_whatever_came_first() {
    let Some(gpu) = gpu() else { return };
    let (red, green) = ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0));
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    for order in [[(red, -2.0), (green, -3.0)], [(green, -3.0), (red, -2.0)]] {
        let mut scene = Scene::new();
        apply(&mut scene, &order.map(|(color, z)| square(Vec3::Z * z, 1.0, color)));
        let [r, g, b, a] = middle(&fresh_picture(&gpu, &scene, &view));
        assert!(r > 150 && g < 10 && b < 10 && a == 255, "{r} {g} {b} {a}");
    }
}

#[test]
fn what_lies_behind_a_transparent_polygon_shines_through() {
    let Some(gpu) = gpu() else { return };
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    let mut scene = Scene::new();
    let glass = |z: f32, color: (f32, f32, f32)| square(Vec3::Z * z, 1.0, (color.0, color.1, color.2, 0.5));
    // The near pane comes first: it must be drawn last.
    apply(
        &mut scene,
        &[
            glass(-1.0, (1.0, 0.0, 0.0)),
            glass(-2.0, (0.0, 1.0, 0.0)),
            square(Vec3::Z * -3.0, 2.0, (0.0, 0.0, 1.0, 1.0)),
        ],
    );
    let [r, g, b, _] = middle(&fresh_picture(&gpu, &scene, &view));
    assert!(r > g && g > 40 && b > 40, "red over green over blue: {r} {g} {b}");
    assert!(b.abs_diff(g) < 25, "half of a half each: {g} {b}");
}

#[test]
fn both_sides_are_drawn_and_slopes_differ() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    apply(&mut scene, &[square(Vec3::ZERO, 1.0, (0.8, 0.8, 0.8, 1.0))]);
    let from = |eye| middle(&fresh_picture(&gpu, &scene, &view_from(eye, Vec3::ZERO)))[0];
    let (front, back, aslant) = (from(Vec3::Z * 2.0), from(Vec3::Z * -2.0), from(Vec3::new(1.9, -0.3, 0.5)));
    assert!(front > 100 && back > 80, "front {front}, back {back}");
    assert!(front > aslant + 10, "front {front}, aslant {aslant}");
}

#[test]
fn far_from_the_origin_and_at_any_scale_the_picture_stays() {
    let Some(gpu) = gpu() else { return };
    let base = {
        let mut scene = Scene::new();
        apply(&mut scene, &[square(Vec3::ZERO, 1.0, (0.9, 0.5, 0.1, 1.0))]);
        fresh_picture(&gpu, &scene, &view_from(Vec3::Z * 4.0, Vec3::ZERO))
    };
    // Powers of two, so that the corners stay exact.
    for (offset, scale) in [(Vec3::splat(8192.0), 1.0), (Vec3::ZERO, 1024.0), (Vec3::ZERO, 1.0 / 1024.0)] {
        let mut scene = Scene::new();
        apply(&mut scene, &[square(offset, scale, (0.9, 0.5, 0.1, 1.0))]);
        let mut view = view_from(offset + Vec3::Z * 4.0 * scale, offset);
        view.projection.near_m *= scale;
        view.projection.far_m *= scale;
        let image = fresh_picture(&gpu, &scene, &view);
        assert_eq!(image.differing_pixels(&base), 0, "offset {offset}, scale {scale}");
    }
}

#[test]
fn a_style_tints_and_a_faint_one_lets_through() {
    let Some(gpu) = gpu() else { return };
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    let mut scene = Scene::new();
    let white = (1.0, 1.0, 1.0, 1.0);
    apply(&mut scene, &[square(Vec3::Z * -2.0, 1.0, white), square(Vec3::Z * -3.0, 1.0, white)]);
    let mut drawer = drawer(&gpu, SIZE);
    let blue = Style { tint: [0.0, 0.0, 1.0], amount: 1.0, ..Style::PLAIN };
    let mut colour_of = |layers: &[Layer<'_>]| {
        drawer.draw(&scene, &view, layers).expect("a frame");
        middle(&drawer.image().expect("a picture"))
    };
    let (near, far) = ([PolygonId(0)], [PolygonId(1)]);
    let [r, g, b, _] = colour_of(&[Layer::plain(&set(&far)), Layer { polygons: &set(&near), style: blue }]);
    assert!(r < 10 && g < 10 && b > 150, "{r} {g} {b}");
    let faint = Style { opacity: 0.5, ..blue };
    let [r, _, b, _] = colour_of(&[Layer::plain(&set(&far)), Layer { polygons: &set(&near), style: faint }]);
    assert!(r > 60 && b > r, "{r} {b}");
}

#[test]
fn an_empty_scene_and_a_list_of_nothing_are_a_plain_background() {
    let Some(gpu) = gpu() else { return };
    let mut drawer = drawer(&gpu, SIZE);
    let image = picture_of(&mut drawer, &Scene::new(), &eyes()[0], &[]);
    assert_eq!(image.drawn_pixels(), 0);
    assert_eq!((image.width(), image.height()), SIZE);
    // Numbers that the scene does not have.
    let image = picture_of(&mut drawer, &Scene::new(), &eyes()[0], &[PolygonId(7)]);
    assert_eq!(image.drawn_pixels(), 0);
}

#[test]
fn impossible_sizes_are_refused() {
    let Some(gpu) = gpu() else { return };
    for (width, height) in [(0, 10), (10, 0), (1 << 20, 10)] {
        let refused = Offscreen::on(Arc::clone(&gpu), width, height, &RendererConfig::default());
        assert!(matches!(refused, Err(RenderError::Size { .. })), "{width}x{height}");
    }
    gpu.check().expect("the device is as good as before");
}

#[test]
fn a_picture_is_written_and_times_are_taken() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    apply(&mut scene, &sketch());
    let mut drawer = drawer(&gpu, SIZE);
    let times = drawer.draw(&scene, &eyes()[0], &[Layer::plain(&set(&all_ids(&scene)))]).expect("a frame");
    assert!(times.draw.ns > 0 && times.prepare.ns > 0);
    eprintln!("{}: {times:?}", gpu.name());
    let image = drawer.image().expect("a picture");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sketch.png");
    image.write_png(&path).expect("a file");
    assert_eq!(read_png(&path).2, image.rgba());
    let error = image.write_png(&folder.path().join("no/such/folder.png")).expect_err("no folder");
    assert!(error.to_string().contains("folder.png"), "{error}");
}
