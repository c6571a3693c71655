//! The changes that a batch of events reports about polygons that several of its samples change.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};
use osp::polygon::{Change, ConvexPolygon, PolygonId};
use osp_session::{
    brush,
    recording::{Event, Paint},
    scene::Scene,
};

use super::{begin, end, point};
use osp_session::recording::{NormalRule, Tool};

const SAMPLES: u32 = 160;

fn painted(brush: &str) -> Vec<Event> {
    let mut first = begin(1, Tool::Ribbon, NormalRule::Travel);
    if let Event::Begin { paint, .. } = &mut first {
        *paint = Some(Box::new(Paint::new(brush, 3)));
    }
    let bend = |i: u32| Vec3::new(i as f32 * 0.2, (i as f32 * 0.3).sin(), (i as f32 * 0.1).cos());
    let mut events = vec![first];
    events.extend((0..SAMPLES).map(|i| point(1, bend(i), Quat::IDENTITY)));
    events.push(end(1));
    events
}

/// Follows batches like an index, with the polygons' state at the end of each batch.
fn follow(events: &[Event], batch: usize) -> (Scene, BTreeMap<PolygonId, ConvexPolygon>, usize) {
    let (mut scene, mut known, mut told) = (Scene::new(), BTreeMap::new(), 0);
    for events in events.chunks(batch) {
        let mut changes = Vec::new();
        scene.apply_all(events, &mut changes);
        // Textures that are stretched over a stroke are repainted once per batch while the stroke grows.
        told += changes.iter().filter(|change| !matches!(change, Change::Repaint(_))).count();
        for change in changes {
            match change {
                Change::Insert(id) => {
                    assert!(known.insert(id, scene.polygon(id)).is_none(), "{id:?} came twice");
                }
                Change::Update(id) => {
                    assert!(known.insert(id, scene.polygon(id)).is_some(), "{id:?} is not there");
                }
                Change::Remove(id) => {
                    known.remove(&id).expect("it was there");
                }
                Change::Repaint(id) => assert!(known.contains_key(&id), "{id:?} is not there"),
                Change::Place(space) => panic!("{space:?}: this scene tells of each polygon"),
            }
        }
    }
    (scene, known, told)
}

#[test]
fn every_brush_is_followed_in_batches() {
    for brush in brush::all() {
        let events = painted(&brush.name);
        for batch in [7, 64] {
            let (scene, known, _) = follow(&events, batch);
            for (id, polygon) in known {
                assert_eq!(scene.polygon(id), polygon, "{} in batches of {batch}", brush.name);
            }
        }
    }
}
