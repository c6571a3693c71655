//! A session in the window: its file, its model, and the source of its events.

mod file;
#[cfg(feature = "live")]
mod live;
mod model;
mod opening;
mod reader;
mod replay;

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
};

use super::journal::{Autosave, Journal, SaveError, Unwritten};
use model::{Model, PIECE};
use osp::{math::Aabb, polygon::Change};
use osp_render::background_for;
use osp_session::{
    export::{KeptStrokes, PolygonTimes},
    platform::{fs, time::Instant},
    recording::{AUTHORS_FORMAT, Author, Event, GroupId, Header, Limits, RecordingError, StrokeId},
    scene::{GroupNode, Scene},
};

#[cfg(feature = "live")]
pub use live::{Live, OtherPen, Overlay, Unjoined};
pub use opening::{Access, OpenError, Opened, Opening};
pub(super) use reader::{SessionReader, Started};
pub use replay::{Jump, Replay, ReplayReader};

/// A function that finds the time at which each polygon was drawn. It stops when its argument returns `false`.
pub(super) type FindTimes = Box<dyn FnOnce(&dyn Fn() -> bool) -> PolygonTimes + Send>;

/// A function that finds the strokes of a session. It calls its argument with the number of events read, and returns
/// `None` once this call returns `false`.
pub(super) type FindStrokes =
    Box<dyn FnOnce(&dyn Fn(u64) -> bool) -> Result<Option<KeptStrokes>, RecordingError> + Send>;

/// The source of a session's events.
#[derive(Debug)]
enum Source {
    /// This window: events go to the file first, then to the model.
    File,
    /// Several authors: the server defines the order of events for all of them.
    #[cfg(feature = "live")]
    Live(Box<Live>),
    Replay(Box<Replay>),
}

/// A session that the window shows: its file, its model, and the source of its events.
#[derive(Debug)]
pub struct Session {
    model: Model,
    /// Writes the events to the session's file. In a replay it writes nothing.
    journal: Journal,
    source: Source,
    refused: u64,
    news: Vec<String>,
    /// If this session is a copy: an earlier copy of the same original that has edits.
    earlier: Option<Autosave>,
    /// The original, if this is a new copy.
    original: Option<PathBuf>,
    /// Whether this is a new copy of another program's session.
    is_import: bool,
}

impl Session {
    fn around(journal: Journal) -> Self {
        Self {
            model: Model::default(),
            journal,
            source: Source::File,
            refused: 0,
            news: Vec::new(),
            earlier: None,
            original: None,
            is_import: false,
        }
    }

    /// Ends the strokes and steps that a crash left open. The file gets these events together with the next event.
    fn end_open_strokes(&mut self) {
        let Model { scene, last_secs: t, .. } = &self.model;
        let open = scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t: *t, stroke }).collect();
        let step = scene.is_step_open().then_some(Event::Step { author: Author::SOLE, t: *t, edits: 0 });
        for event in ends.into_iter().chain(step) {
            // Both events always fit into a line.
            if self.journal.push(&event).is_ok() {
                self.model.apply(std::slice::from_ref(&event));
            }
        }
    }

    /// Writes a new event to the file and applies it to the model. Returns `false` if the event is invalid or the
    /// session is read-only.
    pub fn apply(&mut self, event: Event) -> bool {
        let mut events = vec![event];
        self.apply_all(&mut events);
        !events.is_empty()
    }

    /// Writes new events to the file together, and applies them to the model. Invalid events are removed from the list.
    /// In a read-only session, all events are removed.
    pub fn apply_all(&mut self, events: &mut Vec<Event>) {
        if self.is_read_only() {
            events.clear();
        }
        events.retain(|event| {
            let pushed = match &mut self.source {
                #[cfg(feature = "live")]
                Source::Live(live) => live.push(event),
                _ => self.journal.push(event),
            };
            let Err(error) = pushed else { return true };
            if self.refused == 0 {
                self.news.push(format!("invalid changes were skipped, the first one: {error}"));
            }
            self.refused += 1;
            false
        });
        if events.is_empty() {
            return;
        }
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            live.send(events);
            return;
        }
        self.journal.write_pending();
        self.model.apply(events);
    }

    /// The first limit that the session exceeds, and its name. A reader with these limits would refuse the file.
    pub(super) fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        self.model.tally.excess(limits)
    }

    /// The limit that the session would exceed with these events, like [`Session::excess`].
    pub(super) fn excess_with(&self, events: &[Event], limits: &Limits) -> Option<(u64, &'static str)> {
        let mut tally = self.model.tally.clone();
        events.iter().for_each(|event| tally.add(event));
        tally.excess(limits)
    }

    /// The events that drew these strokes, in order.
    ///
    /// # Errors
    /// The machine has not enough memory for them.
    pub fn events_of(&mut self, strokes: &BTreeSet<StrokeId>) -> io::Result<Vec<Event>> {
        self.journal.events_of(strokes)
    }

    /// An unused stroke number.
    pub fn new_stroke(&mut self) -> StrokeId {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            return StrokeId(live.new_number());
        }
        // In a session of several authors, each author has a range of numbers. This window has the first range.
        let last = if self.has_authors() { (1 << Author::NUMBER_BITS) - 1 } else { u32::MAX };
        self.model.new_stroke(last)
    }

    /// Up to `count` unused group numbers.
    pub fn new_groups(&mut self, count: usize) -> Vec<GroupId> {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            return (0..count).map(|_| GroupId(live.new_number())).collect();
        }
        self.model.scene.free_groups().take(count).collect()
    }

    /// Whether the session can have several authors.
    pub fn has_authors(&self) -> bool {
        self.header().format >= AUTHORS_FORMAT
    }

    /// Whether the session is read-only. A replay is always read-only.
    pub fn is_read_only(&self) -> bool {
        #[cfg(feature = "live")]
        if self.live().is_some_and(Live::is_watcher) {
            return true;
        }
        self.journal.is_read_only()
    }

    pub fn is_replay(&self) -> bool {
        matches!(self.source, Source::Replay(_))
    }

    /// Whether this is a new copy of another program's session. The window first shows such a session without tools.
    pub fn is_import(&self) -> bool {
        self.is_import
    }

    /// The original, if this is a new copy.
    pub fn original(&self) -> Option<&Path> {
        self.original.as_deref()
    }

    /// Whether this session has more than the original of which it is a new copy. A session without an original has.
    pub fn has_own_edits(&self) -> bool {
        self.original.is_none() || self.journal.is_changed() || self.journal.is_named()
    }

    /// The file that holds all that was drawn, if there is one. Before the first change of a copy this is the original.
    pub fn file_to_play(&self) -> Option<&Path> {
        match (&self.source, &self.original) {
            (Source::File, Some(original)) if !self.has_own_edits() => Some(original),
            (Source::File, _) if self.event_count() > 0 => {
                Some(self.path()).filter(|path| fs::is_there(path))
            }
            _ => None,
        }
    }

    /// Whether other authors draw in the session, too.
    pub fn is_shared(&self) -> bool {
        !matches!(self.source, Source::File | Source::Replay(_))
    }

    /// The state of the replay, if the session is a replay.
    pub fn replay(&self) -> Option<&Replay> {
        match &self.source {
            Source::Replay(replay) => Some(replay),
            _ => None,
        }
    }

    fn replay_mut(&mut self) -> Option<(&mut Replay, &mut Model)> {
        match &mut self.source {
            Source::Replay(replay) => Some((replay, &mut self.model)),
            _ => None,
        }
    }

    /// Warnings of the reader of a replay, one line each.
    pub fn remarks(&self) -> &[String] {
        self.replay().map_or(&[], |replay| &replay.remarks[..])
    }

    /// Plays or pauses a replay. At the end, playing restarts from the first frame.
    pub fn play(&mut self, run: bool) -> Option<Jump> {
        self.replay_mut().and_then(|(replay, model)| replay.play(model, run))
    }

    /// Jumps to the model of a replay after this number of frames.
    pub fn seek(&mut self, frames: u64) -> Option<Jump> {
        self.replay_mut().map(|(replay, model)| replay.seek(model, frames))
    }

    /// Plays one frame of a replay and appends its changes to `out`. Returns `false` at the end, or if the session is
    /// no replay.
    pub fn step(&mut self, out: &mut Vec<Change>) -> bool {
        let is_played = self.replay_mut().is_some_and(|(replay, model)| replay.step(model));
        out.append(&mut self.model.changes);
        is_played
    }

    /// Sets the speed of a replay, as a multiple of the recorded speed.
    pub fn set_speed(&mut self, speed: f64) {
        if let Source::Replay(replay) = &mut self.source {
            replay.set_speed(speed);
        }
    }

    /// The connection to the other authors, if the session is shared.
    #[cfg(feature = "live")]
    pub fn live(&self) -> Option<&Live> {
        match &self.source {
            Source::Live(live) => Some(live),
            _ => None,
        }
    }

    #[cfg(feature = "live")]
    pub(super) fn live_mut(&mut self) -> Option<&mut Live> {
        match &mut self.source {
            Source::Live(live) => Some(live),
            _ => None,
        }
    }

    /// The background colour: linear red, green, blue. It contrasts with the model; in a replay, with the finished
    /// model.
    pub fn background(&self) -> [f64; 3] {
        self.replay().map_or_else(|| background_for(self.scene()), |replay| replay.background)
    }

    pub fn scene(&self) -> &Scene {
        &self.model.scene
    }

    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        self.model.scene.group_tree()
    }

    /// The changes since [`Session::take_changes`] was last called.
    pub fn changes(&self) -> &[Change] {
        &self.model.changes
    }

    /// Appends the changes since the last call to `out`.
    pub fn take_changes(&mut self, out: &mut Vec<Change>) {
        self.model.scene.free_unreachable();
        out.append(&mut self.model.changes);
    }

    /// Plays the frames of a replay that are due after this time, seconds. Returns the number of changes.
    pub(super) fn advance(&mut self, frame_secs: f32) -> usize {
        self.replay_mut().map_or(0, |(replay, model)| replay.advance(model, frame_secs))
    }

    /// A box around all polygons drawn so far; in a replay, around the polygons of all frames.
    pub fn bounds(&self) -> Aabb {
        self.model.bounds
    }

    /// The time at which each polygon was drawn. Empty in a replay: use [`Session::find_times`].
    pub fn polygon_times(&self) -> &PolygonTimes {
        &self.model.times
    }

    /// Returns a function that finds the time at which each polygon of the current model was drawn. It may run on
    /// another thread.
    pub(super) fn find_times(&self) -> FindTimes {
        if let Some(replay) = self.replay() {
            return Box::new(replay.polygon_times());
        }
        let times = self.model.times.clone();
        Box::new(|_| times)
    }

    /// Returns the number of events so far, and a function that finds the strokes of the current model with their
    /// control points. It may run on another thread.
    pub(super) fn find_strokes(&self) -> (u64, FindStrokes) {
        if let Some(replay) = self.replay() {
            let find = replay.find_strokes();
            return (replay.events_played(), Box::new(|goes_on| Ok(find(goes_on))));
        }
        let log = self.journal.log();
        let find = move |goes_on: &dyn Fn(u64) -> bool| {
            let (mut kept, mut count) = (KeptStrokes::default(), 0);
            let mut events = log.read()?;
            while let Some(event) = events.next_event()? {
                kept.note(&event);
                count += 1;
                if count % PIECE as u64 == 0 && !goes_on(count) {
                    return Ok(None);
                }
            }
            Ok(Some(kept))
        };
        (self.event_count(), Box::new(find))
    }

    pub fn header(&self) -> &Header {
        self.journal.header()
    }

    /// Path of the session's file, or of the file that was read.
    pub fn path(&self) -> &Path {
        self.journal.path()
    }

    /// The journal, which writes the file.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Mutable access to the journal.
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Returns and clears the earlier copy with edits, if this session is a copy.
    pub(super) fn take_earlier(&mut self) -> Option<Autosave> {
        self.earlier.take()
    }

    /// Returns and clears the messages to the user.
    pub fn take_news(&mut self) -> Vec<String> {
        let mut news = std::mem::take(&mut self.news);
        news.append(&mut self.journal.take_news());
        news
    }

    /// Time stamp of the last event, seconds, from which new events continue. 0 in a replay, which gets no new events.
    pub fn last_secs(&self) -> f64 {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &self.source {
            return live.now_secs();
        }
        self.model.last_secs
    }

    /// Number of events so far. 0 in a replay: see [`Replay::position`].
    pub fn event_count(&self) -> u64 {
        self.model.events
    }

    /// Number of invalid events that were skipped, for example with a position that is not a number.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Writes the session to the file `to`, which becomes the session's file. An existing file is replaced.
    ///
    /// # Errors
    /// The file cannot be written; the session keeps its old file.
    pub fn save_as(&mut self, to: &Path) -> Result<(), SaveError> {
        self.journal.save_as(to)
    }

    /// Maintains the files of the session: checks them, flushes them at pauses, and repeats failed writes.
    pub(super) fn tend(&mut self, now: Instant) {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source
            && !live.tend(now, &mut self.news)
        {
            return;
        }
        self.journal.tend(now);
    }

    pub(super) fn retry(&mut self) {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            live.own_mut().retry();
        }
        self.journal.retry();
    }

    /// Writes all events of the session, and the user's events that the server has not returned yet.
    pub(super) fn settle(&mut self) -> Result<(), Unwritten> {
        self.journal.settle()?;
        match &mut self.source {
            #[cfg(feature = "live")]
            Source::Live(live) if live.is_waiting() => live.own_mut().settle(),
            _ => Ok(()),
        }
    }

    /// Whether an event of the user erases the stroke, and the server has not returned this event yet.
    pub(super) fn is_erasing(&self, stroke: StrokeId) -> bool {
        match &self.source {
            #[cfg(feature = "live")]
            Source::Live(live) => live.is_erasing(stroke),
            _ => {
                let _ = stroke;
                false
            }
        }
    }

    /// Whether a step of edits may be open. In a shared session this is unknown until the server has returned the
    /// events.
    pub(super) fn may_have_open_step(&self) -> bool {
        !self.is_replay() && (self.model.scene.is_step_open() || self.is_shared())
    }

    pub(super) fn on_their_way(&self) -> usize {
        match &self.source {
            #[cfg(feature = "live")]
            Source::Live(live) => live.waiting(),
            _ => 0,
        }
    }

    /// Whether events of a shared session were received that the model lacks.
    pub(super) fn has_unread_events(&self) -> bool {
        match &self.source {
            #[cfg(feature = "live")]
            Source::Live(live) => live.has_unread_events,
            _ => false,
        }
    }

    /// Leaves a shared session; without the feature `live` no session is shared.
    #[cfg(not(feature = "live"))]
    pub(super) fn leave(&mut self) -> Result<Vec<String>, Unwritten> {
        Ok(Vec::new())
    }

    /// Closes the session.
    ///
    /// # Errors
    /// A part of the session could not be written.
    pub fn close(self) -> Result<(), Unwritten> {
        self.journal.close()
    }
}
