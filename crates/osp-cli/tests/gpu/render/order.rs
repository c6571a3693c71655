//! The order of opaque polygons: the same picture, another cost.

use super::scenes::{all_ids, drawer, gpu, set, sketch, square, view_from};
use glam::Vec3;
use osp_render::{Layer, OpaqueOrder, Overdraw};
use osp_session::recording::Event;
use osp_testkit::events::scene_of;

const SIZE: (u32, u32) = (320, 240);

#[test]
fn every_order_of_opaque_polygons_gives_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    // With transparent strokes among them, which keep their own order.
    let scene = scene_of(&sketch());
    let ids = set(&all_ids(&scene));
    for eye in [Vec3::new(1.6, 0.9, 1.2), Vec3::new(-0.5, 0.7, 0.1), Vec3::new(0.0, 3.0, 0.1)] {
        let view = view_from(eye, Vec3::new(0.0, 0.6, 0.0));
        let mut drawer = drawer(&gpu, SIZE);
        let mut picture = |order, splits| {
            drawer.set_opaque_order(order, splits);
            drawer.draw(&scene, &view, &[Layer::plain(&ids)]).expect("a frame");
            drawer.image().expect("a picture")
        };
        let usual = picture(OpaqueOrder::None, false);
        assert!(usual.drawn_pixels() > 1000);
        for order in OpaqueOrder::ALL {
            for splits in [false, true] {
                let differing = picture(order, splits).differing_pixels(&usual);
                assert_eq!(differing, 0, "{}, {splits}, from {eye}", order.name());
            }
        }
    }
}

#[test]
fn overdraw_is_what_the_order_makes_it() {
    let Some(gpu) = gpu() else { return };
    // Five squares one behind the other, the farthest first, that look equally large.
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    let events: Vec<Event> = (1..=5u8)
        .rev()
        .map(|i| square(Vec3::NEG_Z * f32::from(i), 0.25 * f32::from(i), (0.2 * f32::from(i), 0.5, 0.5, 1.0)))
        .collect();
    let scene = scene_of(&events);
    let ids = set(&all_ids(&scene));
    let mut drawer = drawer(&gpu, SIZE);
    let mut count = |order| {
        drawer.set_opaque_order(order, false);
        drawer.draw(&scene, &view, &[Layer::plain(&ids)]).expect("a frame");
        let picture = drawer.image().expect("a picture");
        let overdraw = drawer.count_overdraw().expect("counts");
        let differing = drawer.image().expect("a picture").differing_pixels(&picture);
        assert_eq!(differing, 0, "counting leaves the picture");
        overdraw
    };
    let Overdraw { shaded, covered } = count(OpaqueOrder::None);
    assert!(covered > 10_000, "{covered}");
    assert_eq!(shaded, covered * 5, "by number the nearest comes last");
    assert_eq!(count(OpaqueOrder::BackToFront), Overdraw { shaded, covered });
    for order in [OpaqueOrder::FrontToBack, OpaqueOrder::ZPrepass] {
        assert_eq!(count(order), Overdraw { shaded: covered, covered }, "{}", order.name());
    }
    assert_eq!(Overdraw::default().factor().to_bits(), 0.0f64.to_bits());
}
