//! A shared session in the window. The window sends its user's events to the server, which returns the events of all
//! authors in one order. An overlay shows the user's strokes until their events come back.

mod inbox;
mod joining;
mod known;
mod overlay;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    time::Duration,
};

use glam::Vec3;

use crate::journal::{Autosaves, Journal};
use inbox::Inbox;
pub use joining::Unjoined;
use known::Known;
use osp_net::live::{Address, Connection, Link, LiveError, ME, News, Role, Status};
use osp_session::{
    platform::time::Instant,
    recording::{Author, Event, Header, ONE_AUTHOR_FORMAT, RecordingError, StrokeId},
    scene::Scene,
};
pub use overlay::Overlay;

/// Interval between two checks of the files.
const TEND: Duration = Duration::from_millis(500);

/// The current pen position of another author.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherPen {
    pub author: Author,
    /// The last point, world space.
    pub at: Vec3,
}

/// The connection to the other authors of a session.
#[derive(Debug)]
pub struct Live {
    link: Link,
    has_news: Arc<AtomicBool>,
    /// Whether events were taken after the frame's panels were laid out.
    was_taken: bool,
    /// Events that were received but are not in the model yet.
    inbox: Inbox,
    /// Whether unread events may remain after this frame's share of work.
    pub(super) has_unread_events: bool,
    session: String,
    is_watcher: bool,
    /// The user's events that the server has not returned yet, oldest first.
    waiting: VecDeque<Event>,
    /// A journal of all of the user's events. Its file keeps strokes that were drawn without a server, even after a
    /// crash.
    own: Journal,
    /// The user's strokes that the server has not returned yet.
    pub overlay: Overlay,
    /// The events that the session's file had before joining.
    known: Option<Known>,
    /// Strokes erased by events of the user that the server has not returned yet.
    erasing: BTreeSet<StrokeId>,
    /// Number of the user's events that the server refused, and of the user's strokes that the model skipped because of
    /// their layer.
    refused: usize,
    /// The authors under which this window has joined.
    own_authors: BTreeSet<Author>,
    /// The next number of a stroke or group of the user.
    next: u32,
    /// Each author's unfinished stroke, and its last point.
    pens: BTreeMap<Author, (StrokeId, Option<Vec3>)>,
    /// The status at the last [`Live::take_note`].
    told: Status,
    tended_at: Option<Instant>,
    /// The reason for which the window receives no more events.
    ended: Option<String>,
    has_left: bool,
}

impl Live {
    /// Joins a shared session.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn join(address: &Address, role: &Role, autosaves: &Autosaves) -> Result<Self, LiveError> {
        let has_news = Arc::new(AtomicBool::new(false));
        let of_link = Arc::clone(&has_news);
        let session = address.session.to_owned();
        let name = format!("{session}-own");
        let header = Header {
            format: ONE_AUTHOR_FORMAT,
            ..Header::new(&name, concat!("osp sketch ", env!("CARGO_PKG_VERSION"), ", in a shared session"))
        };
        Ok(Self {
            link: Link::open(address, role, move || of_link.store(true, Relaxed))?,
            has_news,
            was_taken: false,
            inbox: Inbox::default(),
            has_unread_events: false,
            own: Journal::unnamed(autosaves, &name, header).expect("a header without numbers is sound"),
            session,
            is_watcher: *role == Role::Watcher,
            waiting: VecDeque::new(),
            overlay: Overlay::default(),
            known: None,
            erasing: BTreeSet::new(),
            refused: 0,
            own_authors: BTreeSet::new(),
            next: 0,
            pens: BTreeMap::new(),
            told: Status::default(),
            tended_at: None,
            ended: None,
            has_left: false,
        })
    }

    /// Whether events were received or taken, or the connection has changed, since the last call.
    pub(crate) fn take_note(&mut self) -> bool {
        let status = self.link.status();
        let of = |status: &Status| (status.connection.clone(), status.trouble.clone(), status.authors);
        let is_other = of(&status) != of(&self.told);
        self.told = status;
        is_other | self.has_news.swap(false, Relaxed) | std::mem::take(&mut self.was_taken)
    }

    /// Checks and flushes the file of the user's events. Returns whether the session's own file should be checked, too.
    pub(super) fn tend(&mut self, now: Instant, said: &mut Vec<String>) -> bool {
        let is_time = self.tended_at.is_none_or(|at| now.saturating_duration_since(at) >= TEND);
        if is_time {
            self.tended_at = Some(now);
            self.own.tend(now);
            said.append(&mut self.own.take_news());
        }
        is_time
    }

    pub(super) fn own_mut(&mut self) -> &mut Journal {
        &mut self.own
    }

    pub(super) fn is_erasing(&self, stroke: StrokeId) -> bool {
        self.erasing.contains(&stroke)
    }

    pub fn session(&self) -> &str {
        &self.session
    }

    /// Whether this window cannot draw: it only watches, or all numbers of its author are used.
    pub fn is_watcher(&self) -> bool {
        self.is_watcher || ME.number(self.next).is_none()
    }

    pub(crate) fn overlay_mut(&mut self) -> &mut Overlay {
        &mut self.overlay
    }

    pub(super) fn now_secs(&self) -> f64 {
        self.link.hand().now_secs()
    }

    pub(super) fn new_number(&mut self) -> u32 {
        let Some(number) = ME.number(self.next) else { return ME.number(0).unwrap_or_default() };
        self.next += 1;
        number
    }

    /// Writes an event of the user to the file of the user's events; [`Live::send`] then sends it.
    pub(super) fn push(&mut self, event: &Event) -> Result<(), RecordingError> {
        // The file of the user's events has a single author, so its events cannot close a layer.
        let mut alone = event.names_author().then(|| event.clone());
        if let Some(Event::Layer { mine, .. }) = &mut alone {
            *mine = None;
        }
        self.own.push(alone.as_ref().unwrap_or(event))
    }

    pub(super) fn send(&mut self, events: &[Event]) {
        self.own.write_pending();
        for event in events {
            self.overlay.add(event);
            if let Event::Erase { stroke, .. } = event {
                self.erasing.insert(*stroke);
            }
        }
        self.waiting.extend(events.iter().cloned());
        self.link.hand().send(events.to_vec());
    }

    /// Removes the first events of the inbox, which are in the model now. Appends messages for the user to `said`.
    fn take(&mut self, count: usize, said: &mut Vec<String>) -> Vec<Event> {
        let Status { author, has_caught_up, .. } = self.link.status();
        self.was_taken |= count > 0;
        let mut events = Vec::with_capacity(count);
        let own = self.inbox.take(count, &mut events);
        self.settle(own);
        events.iter().for_each(|event| self.note(event));
        if has_caught_up {
            said.extend(events.iter().filter_map(|event| coming_or_going(event, author)));
        }
        events
    }

    /// Removes events that the file has already. If the file has different events, removes all events and leaves the
    /// session.
    fn pass_over_known(&mut self, events: &mut Vec<Event>, said: &mut Vec<String>) {
        let Some(known) = &mut self.known else { return };
        if let Err(why) = known.pass_over(events) {
            events.clear();
            self.inbox.take_all();
            self.refuse(why, said);
            return;
        }
        self.known.take_if(|known| known.is_over());
    }

    /// Returns the next events when the window leaves the session. The caller adds them to the file but not to the
    /// model.
    fn take_rest(&mut self, said: &mut Vec<String>) -> Option<Vec<Event>> {
        self.fetch(said);
        Some(self.inbox.take_all()).filter(|rest| !rest.is_empty())
    }

    /// Handles messages of the server until the inbox has the events of a frame, without events that the file has
    /// already.
    fn fetch(&mut self, said: &mut Vec<String>) {
        let has_caught_up = self.link.status().has_caught_up;
        while !self.inbox.has_enough() && self.ended.is_none() {
            match self.link.news() {
                Ok(None) => {
                    // The server has no more events, but the file has.
                    if has_caught_up && let Some(known) = &self.known {
                        let why = known.other_session_message();
                        self.refuse(why, said);
                    }
                    break;
                }
                Ok(Some(News::Events { mut events, own })) => {
                    self.pass_over_known(&mut events, said);
                    self.inbox.add(events, own);
                }
                Ok(Some(News::Refused { why, own })) => {
                    self.inbox.add(Vec::new(), own);
                    (self.refused, self.was_taken) = (self.refused + own, true);
                    said.push(format!("{own} of your changes are not in the session: {why}"));
                }
                Ok(Some(News::Joined(author))) => {
                    self.own_authors.insert(author);
                    said.push(format!("you are author {author}"));
                }
                Ok(Some(News::Left)) => self.has_left = true,
                Err(error) => {
                    said.push(error.to_string());
                    self.ended = Some(error.to_string());
                }
            }
        }
    }

    /// Counts the user's strokes that the model skipped because another author had closed their layer before the server
    /// received them. Returns a message for the user.
    fn note_left_out(&mut self, events: &[Event], scene: &Scene) -> Option<String> {
        let is_left_out = |event: &&Event| {
            matches!(event, Event::Begin { author, stroke, .. }
                if self.own_authors.contains(author) && !scene.is_used(*stroke))
        };
        let count = events.iter().filter(is_left_out).count();
        self.refused += count;
        let path = self.own.path().display();
        (count > 0).then(|| {
            format!("{count} of your strokes are not in the model, because only another author may edit their layer now: they are in {path}")
        })
    }

    /// Leaves the session, because the file belongs to another session and must not be changed.
    fn refuse(&mut self, why: String, said: &mut Vec<String>) {
        self.link.hand().leave();
        self.is_watcher = true;
        said.push(why.clone());
        self.ended = Some(why);
    }

    fn settle(&mut self, own: usize) {
        for event in self.waiting.drain(..own.min(self.waiting.len())) {
            self.overlay.settle(&event);
            if let Event::Erase { stroke, .. } = event {
                self.erasing.remove(&stroke);
            }
        }
    }

    fn note(&mut self, event: &Event) {
        match event {
            Event::Begin { author, stroke, .. } => _ = self.pens.insert(*author, (*stroke, None)),
            Event::Point { stroke, p, .. } => {
                if let Some((drawn, at)) = self.pens.get_mut(&stroke.author())
                    && drawn == stroke
                {
                    *at = Some(*p);
                }
            }
            Event::End { stroke, .. }
                if self.pens.get(&stroke.author()).is_some_and(|(drawn, _)| drawn == stroke) =>
            {
                self.pens.remove(&stroke.author());
            }
            Event::Leave { author, .. } => _ = self.pens.remove(author),
            _ => {}
        }
    }

    /// Updates the overlay: the polygons of the user's strokes that the session's scene lacks.
    pub(super) fn show_own(&mut self, scene: &Scene) {
        let author = self.link.status().author;
        self.overlay.show(|own| {
            let number = author.and_then(|author| author.number(own.0 & ((1 << Author::NUMBER_BITS) - 1)));
            let stroke = number.and_then(|number| scene.stroke(StrokeId(number)));
            stroke.map_or(0, |stroke| stroke.polygon_ids().count())
        });
    }

    /// The pens of other authors that are drawing now.
    pub fn pens(&self) -> impl Iterator<Item = OtherPen> + '_ {
        let own = self.told.author;
        let others = self.pens.iter().filter(move |(author, _)| Some(**author) != own);
        others.filter_map(|(&author, (_, at))| Some(OtherPen { author, at: (*at)? }))
    }

    pub fn status(&self) -> Status {
        self.link.status()
    }

    /// The status of the connection as text for the user.
    pub fn shown(&self) -> String {
        if let Some(why) = &self.ended {
            return why.clone();
        }
        let status = self.link.status();
        let connection = match &status.connection {
            Connection::Connecting => "connecting".to_owned(),
            Connection::Reading { read, of } => format!("reading {read} of {of}"),
            Connection::Live => "live".to_owned(),
            Connection::Silent => "the server does not answer: you can draw, osp sends it later".to_owned(),
            Connection::Crowded => {
                "too many authors have joined at the same time: you can draw now, osp sends your strokes when a place is free"
                    .to_owned()
            }
            Connection::Full => {
                "the session is full and accepts no more changes: begin one with another name".to_owned()
            }
        };
        let connection = match (status.connection, status.trouble) {
            (Connection::Live, _) | (_, None) => connection,
            (_, Some(why)) => format!("{connection} ({why})"),
        };
        let who = match (self.is_watcher, status.author) {
            (true, _) => ", watching".to_owned(),
            (false, Some(author)) => format!(", you are author {author}"),
            (false, None) => String::new(),
        };
        let there = match status.authors {
            1 => ", 1 author".to_owned(),
            count => format!(", {count} authors"),
        };
        let latency = self.link.latency();
        let latency = match latency.messages {
            0 => String::new(),
            _ => format!(", delay {:.0} ms", latency.p50_us as f64 * 1.0e-3),
        };
        let waiting = match self.waiting.len() {
            0 => String::new(),
            count => format!(", {count} events unconfirmed"),
        };
        let unsaved = match self.own.trouble() {
            Some(why) => format!(", what you draw CANNOT BE SAVED: {why}"),
            None => String::new(),
        };
        format!("{connection}{who}{there}{latency}{waiting}{unsaved}")
    }

    pub(super) fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Whether the server has not returned all of the user's events yet.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }
}

/// A message about another author who has joined or left.
fn coming_or_going(event: &Event, own: Option<Author>) -> Option<String> {
    match event {
        Event::Join { author, name, .. } if Some(*author) != own => Some(match name.as_str() {
            "" => format!("author {author} has come"),
            name => format!("author {author} ({name}) has come"),
        }),
        Event::Leave { author, .. } if Some(*author) != own => Some(format!("author {author} has left")),
        _ => None,
    }
}
