use std::path::{Path, PathBuf};

use super::journal::{Autosaves, Journal};
use crate::{
    math::{Aabb, Ray},
    recording::{self, Event, Flush, Header, OpenOptions, RecordingError, RonWriter, StrokeId},
    scene::{Change, PolygonId, Scene},
};

/// Events of a file that the model takes at once.
const PIECE: usize = 1024;

/// A session being drawn: the model, and the file in which every event is before the next one comes.
#[derive(Debug)]
pub struct Document {
    scene: Scene,
    /// Since they were last taken.
    changes: Vec<Change>,
    bounds: Aabb,
    header: Header,
    journal: Journal,
    next_stroke: u32,
    last_secs: f64,
    events: u64,
    refused: u64,
}

/// What was noticed while a session was opened.
#[derive(Clone, Debug, Default)]
pub struct Opened {
    /// One line each, for people.
    pub remarks: Vec<String>,
    /// The session was left open by a program that is gone.
    pub is_recovered: bool,
}

impl Document {
    /// An empty session that nobody has named yet.
    pub fn new(autosaves: &Autosaves) -> Self {
        let header = Header::new("sketch", concat!("osp sketch ", env!("CARGO_PKG_VERSION")));
        Self::empty(header.clone(), autosaves.create("sketch", header))
    }

    fn empty(header: Header, journal: Journal) -> Self {
        Self {
            scene: Scene::new(),
            changes: Vec::new(),
            bounds: Aabb::EMPTY,
            header,
            journal,
            next_stroke: 0,
            last_secs: 0.0,
            events: 0,
            refused: 0,
        }
    }

    /// The session that a crash left open, or an empty one.
    pub fn recover_or_new(autosaves: &Autosaves) -> (Self, Opened) {
        let Some(path) = autosaves.left_open() else { return (Self::new(autosaves), Opened::default()) };
        match Self::continue_ron(&path, |header| autosaves.resume(&path, header)) {
            Ok((document, mut opened)) => {
                opened.remarks.insert(0, format!("brought back {}", path.display()));
                opened.is_recovered = true;
                (document, opened)
            }
            Err(error) => {
                let remarks = vec![format!("a session was left open but cannot be read: {error}")];
                (Self::new(autosaves), Opened { remarks, is_recovered: false })
            }
        }
    }

    /// Opens a session of any format. One of our own goes on in its file (which is made if it is not there); of
    /// another's a copy is made among the autosaves.
    ///
    /// # Errors
    /// The file cannot be read, or is of no known format.
    pub fn open(path: &Path, autosaves: &Autosaves) -> Result<(Self, Opened), RecordingError> {
        let is_ron = path.extension().is_some_and(|ending| ending == "ron");
        let is_new = match std::fs::metadata(path) {
            Ok(data) => data.len() == 0,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound && is_ron => true,
            Err(error) => return Err(RecordingError::io(path, error)),
        };
        if is_new && is_ron {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let header = Header::new(stem, concat!("osp sketch ", env!("CARGO_PKG_VERSION")));
            let journal = Journal::new(path.to_owned(), header.clone());
            return Ok((Self::empty(header, journal), Opened::default()));
        }
        let session = recording::open(path, &OpenOptions::default())?;
        if session.format == "ron" && is_ron {
            return Self::continue_ron(path, |header| Journal::new(path.to_owned(), header));
        }
        Self::convert(session, path, autosaves)
    }

    fn continue_ron(
        path: &Path,
        journal: impl FnOnce(Header) -> Journal,
    ) -> Result<(Self, Opened), RecordingError> {
        let mut session = recording::open(path, &OpenOptions::default())?;
        let mut document = Self::empty(session.header.clone(), journal(session.header.clone()));
        let mut opened = Opened::default();
        let mut events = Vec::with_capacity(PIECE);
        loop {
            match session.events.next_event() {
                Ok(Some(event)) => document.note_read(event, &mut events),
                Ok(None) => break,
                Err(error) => {
                    // Nothing may be appended behind the damage: it would not be read again.
                    return Err(error);
                }
            }
        }
        document.note_all(&events);
        opened.remarks.extend(session.events.notes().warnings);
        document.end_open_strokes();
        Ok((document, opened))
    }

    /// Reads a foreign session into a recording of our own among the autosaves.
    fn convert(
        mut session: recording::Session,
        path: &Path,
        autosaves: &Autosaves,
    ) -> Result<(Self, Opened), RecordingError> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let header = session.header.clone();
        let journal = autosaves.create(&stem, header.clone());
        let mut opened = Opened::default();
        let mut writer = RonWriter::create(journal.path(), &header, Flush::AtEnd)?;
        let mut document = Self::empty(header, journal);
        let mut events = Vec::with_capacity(PIECE);
        loop {
            match session.events.next_event() {
                Ok(Some(event)) => {
                    writer.write(&event)?;
                    document.note_read(event, &mut events);
                }
                Ok(None) => break,
                Err(error) => {
                    opened.remarks.push(format!("{error}: what comes before it is here"));
                    break;
                }
            }
        }
        document.note_all(&events);
        writer.finish()?;
        opened.remarks.extend(session.events.notes().warnings);
        let place = document.journal.path().display().to_string();
        opened.remarks.push(format!("a copy of {} is being drawn on: {place}", path.display()));
        document.end_open_strokes();
        Ok((document, opened))
    }

    /// A crash leaves strokes without an end; nobody draws on them any more.
    fn end_open_strokes(&mut self) {
        let t = self.last_secs;
        let open =
            self.scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t, stroke }).collect();
        for event in ends {
            self.apply(event);
        }
    }

    /// Takes an event that comes from the file: with those that wait, once they are a piece. Whoever opens a session
    /// meets its whole model, so nobody needs the changes that led there.
    fn note_read(&mut self, event: Event, waiting: &mut Vec<Event>) {
        waiting.push(event);
        if waiting.len() == PIECE {
            self.note_all(waiting);
            waiting.clear();
            self.changes.clear();
            self.scene.let_go();
        }
    }

    fn note_all(&mut self, events: &[Event]) {
        for event in events {
            self.last_secs = self.last_secs.max(event.time_secs());
            if let Event::Begin { stroke, .. } | Event::Polygon { stroke: Some(stroke), .. } = event {
                self.next_stroke = self.next_stroke.max(stroke.0.saturating_add(1));
            }
        }
        self.events += events.len() as u64;
        let first = self.changes.len();
        self.scene.apply_all(events, &mut self.changes);
        for change in &self.changes[first..] {
            if let Change::Insert(id) | Change::Update(id) = *change {
                self.bounds = self.bounds.union(self.scene.bounds(id));
            }
        }
    }

    /// Takes an event that is being made: into the file, into the model. Returns whether it was one that a session
    /// can hold.
    pub fn apply(&mut self, event: Event) -> bool {
        if event.check().is_err() {
            self.refused += 1;
            return false;
        }
        self.journal.write(&event);
        self.note_all(std::slice::from_ref(&event));
        true
    }

    /// A stroke number that was not used yet.
    pub fn new_stroke(&mut self) -> StrokeId {
        // A session may have used the last number that there is: then those that it left out are next.
        while self.scene.is_used(StrokeId(self.next_stroke)) {
            self.next_stroke = self.next_stroke.wrapping_add(1);
        }
        let id = StrokeId(self.next_stroke);
        self.next_stroke = self.next_stroke.wrapping_add(1);
        id
    }

    /// The model.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What has changed since it was last taken.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// What has changed since this was last called goes to `out`.
    pub fn take_changes(&mut self, out: &mut Vec<Change>) {
        self.scene.let_go();
        out.append(&mut self.changes);
    }

    /// Box of everything that was ever drawn.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What the session says of itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Its file.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Tries a file that failed again if it is time.
    pub fn retry(&mut self) {
        self.journal.retry();
    }

    /// Time stamp of its last event, seconds: where a session that goes on takes up the time.
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

    /// Puts the session at `to` and goes on there.
    ///
    /// # Errors
    /// The file cannot be written; the session goes on where it was.
    pub fn save_as(&mut self, to: &Path) -> Result<PathBuf, RecordingError> {
        self.journal.move_to(to, self.events)?;
        Ok(self.journal.path().to_owned())
    }

    /// Ends the session on purpose.
    pub fn close(self) {
        self.journal.close();
    }
}

/// Where a ray meets a polygon, from either side.
pub(super) fn meet_polygon(scene: &Scene, id: PolygonId, ray: &Ray) -> Option<f32> {
    scene.polygon(id).meet(ray)
}
