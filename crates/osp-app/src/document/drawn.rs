use osp::{math::Aabb, polygon::Change};
use osp_session::{
    export::PolygonTimes,
    recording::{Event, Tally},
    scene::Scene,
};

/// What the events of a session have made so far.
#[derive(Debug)]
pub(crate) struct Drawn {
    pub(super) scene: Scene,
    /// Since they were last taken.
    pub(super) changes: Vec<Change>,
    /// Box of everything that was ever drawn.
    pub(super) bounds: Aabb,
    pub(super) times: PolygonTimes,
    /// The number after the largest that a stroke without an author has.
    pub(super) next_stroke: u32,
    pub(super) last_secs: f64,
    pub(super) events: u64,
    /// What a reader of the session's file will count.
    pub(super) tally: Tally,
}

impl Default for Drawn {
    fn default() -> Self {
        Self {
            scene: Scene::keeping_groups_whole(),
            changes: Vec::new(),
            bounds: Aabb::EMPTY,
            times: PolygonTimes::default(),
            next_stroke: 0,
            last_secs: 0.0,
            events: 0,
            tally: Tally::default(),
        }
    }
}

impl Drawn {
    /// The model.
    #[cfg(feature = "live")]
    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Applies events to the model.
    pub(super) fn apply(&mut self, events: &[Event]) {
        for event in events {
            self.last_secs = self.last_secs.max(event.time_secs());
            if let Event::Begin { stroke, author, .. } | Event::Polygon { stroke: Some(stroke), author, .. } =
                event
                && author.is_sole()
            {
                self.next_stroke = self.next_stroke.max(stroke.0.saturating_add(1));
            }
        }
        self.events += events.len() as u64;
        events.iter().for_each(|event| self.tally.add(event));
        let first = self.changes.len();
        self.scene.apply_all(events, &mut self.changes);
        self.times.note(events, &self.scene);
        for &change in &self.changes[first..] {
            self.bounds = self.bounds.union(&self.scene.bounds_of_change(change));
        }
    }

    /// Applies events of a file. The window inserts the whole model when it opens a session, so the changes on the way are
    /// dropped.
    pub(super) fn apply_read(&mut self, events: &[Event]) {
        self.apply(events);
        self.changes.clear();
        self.scene.let_go();
    }
}
