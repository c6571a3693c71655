//! Synthetic sessions: identical on every machine, of the requested size, and such as a person could have drawn.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use osp_session::recording::{Event, Flush, RonWriter, StrokeId, SynthKind, Tool, synthesize};
use osp_session::scene::Scene;
use xxhash_rust::xxh3::xxh3_64;

use super::events::{STRICT, read};

fn text(kind: SynthKind, polygons: u32, seed: u64) -> Vec<u8> {
    let session = synthesize(kind, polygons, seed);
    let mut bytes = Vec::new();
    let mut writer = RonWriter::new(&mut bytes, "synth", &session.header, Flush::AtEnd).unwrap();
    for event in session {
        writer.write(&event.unwrap()).unwrap();
    }
    drop(writer);
    bytes
}

fn events(kind: SynthKind, polygons: u32, seed: u64) -> Vec<Event> {
    synthesize(kind, polygons, seed).map(|event| event.unwrap()).collect()
}

fn scene(events: &[Event]) -> Scene {
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    for event in events {
        scene.apply(event, &mut changes);
        changes.clear();
    }
    scene
}

struct Drawn {
    tool: Tool,
    width: f32,
    /// Time and position.
    points: Vec<(f64, Vec3)>,
}

/// The strokes in order of their beginnings.
fn strokes(events: &[Event]) -> Vec<Drawn> {
    let mut places = HashMap::new();
    let mut strokes = Vec::new();
    for event in events {
        match event {
            Event::Begin { stroke, tool, width, .. } => {
                assert!(places.insert(*stroke, strokes.len()).is_none(), "a number is used once");
                strokes.push(Drawn { tool: *tool, width: *width, points: Vec::new() });
            }
            Event::Point { t, stroke, p, .. } => strokes[places[stroke]].points.push((*t, *p)),
            _ => {}
        }
    }
    strokes
}

#[test]
fn the_bytes_of_a_seed_are_pinned() {
    let hashes: Vec<String> =
        SynthKind::ALL.iter().map(|&kind| format!("{kind} {:016x}", xxh3_64(&text(kind, 2000, 7)))).collect();
    assert_eq!(
        hashes,
        [
            "portrait 8c35862961818d2e",
            "room 58dffbcc130c0c1a",
            "scribble 1b5d7ec57dcad1e6",
            "brushes 5858ea13edb33b4c",
            "class 6f39c607ea439a35"
        ],
        "a change of these breaks every session that was made by its command: say so in the changelog"
    );
}

#[test]
fn another_seed_gives_another_session() {
    for kind in SynthKind::DRAWN_BY_ARTISTS {
        let (one, two) = (events(kind, 300, 1), events(kind, 300, 2));
        let points =
            |events: &[Event]| strokes(events).into_iter().flat_map(|s| s.points).collect::<Vec<_>>();
        assert_eq!(one, events(kind, 300, 1));
        assert_ne!(points(&one), points(&two), "{kind}");
    }
}

#[test]
fn the_header_names_the_command() {
    let session = synthesize(SynthKind::Room, 1234, 5);
    assert_eq!(session.header.source, "osp synth room --polygons 1234 --seed 5");
    assert_eq!(session.format, "synth");
    for kind in SynthKind::ALL {
        let root = synthesize(kind, 10_000, 1).header.root.unwrap();
        assert_eq!(root.center, Vec3::new(0.0, 1.5, 0.0));
        assert_eq!(root.size, if kind == SynthKind::Room { 16.0 } else { 4.0 });
    }
}

#[test]
fn the_target_is_met_by_the_scene() {
    for kind in SynthKind::DRAWN_BY_ARTISTS {
        for target in [0, 1, 100, 3000, 10_000] {
            let events = events(kind, target, 3);
            let counts = scene(&events).counts();
            let target = u64::from(target);
            assert!(counts.polygons >= target - target / 100, "{kind} {target}: {counts:?}");
            // At most two mirrored strokes of 120 points.
            assert!(counts.polygons <= target + target / 100 + 480, "{kind} {target}: {counts:?}");
            assert_eq!(counts.ignored_events, 0, "{kind} {target}");
            assert_eq!(events.is_empty(), target == 0);
            if let Some(last) = events.last() {
                assert!(
                    matches!(last, Event::End { .. } | Event::Polygon { .. }),
                    "{kind} {target}: {last:?}"
                );
            }
        }
    }
}

#[test]
fn events_are_made_as_they_are_asked_for() {
    for kind in SynthKind::ALL {
        let session = synthesize(kind, u32::MAX, 1);
        assert_eq!(session.take(20_000).filter(|event| event.is_ok()).count(), 20_000);
    }
}

#[test]
fn every_session_reads_back() {
    for kind in SynthKind::ALL {
        let outcome = read(&text(kind, 1500, 11), STRICT);
        assert!(outcome.error.is_none() && outcome.notes.warnings.is_empty(), "{kind}: {:?}", outcome.error);
        assert_eq!(outcome.events, events(kind, 1500, 11));
    }
}

#[test]
fn everything_that_artists_do_happens() {
    for kind in SynthKind::DRAWN_BY_ARTISTS {
        let events = events(kind, 12_000, 1);
        let count = |what: fn(&Event) -> bool| events.iter().filter(|e| what(e)).count();
        assert!(count(|e| matches!(e, Event::Erase { .. })) > 0, "{kind}");
        assert!(count(|e| matches!(e, Event::Undo { .. })) > 0, "{kind}");
        assert!(count(|e| matches!(e, Event::Redo { .. })) > 0, "{kind}");
        assert!(count(|e| matches!(e, Event::Move { .. })) > 0, "{kind}");
        if kind == SynthKind::Room {
            assert!(count(|e| matches!(e, Event::Begin { tool: Tool::Wall, .. })) > 30);
            assert!(count(|e| matches!(e, Event::Polygon { .. })) > 60);
            assert!(count(|e| matches!(e, Event::Place { .. })) > 0);
        }
        let mut open: Vec<StrokeId> = Vec::new();
        let mut most = 0;
        for event in &events {
            match event {
                Event::Begin { stroke, .. } => open.push(*stroke),
                Event::End { stroke, .. } => open.retain(|s| s != stroke),
                Event::Undo { .. } | Event::Erase { .. } => {
                    assert!(open.is_empty(), "not in the middle of a stroke")
                }
                _ => {}
            }
            most = most.max(open.len());
        }
        assert_eq!(most, if kind == SynthKind::Portrait { 2 } else { 1 }, "only the portrait is mirrored");
    }
}

#[test]
fn hands_and_heads_move_like_hands_and_heads() {
    for kind in SynthKind::DRAWN_BY_ARTISTS {
        let events = events(kind, 5000, 2);
        let mut speeds = Vec::new();
        let mut counts = Vec::new();
        for Drawn { tool, width, points } in strokes(&events) {
            if tool == Tool::Wall {
                assert_eq!(points.len(), 4);
                continue;
            }
            assert!((0.005..=0.0401).contains(&width), "{kind}: {width} m wide");
            counts.push(points.len());
            for pair in points.windows(2) {
                let secs = pair[1].0 - pair[0].0;
                assert!((secs - 1.0 / 90.0).abs() < 2e-4, "{kind}: sampled at 90 Hz");
                speeds.push(f64::from((pair[1].1 - pair[0].1).length()) / secs);
            }
            // The motion has no jumps: the change of velocity between samples stays within the ability of an arm.
            for three in points.windows(3) {
                let [a, b, c] = [three[0].1, three[1].1, three[2].1].map(|p: Vec3| p.as_dvec3());
                let acceleration: DVec3 = (a - b * 2.0 + c) * 8100.0;
                assert!(acceleration.length() < 80.0, "{kind}: {} m/s2", acceleration.length());
            }
        }
        speeds.sort_by(f64::total_cmp);
        counts.sort_unstable();
        let (median, fastest) = (speeds[speeds.len() / 2], speeds[speeds.len() - 1]);
        assert!((0.15..1.5).contains(&median) && fastest < 4.0, "{kind}: {median} {fastest} m/s");
        let (low, middle, high) =
            (counts[counts.len() / 20], counts[counts.len() / 2], counts[counts.len() * 19 / 20]);
        assert!(
            low >= 8 && (10..=60).contains(&middle) && high <= 100,
            "{kind}: {low} {middle} {high} points"
        );

        let heads: Vec<(f64, Vec3)> = events
            .iter()
            .filter_map(|e| if let Event::Head { t, p, .. } = e { Some((*t, *p)) } else { None })
            .collect();
        for pair in heads.windows(2) {
            let secs = pair[1].0 - pair[0].0;
            assert!((secs - 1.0 / 30.0).abs() < 2e-4, "{kind}: a head pose 30 times a second");
            let speed = f64::from((pair[1].1 - pair[0].1).length()) / secs;
            assert!(speed < 2.2, "{kind}: the head at {speed} m/s");
        }
        // The head stays at arm's length from the work.
        let mut head = None;
        let mut reach: Vec<f32> = Vec::new();
        for event in &events {
            match event {
                Event::Head { p, .. } => head = Some(*p),
                Event::Point { p, .. } => reach.extend(head.map(|head: Vec3| head.distance(*p))),
                _ => {}
            }
        }
        reach.sort_by(f32::total_cmp);
        let (usual, most) = (reach[reach.len() / 2], reach[reach.len() * 9 / 10]);
        assert!((0.4..0.9).contains(&usual) && most < 1.6, "{kind}: {usual} m, {most} m");
        assert!(events.windows(2).all(|pair| pair[0].time_secs() <= pair[1].time_secs()), "{kind}");
    }
}

#[test]
fn each_subject_is_where_it_should_be() {
    let boxes = |kind, polygons| {
        let scene = scene(&events(kind, polygons, 4));
        scene.visible_ids().map(|id| scene.bounds(id).center()).collect::<Vec<Vec3>>()
    };
    let outside = |centers: &[Vec3]| {
        centers.iter().filter(|c| (**c - Vec3::new(0.0, 1.5, 0.0)).abs().max_element() > 2.0).count()
    };
    let portrait = boxes(SynthKind::Portrait, 10_000);
    assert_eq!(outside(&portrait), 0);
    assert!(portrait.iter().all(|c| c.x.abs() < 0.75 && c.z.abs() < 0.6), "dense: around the bust only");

    let scribble = boxes(SynthKind::Scribble, 20_000);
    assert!(outside(&scribble) * 50 < scribble.len(), "at most a few stick out");
    let mut cells = [false; 27];
    for c in &scribble {
        let cell =
            ((*c - Vec3::new(-2.0, -0.5, -2.0)) / (4.0 / 3.0)).floor().clamp(Vec3::ZERO, Vec3::splat(2.0));
        cells[(cell.x + 3.0 * cell.y + 9.0 * cell.z) as usize] = true;
    }
    assert!(cells.iter().all(|&filled| filled), "{cells:?}");

    let room = boxes(SynthKind::Room, 10_000);
    let floors: std::collections::BTreeSet<(i32, i32)> =
        room.iter().map(|c| ((c.x / 4.0).floor() as i32, (c.z / 4.0).floor() as i32)).collect();
    assert!(floors.len() >= 4, "several rooms: {floors:?}");
    assert!(room.iter().all(|c| c.abs().max_element() < 8.0), "inside the root");
}

#[test]
fn a_card_of_samples_has_a_stroke_of_each_brush_that_is_offered() {
    let offered: Vec<&str> = osp_session::brush::all()
        .iter()
        .filter(|brush| brush.is_offered)
        .map(|brush| brush.name.as_str())
        .collect();
    let events = events(SynthKind::Brushes, 48 * offered.len() as u32, 1);
    let drawn: Vec<String> = events
        .iter()
        .filter_map(|event| match event {
            Event::Begin { paint: Some(paint), .. } => Some(paint.brush.clone()),
            _ => None,
        })
        .collect();
    assert_eq!(drawn, offered);
    let scene = scene(&events);
    assert!(drawn.iter().all(|name| osp_session::brush::find(name).is_some()));
    assert!(scene.strokes().iter().all(|stroke| stroke.brush().is_some()));
    let empty = scene.strokes().iter().filter(|stroke| stroke.polygon_count() == 0).count();
    assert_eq!(empty, 0, "every brush leaves something");
}
