//! The order of opaque polygons: the same picture, another cost.

use super::scenes::{all_ids, drawer, gpu, set, sketch, square, view_from};
use crate::OSP;
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

#[test]
fn calls_and_changes_of_state_are_counted() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&sketch());
    let ids = set(&all_ids(&scene));
    let view = view_from(Vec3::new(1.6, 0.9, 1.2), Vec3::new(0.0, 0.6, 0.0));
    let mut drawer = drawer(&gpu, SIZE);
    let mut count = |order| {
        drawer.set_opaque_order(order, false);
        drawer.draw(&scene, &view, &[Layer::plain(&ids)]).expect("a frame");
        drawer.order_counts(&scene)
    };
    let usual = count(OpaqueOrder::None);
    // One call for what is opaque and one for what is transparent; no brush has painted anything.
    assert_eq!((usual.draw_calls, usual.pipelines, usual.material_runs), (2, 2, 1));
    let twice = count(OpaqueOrder::ZPrepass);
    assert_eq!((twice.draw_calls, twice.pipelines, twice.material_runs), (3, 3, 1));
}

#[test]
fn the_command_measures_all_orders_in_turns() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("room.png");
    let picture = picture.to_str().expect("utf-8");
    let args = ["render", "recordings/room.ron", picture, "--size", "321x241", "--repeats", "1", "--order"];
    let report = OSP.json([&args[..], &["all", "--json"]].concat());
    let orders = report["orders"].as_array().expect("orders");
    let of = |name: &str| orders.iter().find(|row| row["order"] == name).expect("an order");
    let overdraw = |name: &str| of(name)["overdraw"].as_f64().expect("a number");
    assert_eq!(orders.len(), 5);
    // The least is one, but for what lies at the very same depth.
    assert!(overdraw("z-prepass") >= 1.0 && overdraw("z-prepass") < 1.1, "{report}");
    assert!(overdraw("front-to-back") < overdraw("none"), "{report}");
    assert!(overdraw("none") < overdraw("back-to-front"), "{report}");
    for row in orders {
        assert!(row["draw_ms"].as_f64() > Some(0.0), "{row}");
        assert_eq!(row["samples_covered"], of("none")["samples_covered"], "{row}");
    }
    assert_eq!(of("z-prepass")["differing_pixels"], 0);
    let table = OSP.done([&args[..], &["material,none"]].concat());
    assert!(
        table.contains("overdraw") && table.contains("material") && !table.contains("z-prepass"),
        "{table}"
    );
    for wrong in [&["none,none"][..], &["sideways"], &["none", "--occlusion", "hzb"], &["none", "--check"]] {
        OSP.refused([&args[..], wrong].concat());
    }
}
