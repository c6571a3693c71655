mod opening;

use std::{collections::BTreeSet, io, path::Path};

use super::journal::{Journal, SaveError, Unwritten};
use crate::{
    export::PolygonTimes,
    math::{Aabb, Ray},
    polygon::{Change, PolygonId},
    recording::{
        AUTHORS_FORMAT, Author, Event, EventSource, Header, Limits, RecordingError, StrokeId, Tally,
    },
    scene::{GroupNode, Scene},
};

pub use opening::{Access, OpenError, Opened, Opening};

/// Events of a file that the model takes at once.
const PIECE: usize = 1024;

/// A session being drawn: the model, and its file, to which every event is written before the next one.
#[derive(Debug)]
pub struct Document {
    scene: Scene,
    /// Since [`Document::take_changes`] was last called.
    changes: Vec<Change>,
    bounds: Aabb,
    times: PolygonTimes,
    journal: Journal,
    next_stroke: u32,
    last_secs: f64,
    events: u64,
    /// What a reader of its file will count.
    tally: Tally,
    refused: u64,
    news: Vec<String>,
}

impl Document {
    fn around(journal: Journal) -> Self {
        Self {
            scene: Scene::keeping_groups_whole(),
            changes: Vec::new(),
            bounds: Aabb::EMPTY,
            times: PolygonTimes::default(),
            journal,
            next_stroke: 0,
            last_secs: 0.0,
            events: 0,
            tally: Tally::default(),
            refused: 0,
            news: Vec::new(),
        }
    }

    /// Applies the events of a file, piece by piece. The window inserts the whole model when it opens a session, so the
    /// changes on the way are dropped.
    fn read(
        &mut self,
        events: &mut dyn EventSource,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(), RecordingError> {
        let mut piece = Vec::with_capacity(PIECE);
        while let Some(event) = events.next_event()? {
            self.journal.note(&event)?;
            piece.push(event);
            if piece.len() == PIECE {
                self.note_piece(&piece);
                piece.clear();
                if !go_on(self.events) {
                    let path = self.journal.path();
                    return Err(RecordingError::io(path, io::ErrorKind::Interrupted.into()));
                }
            }
        }
        self.note_piece(&piece);
        Ok(())
    }

    fn note_piece(&mut self, events: &[Event]) {
        self.note(events);
        self.changes.clear();
        self.scene.let_go();
    }

    /// A crash leaves strokes and steps without an end; this ends them. The ends are written to the file together with the first event
    /// that somebody draws.
    fn end_open_strokes(&mut self) {
        let t = self.last_secs;
        let open =
            self.scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t, stroke }).collect();
        let step = self.scene.is_step_open().then_some(Event::Step { author: Author::SOLE, t, edits: 0 });
        for event in ends.into_iter().chain(step) {
            // Neither is ever too long for a line.
            if self.journal.note(&event).is_ok() {
                self.note(std::slice::from_ref(&event));
            }
        }
    }

    /// Applies events to the model.
    fn note(&mut self, events: &[Event]) {
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

    /// Writes a new event to the file and applies it to the model. Returns whether a session
    /// can hold it and this one is not read-only.
    pub fn apply(&mut self, event: Event) -> bool {
        let mut events = vec![event];
        self.apply_all(&mut events);
        !events.is_empty()
    }

    /// Writes new events to the file, together, and applies them to the model. Those that no session can hold are taken out
    /// of the list; all are, if this one is read-only.
    pub fn apply_all(&mut self, events: &mut Vec<Event>) {
        if self.is_read_only() {
            events.clear();
        }
        events.retain(|event| {
            let Err(error) = self.journal.push(event) else { return true };
            if self.refused == 0 {
                self.news.push(format!("left out, the first of what no session can hold: {error}"));
            }
            self.refused += 1;
            false
        });
        if !events.is_empty() {
            self.journal.write_pending();
            self.note(events);
        }
    }

    /// The first limit that a reader of its file will find passed, and its name.
    pub(super) fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        self.tally.excess(limits)
    }

    /// [`Document::excess`] after more events.
    pub(super) fn excess_with(&self, events: &[Event], limits: &Limits) -> Option<(u64, &'static str)> {
        let mut tally = self.tally.clone();
        events.iter().for_each(|event| tally.add(event));
        tally.excess(limits)
    }

    /// The events that made these strokes, in their order.
    ///
    /// # Errors
    /// There is no memory for them.
    pub fn events_of(&self, strokes: &BTreeSet<StrokeId>) -> io::Result<Vec<Event>> {
        self.journal.events_of(strokes)
    }

    /// A stroke number that was not used yet.
    pub fn new_stroke(&mut self) -> StrokeId {
        // Where there were several authors, each has numbers of its own: those of the window are the first.
        let is_shared = self.header().format >= AUTHORS_FORMAT;
        let last = if is_shared { (1 << Author::NUMBER_BITS) - 1 } else { u32::MAX };
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

    /// Whether the session is read-only.
    pub fn is_read_only(&self) -> bool {
        self.journal.is_read_only()
    }

    /// The model.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The groups of the model as a tree.
    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        self.scene.group_tree()
    }

    /// The changes since [`Document::take_changes`] was last called.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// Appends the changes since the last call to `out`.
    pub fn take_changes(&mut self, out: &mut Vec<Change>) {
        self.scene.let_go();
        out.append(&mut self.changes);
    }

    /// Box of everything that was ever drawn.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// When its polygons were drawn.
    pub fn polygon_times(&self) -> &PolygonTimes {
        &self.times
    }

    /// The session's header.
    pub fn header(&self) -> &Header {
        self.journal.header()
    }

    /// Its file.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Its file.
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Messages since the last call.
    pub fn take_news(&mut self) -> Vec<String> {
        let mut news = std::mem::take(&mut self.news);
        news.append(&mut self.journal.take_news());
        news
    }

    /// Time stamp of its last event, seconds: new events continue from there.
    pub fn last_secs(&self) -> f64 {
        self.last_secs
    }

    /// Events so far.
    pub fn event_count(&self) -> u64 {
        self.events
    }

    /// Events that no session can hold (a position that is not a number), left out.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Writes the session to `to` and continues in that file. An existing file is replaced.
    ///
    /// # Errors
    /// The file cannot be written; the session continues in its old file.
    pub fn save_as(&mut self, to: &Path) -> Result<(), SaveError> {
        self.journal.save_as(to)
    }

    /// Takes the session and its file back to when it was opened or last saved under a name.
    ///
    /// # Errors
    /// There is no memory to read it again; nothing has changed.
    pub fn discard(&mut self) -> Result<(), RecordingError> {
        let events = self.journal.discard()?;
        (self.scene, self.bounds) = (Scene::keeping_groups_whole(), Aabb::EMPTY);
        (self.next_stroke, self.last_secs, self.events) = (0, 0.0, 0);
        (self.tally, self.times) = (Tally::default(), PolygonTimes::default());
        events.chunks(PIECE).for_each(|piece| self.note_piece(piece));
        self.changes.clear();
        self.end_open_strokes();
        Ok(())
    }

    /// Ends the session on purpose.
    ///
    /// # Errors
    /// A part of the session could not be written.
    pub fn close(self) -> Result<(), Unwritten> {
        self.journal.close()
    }
}

/// The parameter at which a ray hits a polygon, from either side.
pub(super) fn meet_polygon(scene: &Scene, id: PolygonId, ray: &Ray) -> Option<f32> {
    scene.polygon_from(id, ray.origin, glam::Vec3::Y).meet(ray)
}
