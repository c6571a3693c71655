//! Strokes that are moved while they are erased or undone reappear at their new position.

use std::{collections::BTreeMap, slice::from_ref};

use super::{play, straight};
use glam::{Quat, Vec3};
use osp::{
    index::{IndexConfig, SpatialIndex},
    occlusion::{OccluderPool, PoolConfig},
    polygon::{Change, ConvexPolygon, PolygonId},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, GroupId, NormalRule, StrokeId, Transform},
    scene::Scene,
};
use osp_testkit::Editor;
use osp_testkit::events::SOLE;

/// Polygons that are copied when they are inserted and when an update reports them, as in GPU memory.
#[derive(Default)]
struct Held(Vec<ConvexPolygon>);

impl Held {
    fn follow(&mut self, scene: &Scene, changes: &[Change]) {
        for change in changes {
            if let Change::Update(id) = *change
                && id.index() < self.0.len()
            {
                self.0[id.index()] = scene.polygon(id);
            }
        }
        let new = self.0.len()..scene.polygon_count();
        self.0.extend(new.map(|i| scene.polygon(PolygonId(i as u32))));
    }

    fn check(&self, scene: &Scene, when: &str) {
        for id in scene.visible_ids() {
            assert_eq!(self.0[id.index()], scene.polygon(id), "{id:?} is held where it was, {when}");
        }
    }
}

#[test]
fn a_stroke_that_was_moved_while_it_was_away_is_told_of_when_it_comes_back() {
    let erase = SOLE.erase(StrokeId(1));
    let moved = SOLE.moved([StrokeId(1)], Vec3::X);
    let group = SOLE.grouped(GroupId(1), [StrokeId(1)], None);
    let to = Transform { p: Vec3::Y, q: Quat::IDENTITY, s: 2.0 };
    let place = SOLE.placed(GroupId(1), to);
    let redo = SOLE.redo();
    // Frames of events; the last one makes the stroke visible at a position where it was never seen.
    let sessions: [&[&[Event]]; 4] = [
        // The stroke is moved before it is erased, in the same frame; the undo reverts only the erasure.
        &[&[moved.clone(), erase.clone()], &[SOLE.undo()]],
        &[
            from_ref(&moved),
            from_ref(&erase),
            &[SOLE.undo(), SOLE.undo(), SOLE.undo()],
            &[redo.clone(), redo.clone()],
        ],
        &[from_ref(&group), &[place, erase.clone()], &[SOLE.undo()]],
        &[from_ref(&moved), &[moved.clone(), erase.clone()], &[SOLE.undo(), SOLE.undo(), SOLE.undo()]],
    ];
    for (number, frames) in sessions.iter().enumerate() {
        let (mut scene, mut held) = (Scene::new(), Held::default());
        let changes = play(&mut scene, &straight(1, 3, NormalRule::LocalX));
        held.follow(&scene, &changes);
        for (frame, events) in frames.iter().enumerate() {
            let mut changes = Vec::new();
            scene.apply_all(*events, &mut changes);
            held.follow(&scene, &changes);
            held.check(&scene, &format!("session {number}, frame {frame}"));
        }
        assert_eq!(scene.counts().visible, 2, "session {number}: it is back");
    }
}

/// Follows a session like the window, and compares with a scene that is built from scratch.
struct Followers {
    scene: Scene,
    index: Box<dyn SpatialIndex>,
    pool: OccluderPool,
    held: Held,
    past: Vec<Event>,
}

impl Followers {
    fn new() -> Self {
        Self {
            scene: Scene::new(),
            index: IndexKind::Osp.create(&IndexConfig::default()),
            pool: OccluderPool::new(PoolConfig::default()),
            held: Held::default(),
            past: Vec::new(),
        }
    }

    fn frame(&mut self, events: Vec<Event>) {
        let mut changes = Vec::new();
        self.scene.free_unreachable();
        self.scene.apply_all(&events, &mut changes);
        for change in &changes {
            let bounds = |id| self.scene.bounds(id);
            match *change {
                Change::Insert(id) => self.index.insert(id, &bounds(id)),
                Change::Remove(id) => self.index.remove(id),
                Change::Update(id) => self.index.update(id, &bounds(id)),
                Change::Repaint(_) | Change::Place(_) => Ok(()),
            }
            .expect("a change that fits the index");
        }
        self.index.commit();
        self.held.follow(&self.scene, &changes);
        self.pool.follow(&self.scene, &changes);
        self.past.extend(events);
    }

    fn check(&self, when: &str) {
        let mut fresh = Scene::new();
        play(&mut fresh, &self.past);
        assert_eq!(self.scene.counts(), fresh.counts(), "{when}");
        let ids: Vec<PolygonId> = fresh.visible_ids().collect();
        assert!(self.scene.visible_ids().eq(ids.iter().copied()), "{when}");
        let mut boxes = BTreeMap::new();
        for &id in &ids {
            assert_eq!(self.scene.polygon(id), fresh.polygon(id), "{id:?}, {when}");
            assert_eq!(self.scene.bounds(id), fresh.bounds(id), "{id:?}, {when}");
            boxes.insert(id, fresh.bounds(id));
        }
        self.held.check(&fresh, when);
        // The index finds every polygon at its position.
        assert_eq!(self.index.len(), ids.len(), "{when}");
        for (id, bounds) in boxes {
            let mut found = Vec::new();
            self.index.box_query(&bounds, &mut found);
            assert!(found.contains(&id), "{id:?} is inserted elsewhere, {when}");
        }
        // Every candidate is in the pool, with its current size.
        let mut anew = OccluderPool::new(PoolConfig::default());
        let all: Vec<Change> = fresh.visible_ids().map(Change::Insert).collect();
        anew.follow(&fresh, &all);
        let hides = |pool: &OccluderPool| {
            let mut ids: Vec<PolygonId> = pool.candidates().flatten().copied().collect();
            ids.sort_unstable();
            ids
        };
        assert_eq!(hides(&self.pool), hides(&anew), "{when}");
    }
}

#[test]
fn whatever_is_edited_everybody_holds_what_a_fresh_scene_has() {
    for seed in 0..25 {
        let mut editor = Editor::new(seed);
        let mut followers = Followers::new();
        followers.frame(editor.start());
        for frame in 0..60 {
            followers.frame(editor.frame());
            if frame % 5 == 4 {
                followers.check(&format!("seed {seed}, frame {frame}"));
            }
        }
    }
}
