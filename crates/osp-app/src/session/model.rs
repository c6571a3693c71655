use osp::{math::Aabb, polygon::Change};
use osp_session::{
    export::PolygonTimes,
    recording::{Event, StrokeId, Tally},
    scene::Scene,
};

/// Events that the model takes at once.
pub(super) const PIECE: usize = 1024;

/// What the events of a session have made so far. A replay leaves the counts alone: it plays frames, to and fro.
#[derive(Debug)]
pub(super) struct Model {
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

impl Default for Model {
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

impl Model {
    /// A stroke number up to `last` that was not used yet; `last` is a power of two less one.
    pub(super) fn new_stroke(&mut self, last: u32) -> StrokeId {
        self.next_stroke &= last;
        // A session may have used the last number that there is: then those that it left out are next.
        for _ in 0..last {
            if !self.scene.is_used(StrokeId(self.next_stroke)) {
                break;
            }
            self.next_stroke = self.next_stroke.wrapping_add(1) & last;
        }
        let id = StrokeId(self.next_stroke);
        self.next_stroke = self.next_stroke.wrapping_add(1) & last;
        id
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
