//! Strokes that are moved while they are erased or undone reappear at their new position.

use std::collections::BTreeMap;

use super::play;
use osp::{
    index::{IndexConfig, SpatialIndex},
    occlusion::{OccluderPool, PoolConfig},
    polygon::{Change, ConvexPolygon, PolygonId},
};
use osp_rivals::IndexKind;
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::Editor;

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
