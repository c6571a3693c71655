mod drawn;
mod opening;
mod reader;

use std::{collections::BTreeSet, io, path::Path, sync::Arc};

#[cfg(feature = "live")]
use super::shared::Shared;
use super::{
    journal::{Autosave, Journal, Lines, SaveError, Unwritten},
    threads,
};
use drawn::Drawn;
use osp::{
    math::{Aabb, Ray},
    polygon::{Change, PolygonId},
};
use osp_session::{
    export::PolygonTimes,
    platform::time::Instant,
    recording::{
        AUTHORS_FORMAT, Author, Event, EventSource, GroupId, Header, Limits, RecordingError, StrokeId,
    },
    scene::{GroupNode, Scene},
};

pub(super) use opening::Started;
pub use opening::{Access, OpenError, Opened, Opening};
pub(super) use reader::DocumentReader;

/// Events of a file that the model takes at once.
pub(super) const PIECE: usize = 1024;
/// Bytes of their lines: more than ordinary lines take.
const PIECE_BYTES: usize = 1 << 18;
/// So many such pieces may wait for the journal, and for the model.
const PIECES_AHEAD: usize = 4;

/// A session being drawn: the model, and its file, to which every event is written before the next one.
#[derive(Debug)]
pub struct Document {
    pub(super) drawn: Drawn,
    journal: Journal,
    refused: u64,
    pub(super) news: Vec<String>,
    /// Earlier edits of the original session, if this is a copy.
    earlier: Option<Autosave>,
    /// The session of several people that it is of.
    #[cfg(feature = "live")]
    pub(super) shared: Option<Shared>,
}

impl Document {
    pub(super) fn around(journal: Journal) -> Self {
        Self {
            drawn: Drawn::default(),
            journal,
            refused: 0,
            news: Vec::new(),
            earlier: None,
            #[cfg(feature = "live")]
            shared: None,
        }
    }

    /// Reads the events of a file, piece by piece. Meanwhile one thread applies them to the model, and another one packs their
    /// lines for the journal.
    fn read(
        &mut self,
        events: &mut dyn EventSource,
        go_on: &dyn Fn(u64) -> bool,
    ) -> Result<(), RecordingError> {
        let Self { drawn, journal, .. } = self;
        let path = journal.path().to_owned();
        let mut read = |to_journal: &mut dyn FnMut(Arc<Lines>) -> bool,
                        to_model: &mut dyn FnMut(Arc<Lines>) -> bool| {
            let mut count = 0;
            loop {
                let mut piece = Lines::default();
                let outcome = read_piece(events, &mut piece);
                count += piece.events().len() as u64;
                let piece = Arc::new(piece);
                // What the journal refuses ends the reading.
                if !(to_journal(Arc::clone(&piece)) && to_model(piece) && outcome?) {
                    return Ok(());
                }
                if !go_on(count) {
                    return Err(RecordingError::io(&path, io::ErrorKind::Interrupted.into()));
                }
            }
        };
        let note = |piece: Arc<Lines>| journal.note(&piece);
        let apply = |piece: Arc<Lines>| {
            drawn.apply_read(piece.events());
            Ok(())
        };
        let ((read, applied), noted) = threads::hand_over(PIECES_AHEAD, note, |to_journal| {
            threads::hand_over(PIECES_AHEAD, apply, |to_model| read(to_journal, to_model))
        });
        noted.and(applied).and(read)
    }

    /// A crash leaves strokes and steps without an end; this ends them. The ends are written to the file together with the first event
    /// that somebody draws.
    fn end_open_strokes(&mut self) {
        let Drawn { scene, last_secs: t, .. } = &self.drawn;
        let open = scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t: *t, stroke }).collect();
        let step = scene.is_step_open().then_some(Event::Step { author: Author::SOLE, t: *t, edits: 0 });
        for event in ends.into_iter().chain(step) {
            // Neither is ever too long for a line.
            if self.journal.push(&event).is_ok() {
                self.drawn.apply(std::slice::from_ref(&event));
            }
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
            #[cfg(feature = "live")]
            let pushed = match &mut self.shared {
                Some(shared) => shared.push(event),
                None => self.journal.push(event),
            };
            #[cfg(not(feature = "live"))]
            let pushed = self.journal.push(event);
            let Err(error) = pushed else { return true };
            if self.refused == 0 {
                self.news.push(format!("left out, the first of what no session can hold: {error}"));
            }
            self.refused += 1;
            false
        });
        if events.is_empty() {
            return;
        }
        #[cfg(feature = "live")]
        if let Some(shared) = &mut self.shared {
            shared.send(events);
            return;
        }
        self.journal.write_pending();
        self.drawn.apply(events);
    }

    /// Writes the next events of a session of several people, and applies them.
    #[cfg(feature = "live")]
    pub(super) fn take_ordered(&mut self, events: &[Event]) {
        self.write_ordered(events);
        self.drawn.apply(events);
    }

    /// Writes the next events of a session of several people.
    #[cfg(feature = "live")]
    pub(super) fn write_ordered(&mut self, events: &[Event]) {
        if events.is_empty() {
            return;
        }
        for event in events {
            if let Err(error) = self.journal.push(event) {
                self.news.push(error.to_string());
            }
        }
        self.journal.write_pending();
    }

    /// The first limit that a reader of its file will find passed, and its name.
    pub(super) fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        self.drawn.tally.excess(limits)
    }

    /// [`Document::excess`] after more events.
    pub(super) fn excess_with(&self, events: &[Event], limits: &Limits) -> Option<(u64, &'static str)> {
        let mut tally = self.drawn.tally.clone();
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
        #[cfg(feature = "live")]
        if let Some(shared) = &mut self.shared {
            return StrokeId(shared.new_number());
        }
        // Where there were several authors, each has numbers of its own: those of the window are the first.
        let last = if self.knows_authors() { (1 << Author::NUMBER_BITS) - 1 } else { u32::MAX };
        self.drawn.next_stroke &= last;
        // A session may have used the last number that there is: then those that it left out are next.
        for _ in 0..last {
            if !self.drawn.scene.is_used(StrokeId(self.drawn.next_stroke)) {
                break;
            }
            self.drawn.next_stroke = self.drawn.next_stroke.wrapping_add(1) & last;
        }
        let id = StrokeId(self.drawn.next_stroke);
        self.drawn.next_stroke = self.drawn.next_stroke.wrapping_add(1) & last;
        id
    }

    /// So many group numbers that were not used yet, or as many as there are.
    pub fn new_groups(&mut self, count: usize) -> Vec<GroupId> {
        #[cfg(feature = "live")]
        if let Some(shared) = &mut self.shared {
            return (0..count).map(|_| GroupId(shared.new_number())).collect();
        }
        self.drawn.scene.free_groups().take(count).collect()
    }

    /// Whether the session can have several authors.
    pub fn knows_authors(&self) -> bool {
        self.header().format >= AUTHORS_FORMAT
    }

    /// Whether the session is read-only.
    pub fn is_read_only(&self) -> bool {
        #[cfg(feature = "live")]
        if self.shared.as_ref().is_some_and(Shared::is_watcher) {
            return true;
        }
        self.journal.is_read_only()
    }

    /// The model.
    pub fn scene(&self) -> &Scene {
        &self.drawn.scene
    }

    /// The groups of the model as a tree.
    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        self.drawn.scene.group_tree()
    }

    /// The changes since [`Document::take_changes`] was last called.
    pub fn changes(&self) -> &[Change] {
        &self.drawn.changes
    }

    /// Appends the changes since the last call to `out`.
    pub fn take_changes(&mut self, out: &mut Vec<Change>) {
        self.drawn.scene.let_go();
        out.append(&mut self.drawn.changes);
    }

    /// Box of everything that was ever drawn.
    pub fn bounds(&self) -> Aabb {
        self.drawn.bounds
    }

    /// When its polygons were drawn.
    pub fn polygon_times(&self) -> &PolygonTimes {
        &self.drawn.times
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

    /// Earlier edits of the original session, if this is a copy. The next call returns `None`.
    pub(super) fn take_earlier(&mut self) -> Option<Autosave> {
        self.earlier.take()
    }

    /// Messages since the last call.
    pub fn take_news(&mut self) -> Vec<String> {
        let mut news = std::mem::take(&mut self.news);
        news.append(&mut self.journal.take_news());
        news
    }

    /// Time stamp of its last event, seconds: new events continue from there.
    pub fn last_secs(&self) -> f64 {
        #[cfg(feature = "live")]
        if let Some(shared) = &self.shared {
            return shared.now_secs();
        }
        self.drawn.last_secs
    }

    /// Events so far.
    pub fn event_count(&self) -> u64 {
        self.drawn.events
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

    /// Looks after its files.
    pub(super) fn tend(&mut self, now: Instant) {
        #[cfg(feature = "live")]
        if let Some(shared) = &mut self.shared
            && !shared.tend(now, &mut self.news)
        {
            return;
        }
        self.journal.tend(now);
    }

    /// Tries again to write files that failed.
    pub(super) fn retry(&mut self) {
        #[cfg(feature = "live")]
        if let Some(shared) = &mut self.shared {
            shared.own_mut().retry();
        }
        self.journal.retry();
    }

    /// Whether an own erasing of the stroke is on its way to the others.
    pub(super) fn is_erasing(&self, stroke: StrokeId) -> bool {
        #[cfg(feature = "live")]
        return self.shared.as_ref().is_some_and(|shared| shared.is_erasing(stroke));
        #[cfg(not(feature = "live"))]
        {
            let _ = stroke;
            false
        }
    }

    /// Whether a step of edits may be open. In a session of several people one does not know before it comes back.
    pub(super) fn may_have_open_step(&self) -> bool {
        self.drawn.scene.is_step_open() || self.is_shared()
    }

    /// No other people draw in it.
    #[cfg(not(feature = "live"))]
    pub(super) fn leave_session(&mut self) -> Result<Vec<String>, Unwritten> {
        Ok(Vec::new())
    }

    /// Writes everything of the session.
    ///
    /// # Errors
    /// A part of it could not be written.
    #[cfg(not(feature = "live"))]
    pub(super) fn settle(&mut self) -> Result<(), Unwritten> {
        self.journal.settle()
    }

    /// How many own events the others do not have yet.
    pub(super) fn on_their_way(&self) -> usize {
        #[cfg(feature = "live")]
        return self.shared.as_ref().map_or(0, Shared::waiting);
        #[cfg(not(feature = "live"))]
        0
    }

    /// Whether more of a session of several people has come than the model has taken.
    pub(super) fn is_behind(&self) -> bool {
        #[cfg(feature = "live")]
        return self.shared.as_ref().is_some_and(Shared::is_behind);
        #[cfg(not(feature = "live"))]
        false
    }

    /// Whether it is a session of several people. Such a one cannot be discarded.
    pub fn is_shared(&self) -> bool {
        #[cfg(feature = "live")]
        return self.shared.is_some();
        #[cfg(not(feature = "live"))]
        false
    }

    /// Takes the session and its file back to when it was opened or last saved under a name.
    ///
    /// # Errors
    /// There is no memory to read it again; nothing has changed.
    pub fn discard(&mut self) -> Result<(), RecordingError> {
        let events = self.journal.discard()?;
        self.drawn = Drawn::default();
        events.chunks(PIECE).for_each(|piece| self.drawn.apply_read(piece));
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

/// Reads a piece's events; those before an error stay in it. Returns whether there may be more.
fn read_piece(events: &mut dyn EventSource, piece: &mut Lines) -> Result<bool, RecordingError> {
    while piece.events().len() < PIECE && piece.bytes() < PIECE_BYTES {
        let Some(event) = events.next_event()? else { return Ok(false) };
        piece.push(event, events.line());
    }
    Ok(true)
}

/// The parameter at which a ray hits a polygon, from either side.
pub(super) fn meet_polygon(scene: &Scene, id: PolygonId, ray: &Ray) -> Option<f32> {
    scene.polygon_from(id, ray.origin, glam::Vec3::Y).meet(ray)
}
