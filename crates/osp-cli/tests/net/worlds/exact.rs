//! What a walk sees is, polygon by polygon, what the same sessions in memory show.

use std::time::{Duration, Instant};

use glam::Vec3;
use osp::{polygon::Geometry, view::View};
use osp_net::world::{Flight, Missing, PackOrder};
use osp_session::{
    recording::SynthKind,
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

use super::{
    Together, least_memory, open, pack,
    program::{finished, recording},
    session, temp, walk,
};

const HERE: &[Vec3] = &[Vec3::ZERO];

/// Flights, a camera around everything and one in the middle of it.
fn views(world: &osp::math::Aabb) -> Vec<View> {
    let far_m = world.extent().length() * 0.2;
    let mut views: Vec<View> = Flight::new(world, 1, None, None).step_by(40).take(12).collect();
    views.extend(Flight::new(world, 2, Some(far_m * 0.1), Some(far_m)).take(25));
    for choice in [CameraChoice::Orbit, CameraChoice::Inside] {
        let camera = CameraPath::new(choice, None, world);
        let moment = |frame| Moment { frame, ..Moment::default() };
        views.extend((0..720).step_by(60).map(|frame| camera.view(&moment(frame))));
    }
    views
}

/// Walks through a world in several ways; every frame has to be that of memory, and memory has to be enough.
fn assert_exact(parts: &[(&Scene, &[Vec3])]) {
    let together = Together::new(parts);
    for order in PackOrder::ALL {
        let folder = temp();
        pack(folder.path(), *order, parts).expect("packed");
        let world = open(folder.path());
        assert_eq!(world.bounds, together.bounds());
        let views = views(&world.bounds);
        let expected = together.seen(&views);
        let all = world.manifest.polygon_count();
        assert!(expected.iter().any(|(seen, _)| (1..all).contains(seen)), "some polygons are seen, not all");
        for loaders in [1, 3] {
            let least = least_memory(&world, loaders);
            for memory in [least, 2 * least, 1 << 30] {
                let mut walk = walk(&world, memory, loaders);
                for (i, view) in views.iter().enumerate() {
                    let frame = walk.frame(view, views.get(i + 3), Missing::Wait).expect("whole blocks");
                    let (visible, fingerprint) = expected[i];
                    assert_eq!(
                        (frame.visible, frame.fingerprint),
                        (visible, fingerprint),
                        "{order:?} {memory} {i}"
                    );
                    assert_eq!((frame.missing_blocks, frame.missing_polygons), (0, 0));
                }
                let counts = walk.counts();
                assert!(counts.most_resident_bytes <= memory, "{counts:?} of {memory}");
                let blocks = world.manifest.blocks.len() as u64;
                assert!(memory < 1 << 30 || counts.blocks_read <= blocks, "what is there is not read again");
                let is_too_small = memory == least && blocks > 12;
                assert!(!is_too_small || counts.blocks_read > 2 * blocks, "blocks have to make room");
            }
        }
    }
}

#[test]
fn a_walk_sees_what_sessions_in_memory_show() {
    for (kind, polygons) in [(SynthKind::Portrait, 9_000), (SynthKind::Room, 30_000)] {
        assert_exact(&[(&session(kind, polygons, 5), HERE)]);
    }
    // One leaves the root cube, groups of the other move within groups.
    for name in ["grow", "nested"] {
        assert_exact(&[(&finished(&recording(name)), HERE)]);
    }
}

#[test]
fn brushes_whose_polygons_turn_and_move_about_keep_their_boxes() {
    let brushes = session(SynthKind::Brushes, 9_600, 1);
    let wider =
        brushes.visible_ids().filter(|&id| Geometry::bounds(&brushes, id) != brushes.polygon(id).bounds());
    assert!(wider.count() > 100, "some boxes are not those of the corners");
    assert_exact(&[(&brushes, HERE)]);
}

#[test]
fn several_sessions_and_copies_are_one_world() {
    let (room, scribble) = (session(SynthKind::Room, 5_000, 1), session(SynthKind::Scribble, 700, 2));
    let row: Vec<Vec3> = (0..9).map(|i| Vec3::new(i as f32 * 7.3, 0.0, (i % 3) as f32 * 11.1)).collect();
    assert_exact(&[(&room, &row), (&scribble, &[Vec3::Y * 5.0]), (&room, &[Vec3::splat(-40.0)])]);
}

#[test]
fn the_blocks_hold_the_polygons_and_colours() {
    let room = session(SynthKind::Room, 6_000, 3);
    for order in PackOrder::ALL {
        let folder = temp();
        pack(folder.path(), *order, &[(&room, HERE)]).expect("packed");
        let world = open(folder.path());
        let mut found = Vec::new();
        for number in 0..world.manifest.blocks.len() as u32 {
            found.extend(world.load(number).expect("a block").0.polygons());
        }
        found.sort_by_key(|(id, ..)| *id);
        assert!(found.iter().map(|(id, ..)| *id).eq(room.visible_ids()));
        for (id, polygon, color) in found {
            assert_eq!(polygon, room.polygon(id));
            let (r, g, b, a) = room.stroke_of(id).color();
            assert_eq!(color, [r, g, b, a]);
        }
    }
}

#[test]
fn a_frame_that_does_not_wait_counts_what_is_missing_until_it_is_there() {
    let room = session(SynthKind::Room, 40_000, 4);
    let folder = temp();
    pack(folder.path(), PackOrder::Space, &[(&room, HERE)]).expect("packed");
    let world = open(folder.path());
    let view = CameraPath::new(CameraChoice::Inside, None, &world.bounds).view(&Moment::default());
    let (visible, fingerprint) = Together::new(&[(&room, HERE)]).seen(&[view])[0];
    let mut walk = walk(&world, 1 << 30, 1);
    let first = walk.frame(&view, None, Missing::Count).expect("whole blocks");
    assert!(first.blocks > 3 && first.missing_blocks == first.blocks, "nothing is there at first: {first:?}");
    assert_eq!((first.visible, first.wait_ns), (0, 0));
    let start = Instant::now();
    loop {
        let frame = walk.frame(&view, None, Missing::Count).expect("whole blocks");
        assert!(frame.visible <= visible && visible <= frame.visible + frame.missing_polygons, "{frame:?}");
        if frame.missing_blocks == 0 {
            assert_eq!((frame.visible, frame.fingerprint), (visible, fingerprint));
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "{frame:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_view_that_does_not_fit_keeps_the_nearest_blocks() {
    let room = session(SynthKind::Room, 60_000, 6);
    let folder = temp();
    pack(folder.path(), PackOrder::Space, &[(&room, HERE)]).expect("packed");
    let world = open(folder.path());
    let view = CameraPath::new(CameraChoice::Orbit, None, &world.bounds).view(&Moment::default());
    let memory = least_memory(&world, 1) + (2 << 20);
    let mut walk = walk(&world, memory, 1);
    let (mut read, mut same) = (0, 0);
    let start = Instant::now();
    // Once the nearest are there, nothing is read any more: blocks do not chase each other out.
    while same < 50 {
        let frame = walk.frame(&view, None, Missing::Count).expect("whole blocks");
        assert!(frame.missing_blocks > 0, "not all fits");
        let counts = walk.counts();
        same = if counts.blocks_read == read && read > 0 { same + 1 } else { 0 };
        read = counts.blocks_read;
        assert!(start.elapsed() < Duration::from_secs(60), "{counts:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(walk.counts().most_resident_bytes <= memory);
    assert!(walk.frame(&view, None, Missing::Count).expect("whole blocks").visible > 0);
}
