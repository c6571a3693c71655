//! A session in the window: its log, its model, and where its events come from.

mod file;
#[cfg(feature = "live")]
mod live;
mod model;
mod opening;
mod reader;
mod replay;

use std::{collections::BTreeSet, io, path::Path};

use super::journal::{Autosave, Journal, SaveError, Unwritten};
use model::{Model, PIECE};
use osp::{math::Aabb, polygon::Change};
use osp_render::background_for;
use osp_session::{
    export::PolygonTimes,
    platform::time::Instant,
    recording::{AUTHORS_FORMAT, Author, Event, GroupId, Header, Limits, RecordingError, StrokeId},
    scene::{GroupNode, Scene},
};

#[cfg(feature = "live")]
pub use live::{Live, OtherPen, Overlay, Unjoined};
pub use opening::{Access, OpenError, Opened, Opening};
pub(super) use reader::{SessionReader, Started};
pub use replay::{Jump, Replay, ReplayReader};

/// Finds when polygons were drawn, as long as it is told to go on.
pub(super) type FindTimes = Box<dyn FnOnce(&dyn Fn() -> bool) -> PolygonTimes + Send>;

/// Where the events of a session come from.
#[derive(Debug)]
enum Source {
    /// From this window: they go to the file before the model.
    File,
    /// From several people, in the order that counts for all.
    #[cfg(feature = "live")]
    Live(Box<Live>),
    /// From a recording, which is only read.
    Replay(Box<Replay>),
}

/// A session that the window shows: its log, its model, and where its events come from.
#[derive(Debug)]
pub struct Session {
    model: Model,
    /// Its file. Every event is written there before the next one; a replay writes nothing.
    journal: Journal,
    source: Source,
    refused: u64,
    news: Vec<String>,
    /// Earlier edits of the original session, if this is a copy.
    earlier: Option<Autosave>,
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
        }
    }

    /// A crash leaves strokes and steps without an end; this ends them. The ends are written to the file together with the first event
    /// that somebody draws.
    fn end_open_strokes(&mut self) {
        let Model { scene, last_secs: t, .. } = &self.model;
        let open = scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t: *t, stroke }).collect();
        let step = scene.is_step_open().then_some(Event::Step { author: Author::SOLE, t: *t, edits: 0 });
        for event in ends.into_iter().chain(step) {
            // Neither is ever too long for a line.
            if self.journal.push(&event).is_ok() {
                self.model.apply(std::slice::from_ref(&event));
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
            let pushed = match &mut self.source {
                #[cfg(feature = "live")]
                Source::Live(live) => live.push(event),
                _ => self.journal.push(event),
            };
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
        if let Source::Live(live) = &mut self.source {
            live.send(events);
            return;
        }
        self.journal.write_pending();
        self.model.apply(events);
    }

    /// The first limit that a reader of its file will find passed, and its name.
    pub(super) fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        self.model.tally.excess(limits)
    }

    /// [`Session::excess`] after more events.
    pub(super) fn excess_with(&self, events: &[Event], limits: &Limits) -> Option<(u64, &'static str)> {
        let mut tally = self.model.tally.clone();
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
        if let Source::Live(live) = &mut self.source {
            return StrokeId(live.new_number());
        }
        // Where there were several authors, each has numbers of its own: those of the window are the first.
        let last = if self.knows_authors() { (1 << Author::NUMBER_BITS) - 1 } else { u32::MAX };
        self.model.new_stroke(last)
    }

    /// So many group numbers that were not used yet, or as many as there are.
    pub fn new_groups(&mut self, count: usize) -> Vec<GroupId> {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            return (0..count).map(|_| GroupId(live.new_number())).collect();
        }
        self.model.scene.free_groups().take(count).collect()
    }

    /// Whether the session can have several authors.
    pub fn knows_authors(&self) -> bool {
        self.header().format >= AUTHORS_FORMAT
    }

    /// Whether the session is read-only, as a replay always is.
    pub fn is_read_only(&self) -> bool {
        #[cfg(feature = "live")]
        if self.live().is_some_and(Live::is_watcher) {
            return true;
        }
        self.journal.is_read_only()
    }

    /// Whether it is a recording that is replayed.
    pub fn is_replay(&self) -> bool {
        matches!(self.source, Source::Replay(_))
    }

    /// Whether it is a session of several people. Such a one cannot be discarded.
    pub fn is_shared(&self) -> bool {
        !matches!(self.source, Source::File | Source::Replay(_))
    }

    /// The replay's position and frames, if it is one.
    pub fn replay(&self) -> Option<&Replay> {
        match &self.source {
            Source::Replay(replay) => Some(replay),
            _ => None,
        }
    }

    /// The replay, with the model that it plays.
    fn replay_mut(&mut self) -> Option<(&mut Replay, &mut Model)> {
        match &mut self.source {
            Source::Replay(replay) => Some((replay, &mut self.model)),
            _ => None,
        }
    }

    /// The remarks of a replay's reader, one line each.
    pub fn remarks(&self) -> &[String] {
        self.replay().map_or(&[], Replay::remarks)
    }

    /// Plays or pauses a replay. At the end, playing starts again from the first frame.
    pub fn play(&mut self, run: bool) -> Option<Jump> {
        self.replay_mut().and_then(|(replay, model)| replay.play(model, run))
    }

    /// Goes to a replay's model as it is after so many frames.
    pub fn seek(&mut self, frames: u64) -> Option<Jump> {
        self.replay_mut().map(|(replay, model)| replay.seek(model, frames))
    }

    /// Plays one frame of a replay; `false` at the end, and if it is none. The changes are appended to `out`.
    pub fn step(&mut self, out: &mut Vec<Change>) -> bool {
        let is_played = self.replay_mut().is_some_and(|(replay, model)| replay.step(model));
        out.append(&mut self.model.changes);
        is_played
    }

    /// Sets how many recorded frames are played for each one shown.
    pub fn set_speed(&mut self, speed: f64) {
        if let Source::Replay(replay) = &mut self.source {
            replay.set_speed(speed);
        }
    }

    /// The connection to the others who draw in it, if there are any.
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

    /// Linear red, green, blue where nothing is: what the model stands out from, a replay's when it is finished.
    pub fn background(&self) -> [f64; 3] {
        self.replay().map_or_else(|| background_for(self.scene()), Replay::background)
    }

    /// The model.
    pub fn scene(&self) -> &Scene {
        &self.model.scene
    }

    /// The groups of the model as a tree.
    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        self.model.scene.group_tree()
    }

    /// The changes since [`Session::take_changes`] was last called.
    pub fn changes(&self) -> &[Change] {
        &self.model.changes
    }

    /// Appends the changes since the last call to `out`.
    pub fn take_changes(&mut self, out: &mut Vec<Change>) {
        self.model.scene.let_go();
        out.append(&mut self.model.changes);
    }

    /// Plays the frames of a replay that are due with the next shown one. Returns how many changes they have made.
    pub(super) fn advance(&mut self) -> usize {
        self.replay_mut().map_or(0, |(replay, model)| replay.advance(model))
    }

    /// Box of everything that was ever drawn, of a replay also of what will be.
    pub fn bounds(&self) -> Aabb {
        self.model.bounds
    }

    /// When its polygons were drawn. A replay does not keep it: [`Session::find_times`].
    pub fn polygon_times(&self) -> &PolygonTimes {
        &self.model.times
    }

    /// Returns a function that finds when each polygon of the present model was drawn, perhaps on another thread.
    pub(super) fn find_times(&self) -> FindTimes {
        if let Some(replay) = self.replay() {
            return Box::new(replay.polygon_times());
        }
        let times = self.model.times.clone();
        Box::new(|_| times)
    }

    /// The session's header.
    pub fn header(&self) -> &Header {
        self.journal.header()
    }

    /// Its file: the one that it goes on in, or that is read.
    pub fn path(&self) -> &Path {
        self.journal.path()
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

    /// Time stamp of its last event, seconds: new events continue from there. A replay, to which nothing is added, stays at 0.
    pub fn last_secs(&self) -> f64 {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &self.source {
            return live.now_secs();
        }
        self.model.last_secs
    }

    /// Events so far; a replay counts frames instead.
    pub fn event_count(&self) -> u64 {
        self.model.events
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
        if let Source::Live(live) = &mut self.source
            && !live.tend(now, &mut self.news)
        {
            return;
        }
        self.journal.tend(now);
    }

    /// Tries again to write files that failed.
    pub(super) fn retry(&mut self) {
        #[cfg(feature = "live")]
        if let Source::Live(live) = &mut self.source {
            live.own_mut().retry();
        }
        self.journal.retry();
    }

    /// Writes everything of the session, and of what is on its way to it.
    ///
    /// # Errors
    /// A part of it could not be written.
    pub(super) fn settle(&mut self) -> Result<(), Unwritten> {
        self.journal.settle()?;
        match &mut self.source {
            #[cfg(feature = "live")]
            Source::Live(live) if live.is_waiting() => live.own_mut().settle(),
            _ => Ok(()),
        }
    }

    /// Whether an own erasing of the stroke is on its way to the others.
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

    /// Whether a step of edits may be open. In a session of several people one does not know before it comes back.
    pub(super) fn may_have_open_step(&self) -> bool {
        !self.is_replay() && (self.model.scene.is_step_open() || self.is_shared())
    }

    /// How many own events the others do not have yet.
    pub(super) fn on_their_way(&self) -> usize {
        match &self.source {
            #[cfg(feature = "live")]
            Source::Live(live) => live.waiting(),
            _ => 0,
        }
    }

    /// Whether more of a session of several people has come than the model has taken.
    pub(super) fn is_behind(&self) -> bool {
        match &self.source {
            #[cfg(feature = "live")]
            Source::Live(live) => live.is_behind(),
            _ => false,
        }
    }

    /// Takes the session and its file back to when it was opened or last saved under a name.
    ///
    /// # Errors
    /// There is no memory to read it again; nothing has changed.
    pub fn discard(&mut self) -> Result<(), RecordingError> {
        if self.is_replay() {
            return Ok(());
        }
        let events = self.journal.discard()?;
        self.model = Model::default();
        events.chunks(PIECE).for_each(|piece| self.model.apply_read(piece));
        self.end_open_strokes();
        Ok(())
    }

    /// No other people draw in it.
    #[cfg(not(feature = "live"))]
    pub(super) fn leave(&mut self) -> Result<Vec<String>, Unwritten> {
        Ok(Vec::new())
    }

    /// Ends the session on purpose.
    ///
    /// # Errors
    /// A part of the session could not be written.
    pub fn close(self) -> Result<(), Unwritten> {
        self.journal.close()
    }
}
