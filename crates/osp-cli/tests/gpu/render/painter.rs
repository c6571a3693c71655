//! The painter's algorithm against the depth buffer.

use std::sync::Arc;

use super::scenes::{all_ids, drawer, gpu, set, sketch, square, view_from};
use glam::Vec3;
use osp::{polygon::VisibleBlocks, view::View};
use osp_render::{Gpu, Image, Layer, Offscreen, PaintList, Painter};
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::events::scene_of;

const SIZE: (u32, u32) = (321, 241);

fn polygon(vertices: [[f32; 3]; 3], color: (f32, f32, f32, f32)) -> Event {
    osp_testkit::events::polygon(None, vertices.map(Vec3::from), color)
}

/// A large square that passes through two others, and three long triangles each of which lies over the next.
fn knot() -> Vec<Event> {
    let red = (0.9, 0.2, 0.1, 1.0);
    let green = (0.1, 0.8, 0.2, 1.0);
    let blue = (0.2, 0.3, 0.9, 1.0);
    let mut events = vec![
        square(Vec3::new(0.0, 0.0, 0.0), 0.8, (0.8, 0.8, 0.7, 1.0)),
        polygon([[-0.5, -0.3, 0.6], [0.6, -0.2, -0.7], [0.1, 0.7, 0.1]], (0.9, 0.7, 0.1, 1.0)),
    ];
    // Round in a circle: no one of them is behind both others.
    events.push(polygon([[-0.9, -0.6, 1.0], [0.9, -0.5, 1.2], [0.9, -0.7, 1.2]], red));
    events.push(polygon([[0.7, -0.9, 1.0], [0.0, 0.8, 1.2], [0.2, 0.8, 1.2]], green));
    events.push(polygon([[0.2, 0.9, 1.0], [-0.8, -0.9, 1.2], [-0.9, -0.7, 1.2]], blue));
    events
}

fn solid(gpu: &Arc<Gpu>) -> Offscreen {
    let mut drawer = drawer(gpu, SIZE);
    drawer.renderer.set_solid(true);
    drawer
}

fn by_depth(gpu: &Arc<Gpu>, scene: &Scene, view: &View, ids: &VisibleBlocks) -> Image {
    let mut drawer = solid(gpu);
    drawer.draw(scene, view, &[Layer::plain(ids)]).expect("a frame");
    drawer.image().expect("a picture")
}

fn by_painter(gpu: &Arc<Gpu>, painter: Painter, scene: &Scene, view: &View, ids: &VisibleBlocks) -> Image {
    let list = PaintList::new(painter, scene, ids, view.eye_in_world).expect("an order");
    let mut drawer = solid(gpu);
    drawer.draw_parts(scene, view, &list).expect("a frame");
    drawer.image().expect("a picture")
}

fn eyes() -> [View; 4] {
    [(0.1, 0.2, 2.5), (1.9, 0.7, 1.2), (-0.6, 1.7, -1.9), (0.3, 0.1, 0.4)]
        .map(|(x, y, z)| view_from(Vec3::new(x, y, z), Vec3::new(0.0, 0.1, 0.0)))
}

#[test]
fn the_painter_with_a_tree_draws_what_the_depth_buffer_draws() {
    let Some(gpu) = gpu() else { return };
    for events in [knot(), sketch()] {
        let scene = scene_of(&events);
        let ids = set(&all_ids(&scene));
        for view in eyes() {
            let right = by_depth(&gpu, &scene, &view, &ids);
            assert!(right.drawn_pixels() > 500, "{}", right.drawn_pixels());
            let painted = by_painter(&gpu, Painter::Bsp, &scene, &view, &ids);
            let unexplained = painted.unlike_pixels(&right);
            let at = view.eye_in_world;
            assert!(unexplained <= 12, "{unexplained} pixels from {at}");
            let differing = painted.differing_pixels(&right);
            assert!(differing * 500 < right.rgba().len() / 4, "{differing} pixels from {at}");
        }
    }
}

#[test]
fn the_painter_without_a_tree_is_wrong_where_polygons_have_no_order() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&knot());
    let ids = set(&all_ids(&scene));
    let view = eyes()[0];
    let right = by_depth(&gpu, &scene, &view, &ids);
    let wrong = by_painter(&gpu, Painter::Centre, &scene, &view, &ids);
    assert!(wrong.unlike_pixels(&right) > 300, "{}", wrong.unlike_pixels(&right));
    // Where they have one, it is right.
    let rows: Vec<Event> = (0..9u8)
        .map(|i| {
            let part = f32::from(i) / 9.0;
            square(Vec3::new(part - 0.5, 0.0, part - 1.0), 0.3, (part, 1.0 - part, 0.5, 1.0))
        })
        .collect();
    let scene = scene_of(&rows);
    let ids = set(&all_ids(&scene));
    let right = by_depth(&gpu, &scene, &view, &ids);
    assert_eq!(by_painter(&gpu, Painter::Centre, &scene, &view, &ids).differing_pixels(&right), 0);
}

#[test]
fn coplanar_polygons_are_drawn_by_number_and_nothing_is_drawn_of_nothing() {
    let Some(gpu) = gpu() else { return };
    let events = [
        square(Vec3::ZERO, 0.5, (1.0, 0.0, 0.0, 1.0)),
        square(Vec3::new(0.2, 0.1, 0.0), 0.5, (0.0, 1.0, 0.0, 1.0)),
        square(Vec3::new(0.1, 0.3, 0.0), 0.2, (0.0, 0.0, 1.0, 1.0)),
    ];
    let scene = scene_of(&events);
    let ids = set(&all_ids(&scene));
    // Straight on, so that all of them lie at one depth to the last bit.
    for z in [2.0, -1.5] {
        let view = view_from(Vec3::Z * z, Vec3::ZERO);
        let right = by_depth(&gpu, &scene, &view, &ids);
        for painter in Painter::ALL {
            let none = by_painter(&gpu, painter, &scene, &view, &VisibleBlocks::default());
            assert_eq!(none.drawn_pixels(), 0);
        }
        let painted = by_painter(&gpu, Painter::Bsp, &scene, &view, &ids);
        assert_eq!(painted.differing_pixels(&right), 0, "from {z}");
    }
}
