//! Several artists scribble in one volume simultaneously, each with their own hand and head. Sometimes an artist moves
//! another artist's last stroke a little, and sometimes undoes the move.

use std::collections::VecDeque;

use glam::Vec3;

use crate::recording::{Author, Event, EventSource, GroupId, RecordingError, Session, StrokeId};

/// Time from the beginning of one artist to that of the next, seconds.
const LATER_SECS: f64 = 2.0;

/// One of this number of head poses is kept: ten a second are enough to show where each artist looks.
const HEADS: u32 = 3;

const STROKES_A_MOVE: u32 = 5;

/// Translation of a stroke that another artist moves, metres.
const NUDGE: Vec3 = Vec3::new(0.0, 0.0625, 0.0);

/// An artist, and that artist's next event.
struct Pupil {
    author: Author,
    session: Session,
    next: Option<Event>,
    heads: u32,
    is_there: bool,
    /// Whether a redo may follow, because the last edit was undone. Another edit would make the redo impossible.
    may_redo: bool,
    last_secs: f64,
}

/// A merge of the artists' sessions in order of time.
pub(super) struct Class {
    pupils: Vec<Pupil>,
    queue: VecDeque<Event>,
}

impl Class {
    /// Merges one session per artist; the artists are numbered in order.
    pub(super) fn new(sessions: impl Iterator<Item = Session>) -> Self {
        let pupil = |(n, session): (u32, Session)| Pupil {
            author: Author(n),
            session,
            next: None,
            heads: 0,
            is_there: false,
            may_redo: false,
            last_secs: 0.0,
        };
        let mut pupils: Vec<Pupil> = (1..).zip(sessions).map(pupil).collect();
        // All first events are read at the start, because the merge needs the earliest of them.
        pupils.iter_mut().for_each(Pupil::read);
        Self { pupils, queue: VecDeque::new() }
    }

    /// Moves a stroke that another artist has just drawn.
    fn nudge(&mut self, stroke: StrokeId, t: f64) {
        let n = stroke.0 & ((1 << Author::NUMBER_BITS) - 1);
        let others = self.pupils.len();
        let by = &self.pupils[stroke.author().0 as usize % others];
        if n % STROKES_A_MOVE != 1 || by.author == stroke.author() || !by.is_there || by.may_redo {
            return;
        }
        let author = by.author;
        self.queue.push_back(Event::Move { t, author, strokes: vec![stroke], by: NUDGE });
        if n % (2 * STROKES_A_MOVE) != 1 {
            self.queue.push_back(Event::Undo { t, author });
        }
    }
}

impl Pupil {
    /// Reads the next event to keep, and assigns it to this author.
    fn read(&mut self) {
        self.next = loop {
            // A synthetic session never has damage, so an error cannot occur.
            let Some(Ok(event)) = self.session.next() else { break None };
            if matches!(event, Event::Head { .. }) {
                self.heads += 1;
                if self.heads % HEADS != 1 {
                    continue;
                }
            }
            break Some(event.of(self.author, LATER_SECS * f64::from(self.author.0 - 1)));
        };
    }
}

impl EventSource for Class {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        if let Some(event) = self.queue.pop_front() {
            return Ok(Some(event));
        }
        let time = |pupil: &Pupil| pupil.next.as_ref().map_or(pupil.last_secs, Event::time_secs);
        let waiting =
            self.pupils.iter().enumerate().filter(|(_, pupil)| pupil.is_there || pupil.next.is_some());
        let Some((at, _)) = waiting.min_by(|(_, a), (_, b)| time(a).total_cmp(&time(b))) else {
            return Ok(None);
        };
        let pupil = &mut self.pupils[at];
        let author = pupil.author;
        if !pupil.is_there {
            pupil.is_there = true;
            let (name, color) = NAMES[(author.0 as usize - 1) % NAMES.len()];
            let t = LATER_SECS * f64::from(author.0 - 1);
            return Ok(Some(Event::Join { t, author, name: name.to_owned(), color: Some(color) }));
        }
        let Some(event) = pupil.next.take() else {
            pupil.is_there = false;
            return Ok(Some(Event::Leave { t: pupil.last_secs, author }));
        };
        pupil.last_secs = event.time_secs();
        match event {
            Event::Undo { .. } => pupil.may_redo = true,
            Event::Head { .. } | Event::Point { .. } | Event::End { .. } => {}
            _ => pupil.may_redo = false,
        }
        pupil.read();
        if let Event::End { stroke, t } = event {
            self.nudge(stroke, t);
        }
        Ok(Some(event))
    }
}

/// Names and colours of the artists. Further artists get them again from the start.
const NAMES: [(&str, (f32, f32, f32)); 6] = [
    ("Ada", (0.0, 0.45, 0.7)),
    ("Ben", (0.9, 0.6, 0.0)),
    ("Cho", (0.0, 0.6, 0.5)),
    ("Dag", (0.8, 0.4, 0.0)),
    ("Eva", (0.8, 0.6, 0.7)),
    ("Fay", (0.35, 0.7, 0.9)),
];

impl Event {
    /// Returns the event with the author `by`, `later_secs` later. Strokes and groups get the author's numbers.
    fn of(self, by: Author, later_secs: f64) -> Self {
        let number = |n: u32| by.number(n).unwrap_or(u32::MAX);
        let of = |StrokeId(n): StrokeId| StrokeId(number(n));
        let all = |strokes: Vec<StrokeId>| strokes.into_iter().map(of).collect();
        let mut event = self;
        match &mut event {
            Self::Begin { t, author, stroke, .. } | Self::Erase { t, author, stroke } => {
                (*t, *author, *stroke) = (*t + later_secs, by, of(*stroke));
            }
            Self::Point { t, stroke, .. } | Self::End { t, stroke } => {
                (*t, *stroke) = (*t + later_secs, of(*stroke));
            }
            Self::Move { t, author, strokes, .. } | Self::Assign { t, author, strokes, .. } => {
                (*t, *author, *strokes) = (*t + later_secs, by, all(std::mem::take(strokes)));
            }
            Self::Group { t, author, group, strokes, parent, .. } => {
                (*t, *author, *strokes) = (*t + later_secs, by, all(std::mem::take(strokes)));
                *group = GroupId(number(group.0));
                *parent = parent.map(|parent| GroupId(number(parent.0)));
            }
            Self::Place { t, author, group, .. } => {
                (*t, *author, *group) = (*t + later_secs, by, GroupId(number(group.0)));
            }
            Self::Polygon { t, author, stroke, .. } => {
                (*t, *author, *stroke) = (*t + later_secs, by, stroke.map(of));
            }
            Self::Join { t, author, .. }
            | Self::Leave { t, author }
            | Self::Head { t, author, .. }
            | Self::Undo { t, author }
            | Self::Redo { t, author }
            | Self::Step { t, author, .. }
            | Self::Layer { t, author, .. }
            | Self::View { t, author, .. } => (*t, *author) = (*t + later_secs, by),
        }
        event
    }
}
