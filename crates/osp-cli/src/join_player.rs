//! Plays a recording into a shared session, as the drawing of one author.

use std::{
    collections::{BTreeSet, HashMap},
    path::Path,
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, ensure};

use super::{reading::ReadArgs, session::OpenSession};
use osp_net::live::{Hand, ME};
use osp_session::recording::{AUTHORS_FORMAT, Author, Event, GroupId, Pace, Pacer, RecordingError, StrokeId};

/// Largest number of this member's events that are not in the session yet. Above this number, playing pauses.
const MOST_PENDING: usize = 1 << 16;

pub(super) struct Playing {
    pacer: Pacer<Box<dyn Iterator<Item = Result<Event, RecordingError>> + Send>>,
    speed: f64,
}

impl Playing {
    pub(super) fn open(
        path: &Path,
        reading: &ReadArgs,
        pace: Pace,
        speed: f64,
        author: Option<u32>,
    ) -> anyhow::Result<Self> {
        let session = OpenSession::open(path, reading)?;
        if author.is_none() && session.header.format >= AUTHORS_FORMAT {
            check_undos(path, reading)?;
        }
        let is_played = move |event: &Event| author.is_none_or(|author| is_of(event, Author(author)));
        let events = session.filter(move |event| event.as_ref().map_or(true, is_played));
        let mut events = events.peekable();
        if let Some(Err(error)) = events.next_if(Result::is_err) {
            return Err(error.into());
        }
        ensure!(
            author.is_none() || events.peek().is_some(),
            "{}: expected events of author {}; found none",
            path.display(),
            author.unwrap_or_default()
        );
        Ok(Self { pacer: Pacer::new(Box::new(events), pace), speed })
    }
}

/// Returns an error if a recording has several authors, and undo or redo events. If this member played all authors, an
/// undo could revert a stroke of a different author.
fn check_undos(path: &Path, reading: &ReadArgs) -> anyhow::Result<()> {
    let (mut authors, mut takes_back) = (BTreeSet::new(), false);
    for event in OpenSession::open(path, reading)? {
        let event = event?;
        authors.extend(event.author());
        takes_back |= matches!(event, Event::Undo { .. } | Event::Redo { .. } | Event::Step { .. });
    }
    ensure!(
        authors.len() < 2 || !takes_back,
        "{}: this recording has several authors and undo events; choose one author with --play-author N",
        path.display()
    );
    Ok(())
}

fn is_of(event: &Event, author: Author) -> bool {
    match event {
        Event::Point { stroke, .. } | Event::End { stroke, .. } => stroke.author() == author,
        _ => event.author() == Some(author),
    }
}

pub(super) fn play(mut playing: Playing, hand: &Hand, is_over: impl Fn() -> bool) -> anyhow::Result<u64> {
    let mut numbers = Numbers::default();
    let (mut events, mut frames, mut played) = (Vec::new(), 0u32, 0);
    let mut started = Instant::now();
    while !is_over() && playing.pacer.next_frame(&mut events)? {
        frames += 1;
        let t = hand.now_secs();
        let mut own = Vec::with_capacity(events.len());
        for event in events.drain(..) {
            own.extend(numbers.own(event, t).context("a member has at most 1,048,576 strokes and groups")?);
        }
        played += own.len() as u64;
        hand.send(own);
        let held = Instant::now();
        while hand.pending() > MOST_PENDING && !is_over() {
            thread::sleep(Duration::from_millis(5));
        }
        started += held.elapsed();
        let due = Duration::from_secs_f64(f64::from(frames) / Pace::FRAMES_A_SECOND / playing.speed);
        thread::sleep(due.saturating_sub(started.elapsed()));
    }
    Ok(played)
}

/// This author's numbers for the strokes and groups of a recording.
#[derive(Debug, Default)]
struct Numbers {
    strokes: HashMap<StrokeId, u32>,
    groups: HashMap<GroupId, u32>,
}

impl Numbers {
    fn stroke(&mut self, id: &mut StrokeId) -> Option<()> {
        let next = self.strokes.len() as u32;
        id.0 = ME.number(*self.strokes.entry(*id).or_insert(next))?;
        Some(())
    }

    fn group(&mut self, id: &mut GroupId) -> Option<()> {
        let next = self.groups.len() as u32;
        id.0 = ME.number(*self.groups.entry(*id).or_insert(next))?;
        Some(())
    }

    /// Returns an event with this author's numbers, at the time `now`. `Some(None)` for joins and leaves of authors.
    /// `None` if all numbers are in use.
    fn own(&mut self, mut event: Event, now: f64) -> Option<Option<Event>> {
        match &mut event {
            Event::Join { .. } | Event::Leave { .. } => return Some(None),
            Event::Head { t, .. }
            | Event::Undo { t, .. }
            | Event::Redo { t, .. }
            | Event::Step { t, .. }
            | Event::Layer { t, .. }
            | Event::View { t, .. }
            | Event::Polygon { t, stroke: None, .. } => *t = now,
            Event::Begin { t, stroke, .. }
            | Event::Point { t, stroke, .. }
            | Event::End { t, stroke }
            | Event::Erase { t, stroke, .. }
            | Event::Polygon { t, stroke: Some(stroke), .. } => {
                *t = now;
                self.stroke(stroke)?;
            }
            Event::Move { t, strokes, .. } | Event::Assign { t, strokes, .. } => {
                *t = now;
                strokes.iter_mut().try_for_each(|stroke| self.stroke(stroke))?;
            }
            Event::Group { t, group, strokes, parent, .. } => {
                *t = now;
                self.group(group)?;
                strokes.iter_mut().try_for_each(|stroke| self.stroke(stroke))?;
                parent.iter_mut().try_for_each(|group| self.group(group))?;
            }
            Event::Place { t, group, .. } => {
                *t = now;
                self.group(group)?;
            }
        }
        Some(Some(event))
    }
}
