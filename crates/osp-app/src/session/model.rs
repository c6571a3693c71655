use osp::{math::Aabb, polygon::Change};
use osp_session::{
    export::PolygonTimes,
    recording::{Event, StrokeId, Tally},
    scene::Scene,
};

/// Number of events that the model applies in one call.
pub(super) const PIECE: usize = 1024;

/// The model after the events so far. A replay updates only `scene` and `changes`, because it can also play backwards.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) scene: Scene,
    /// Changes since they were last taken.
    pub(super) changes: Vec<Change>,
    /// A box around all polygons drawn so far.
    pub(super) bounds: Aabb,
    pub(super) times: PolygonTimes,
    /// The next stroke number: one more than the largest number of a stroke without an author.
    pub(super) next_stroke: u32,
    pub(super) last_secs: f64,
    pub(super) events: u64,
    /// The counts for comparison with a reader's limits.
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
    /// An unused stroke number up to `last`, which must be a power of two minus one.
    pub(super) fn new_stroke(&mut self, last: u32) -> StrokeId {
        self.next_stroke &= last;
        // After the last number, the search continues at 0.
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

    pub(super) fn apply(&mut self, events: &[Event]) {
        self.apply_within(events, u64::MAX);
    }

    /// Applies events to the model as one frame, until they have cost `most` units of work. Returns the number of
    /// applied events.
    pub(super) fn apply_within(&mut self, events: &[Event], most: u64) -> usize {
        if events.is_empty() {
            return 0;
        }
        let first = self.changes.len();
        let taken = self.scene.apply_within(events, most, &mut self.changes);
        let events = &events[..taken];
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
        self.times.note(events, &self.scene);
        for &change in &self.changes[first..] {
            self.bounds = self.bounds.union(&self.scene.bounds_of_change(change));
        }
        taken
    }

    /// Applies events of a file and drops the changes, because the window inserts the whole model at once.
    pub(super) fn apply_read(&mut self, events: &[Event]) {
        self.apply(events);
        self.changes.clear();
        self.scene.free_unreachable();
    }
}
