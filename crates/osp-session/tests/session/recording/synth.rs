//! Synthetic sessions: identical on every machine, of the requested size, and such as a person could have drawn.

use osp_session::recording::{Event, Flush, RonWriter, SynthKind, synthesize};
use osp_session::scene::Scene;
use xxhash_rust::xxh3::xxh3_64;

use super::events::{STRICT, read};

/// The kinds that a simulated artist draws, with a hand, a head and edits.
const DRAWN_BY_ARTISTS: [SynthKind; 3] = [SynthKind::Portrait, SynthKind::Room, SynthKind::Scribble];

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
            "brushes 5858ea13edb33b4c"
        ],
        "a change of these breaks every session that was made by its command: say so in the changelog"
    );
}

#[test]
fn the_target_is_met_by_the_scene() {
    for kind in DRAWN_BY_ARTISTS {
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
fn every_session_reads_back() {
    for kind in SynthKind::ALL {
        let outcome = read(&text(kind, 1500, 11), STRICT);
        assert!(outcome.error.is_none() && outcome.notes.warnings.is_empty(), "{kind}: {:?}", outcome.error);
        assert_eq!(outcome.events, events(kind, 1500, 11));
    }
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
