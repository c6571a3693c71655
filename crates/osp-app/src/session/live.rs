//! A session that several people draw at once, in the window: own events go to the others and come back in the order that
//! counts for all; until then they are shown over the model.

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

use crate::{
    journal::{Autosaves, Journal},
    turns::Turns,
};
use inbox::Inbox;
pub use joining::Unjoined;
use known::Known;
use osp_net::live::{Address, Connection, Link, LinkOptions, LiveError, ME, News, Role, Status};
use osp_session::{
    platform::time::Instant,
    recording::{Author, Event, Header, ONE_AUTHOR_FORMAT, RecordingError, StrokeId},
    scene::Scene,
};
pub use overlay::Overlay;

/// How often the files are looked after.
const TEND: Duration = Duration::from_millis(500);

/// What somebody else draws with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherPen {
    /// Whose it is.
    pub author: Author,
    /// The last point, world space.
    pub at: Vec3,
}

/// The connection to the others who draw in a session.
#[derive(Debug)]
pub struct Live {
    link: Link,
    has_news: Arc<AtomicBool>,
    /// Something was taken after the panels of that frame were laid out.
    was_taken: bool,
    /// Events that have arrived and are not in the model.
    inbox: Inbox,
    /// How long each frame takes events from it.
    turns: Turns,
    /// The last slice left something for the next one.
    is_behind: bool,
    session: String,
    is_watcher: bool,
    /// Own events that are not in the session, the oldest first.
    waiting: VecDeque<Event>,
    /// All own events: whatever becomes of this program, what was drawn without a server is in a file.
    own: Journal,
    overlay: Overlay,
    /// What the session's file held before.
    known: Option<Known>,
    /// Own strokes whose erasing is on its way.
    erasing: BTreeSet<StrokeId>,
    /// Own events that will never be in the session, and strokes that came too late for their layer.
    refused: usize,
    /// The authors that this window has been.
    own_authors: BTreeSet<Author>,
    /// The next own stroke or group.
    next: u32,
    /// Each author's stroke that has not ended, and its last point.
    pens: BTreeMap<Author, (StrokeId, Option<Vec3>)>,
    /// As it was told last.
    told: Status,
    tended_at: Option<Instant>,
    /// Why nothing comes any more.
    ended: Option<String>,
    has_left: bool,
}

impl Live {
    /// Begins to take part.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn join(address: &Address, options: &LinkOptions, autosaves: &Autosaves) -> Result<Self, LiveError> {
        let has_news = Arc::new(AtomicBool::new(false));
        let of_link = Arc::clone(&has_news);
        let session = address.session().to_owned();
        let name = format!("{session}-own");
        let header = Header {
            format: ONE_AUTHOR_FORMAT,
            ..Header::new(&name, concat!("osp sketch ", env!("CARGO_PKG_VERSION"), ", in a shared session"))
        };
        Ok(Self {
            link: Link::open(address, options, move || of_link.store(true, Relaxed))?,
            has_news,
            was_taken: false,
            inbox: Inbox::default(),
            turns: Turns::default(),
            is_behind: false,
            own: Journal::unnamed(autosaves, &name, header).expect("a header without numbers is sound"),
            session,
            is_watcher: options.role == Role::Watcher,
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

    /// Whether something has come, or was taken, or the connection is another one, since the last call.
    pub(crate) fn take_note(&mut self) -> bool {
        let status = self.link.status();
        let of = |status: &Status| (status.connection.clone(), status.trouble.clone(), status.authors);
        let is_other = of(&status) != of(&self.told);
        self.told = status;
        is_other | self.has_news.swap(false, Relaxed) | std::mem::take(&mut self.was_taken)
    }

    /// Looks after the file of own events; whether it is time to look after others, too.
    pub(super) fn tend(&mut self, now: Instant, said: &mut Vec<String>) -> bool {
        let is_time = self.tended_at.is_none_or(|at| now.saturating_duration_since(at) >= TEND);
        if is_time {
            self.tended_at = Some(now);
            self.own.tend(now);
            said.append(&mut self.own.take_news());
        }
        is_time
    }

    /// The journal of own events.
    pub(super) fn own_mut(&mut self) -> &mut Journal {
        &mut self.own
    }

    /// Whether a stroke is being erased already.
    pub(super) fn is_erasing(&self, stroke: StrokeId) -> bool {
        self.erasing.contains(&stroke)
    }

    /// The name of the session.
    pub fn session(&self) -> &str {
        &self.session
    }

    /// Whether nothing can be drawn: one only looks, or has had all numbers of an author.
    pub fn is_watcher(&self) -> bool {
        self.is_watcher || ME.number(self.next).is_none()
    }

    /// Own strokes that are on their way.
    pub fn overlay(&self) -> &Overlay {
        &self.overlay
    }

    /// Own strokes that are on their way.
    pub(crate) fn overlay_mut(&mut self) -> &mut Overlay {
        &mut self.overlay
    }

    /// The time of own events, seconds.
    pub(super) fn now_secs(&self) -> f64 {
        self.link.hand().now_secs()
    }

    /// A number for an own stroke or group that was not used yet.
    pub(super) fn new_number(&mut self) -> u32 {
        let Some(number) = ME.number(self.next) else { return ME.number(0).unwrap_or_default() };
        self.next += 1;
        number
    }

    /// Takes an own event, which [`Live::send`] sends.
    ///
    /// # Errors
    /// No session can hold it.
    pub(super) fn push(&mut self, event: &Event) -> Result<(), RecordingError> {
        // The file of own events is one author's: nobody else is to be kept from a layer there.
        let mut alone = event.names_author().then(|| event.clone());
        if let Some(Event::Layer { mine, .. }) = &mut alone {
            *mine = None;
        }
        self.own.push(alone.as_ref().unwrap_or(event))
    }

    /// Sends own events.
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

    /// Whether the last slice may have left something for the next one.
    pub(super) fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// Puts the session's next piece into `out`, without the events that the file has already. Adds the messages for people to
    /// `said`. Returns whether there was a piece.
    fn take_piece(&mut self, out: &mut Vec<Event>, said: &mut Vec<String>) -> bool {
        if self.inbox.is_empty() {
            self.fetch(said);
        }
        if self.ended.is_some() || self.inbox.is_empty() {
            return false;
        }
        let Status { author, has_caught_up, .. } = self.link.status();
        self.was_taken = true;
        out.clear();
        let own = self.inbox.take_piece(out);
        self.settle(own);
        out.iter().for_each(|event| self.note(event));
        if has_caught_up {
            said.extend(out.iter().filter_map(|event| coming_or_going(event, author)));
        }
        self.pass_over_known(out, said);
        true
    }

    /// Removes the events that the file has already. If the file has other events, removes all; no more come.
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

    /// The next events that are not in the model, for the file, when the window leaves the session.
    fn take_rest(&mut self, said: &mut Vec<String>) -> Option<Vec<Event>> {
        if self.inbox.is_empty() {
            self.fetch(said);
        }
        let mut rest = self.inbox.take_all();
        if rest.is_empty() {
            return None;
        }
        self.pass_over_known(&mut rest, said);
        Some(rest)
    }

    /// Puts the next events into the inbox, if some have arrived, and handles all news before them.
    fn fetch(&mut self, said: &mut Vec<String>) {
        let has_caught_up = self.link.status().has_caught_up;
        while self.inbox.is_empty() && self.ended.is_none() {
            match self.link.news() {
                Ok(None) => {
                    // All that the server has was read, and the file has more.
                    if has_caught_up && let Some(known) = &self.known {
                        let why = known.is_other();
                        self.refuse(why, said);
                    }
                    break;
                }
                Ok(Some(News::Events { events, own })) if events.is_empty() => self.settle(own),
                Ok(Some(News::Events { events, own })) => self.inbox.add(events, own),
                Ok(Some(News::Refused { why, own })) => {
                    self.settle(own);
                    (self.refused, self.was_taken) = (self.refused + own, true);
                    said.push(format!("{own} of your events are not in the session: {why}"));
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

    /// Counts own strokes that the model does not have although the session does: their layer was closed before they were heard
    /// of. What to say of them.
    fn note_left_out(&mut self, events: &[Event], scene: &Scene) -> Option<String> {
        let is_left_out = |event: &&Event| {
            matches!(event, Event::Begin { author, stroke, .. }
                if self.own_authors.contains(author) && !scene.is_used(*stroke))
        };
        let count = events.iter().filter(is_left_out).count();
        self.refused += count;
        let path = self.own.path().display();
        (count > 0).then(|| {
            format!("{count} of your strokes are not in the model, for their layer has become another author's alone: {path} has them")
        })
    }

    /// The session is not that of the file: nothing is appended to it.
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

    /// Finds what of the own strokes is shown over the session's scene.
    pub(super) fn show_own(&mut self, scene: &Scene) {
        let author = self.link.status().author;
        self.overlay.show(|own| {
            let number = author.and_then(|author| author.number(own.0 & ((1 << Author::NUMBER_BITS) - 1)));
            let stroke = number.and_then(|number| scene.stroke(StrokeId(number)));
            stroke.map_or(0, |stroke| stroke.polygon_ids().count())
        });
    }

    /// What others are drawing with now.
    pub fn pens(&self) -> impl Iterator<Item = OtherPen> + '_ {
        let own = self.told.author;
        let others = self.pens.iter().filter(move |(author, _)| Some(**author) != own);
        others.filter_map(|(&author, (_, at))| Some(OtherPen { author, at: (*at)? }))
    }

    /// What is known of the connection.
    pub fn status(&self) -> Status {
        self.link.status()
    }

    /// The state of the connection, for people.
    pub fn shown(&self) -> String {
        if let Some(why) = &self.ended {
            return why.clone();
        }
        let status = self.link.status();
        let connection = match &status.connection {
            Connection::Connecting => "connecting".to_owned(),
            Connection::Reading { read, of } => format!("reading {read} of {of}"),
            Connection::Live => "live".to_owned(),
            Connection::Silent => "the server does not answer: you draw on, it is sent later".to_owned(),
            Connection::Crowded => {
                "too many have joined at once: you draw on, and join once there is room".to_owned()
            }
            Connection::Full => {
                "the session is full, nothing more is taken: begin one of another name".to_owned()
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
        let there = format!(", {} here", status.authors);
        let latency = self.link.latency();
        let latency = match latency.messages {
            0 => String::new(),
            _ => format!(", {:.0} ms", latency.p50_us as f64 * 1.0e-3),
        };
        let waiting = match self.waiting.len() {
            0 => String::new(),
            count => format!(", {count} events on their way"),
        };
        let unsaved = match self.own.trouble() {
            Some(why) => format!(", what you draw CANNOT BE SAVED: {why}"),
            None => String::new(),
        };
        format!("{connection}{who}{there}{latency}{waiting}{unsaved}")
    }

    /// Own events that are not in the session.
    pub(super) fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Whether something of one's own is not in the session.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }
}

/// Who has come or gone, in words; not oneself.
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
