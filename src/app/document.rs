mod opening;

use std::path::Path;

use super::journal::{Journal, SaveError, Unwritten};
use crate::{
    math::{Aabb, Ray},
    recording::{Event, EventSource, Header, RecordingError, StrokeId},
    scene::{Change, PolygonId, Scene},
};

pub use opening::{Access, OpenError, Opened, Opening};

/// A session being drawn: the model, and the file in which every event is before the next one comes.
#[derive(Debug)]
pub struct Document {
    scene: Scene,
    /// Since they were last taken.
    changes: Vec<Change>,
    bounds: Aabb,
    journal: Journal,
    numbers: FreeNumbers,
    last_secs: f64,
    events: u64,
    refused: u64,
    news: Vec<String>,
}

/// Numbers for new strokes, from `next` up to before `end`.
#[derive(Clone, Copy, Debug)]
struct FreeNumbers {
    next: u64,
    end: u64,
}

impl FreeNumbers {
    const ALL: Self = Self { next: 0, end: 1 << 32 };

    fn note(&mut self, used: StrokeId) {
        let used = u64::from(used.0);
        if (self.next..self.end).contains(&used) {
            self.next = used + 1;
        }
    }

    fn take(&mut self) -> Option<StrokeId> {
        let number = u32::try_from(self.next).ok().filter(|_| self.next < self.end)?;
        self.next += 1;
        Some(StrokeId(number))
    }

    /// The widest gap between numbers that are used. The last number of all is among the used ones.
    fn widest_gap(mut used: Vec<u32>) -> Self {
        used.push(u32::MAX);
        used.sort_unstable();
        let mut widest = Self { next: 0, end: 0 };
        let mut next = 0;
        for number in used.into_iter().map(u64::from) {
            if number.saturating_sub(next) > widest.end - widest.next {
                widest = Self { next, end: number };
            }
            next = next.max(number + 1);
        }
        widest
    }
}

impl Document {
    fn around(journal: Journal) -> Self {
        Self {
            scene: Scene::new(),
            changes: Vec::new(),
            bounds: Aabb::EMPTY,
            journal,
            numbers: FreeNumbers::ALL,
            last_secs: 0.0,
            events: 0,
            refused: 0,
            news: Vec::new(),
        }
    }

    /// Takes an event that was read.
    fn read(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.journal.note(event)?;
        self.note(event);
        Ok(())
    }

    /// A crash leaves strokes without an end; nobody draws on them any more. The file hears of it with the first event
    /// that is drawn.
    fn end_open_strokes(&mut self) {
        let t = self.last_secs;
        let open =
            self.scene.strokes().iter().filter(|stroke| stroke.is_open()).filter_map(|stroke| stroke.id());
        let ends: Vec<Event> = open.map(|stroke| Event::End { t, stroke }).collect();
        for event in ends {
            // An end is never too long for a line.
            if self.journal.note(&event).is_ok() {
                self.note(&event);
            }
        }
    }

    /// Makes the model follow an event.
    fn note(&mut self, event: &Event) {
        self.last_secs = self.last_secs.max(event.time_secs());
        if let Event::Begin { stroke, .. } | Event::Polygon { stroke: Some(stroke), .. } = event {
            self.numbers.note(*stroke);
        }
        self.events += 1;
        let first = self.changes.len();
        self.scene.apply(event, &mut self.changes);
        for change in &self.changes[first..] {
            if let Change::Insert(id) | Change::Update(id) = *change {
                self.bounds = self.bounds.union(self.scene.bounds(id));
            }
        }
    }

    /// Takes an event that is being made: into the file, into the model. Returns whether it was one that a session
    /// can hold, and this one may be drawn on.
    pub fn apply(&mut self, event: Event) -> bool {
        if self.is_read_only() {
            return false;
        }
        if let Err(error) = self.journal.write(&event) {
            if self.refused == 0 {
                self.news.push(format!("left out, the first of what no session can hold: {error}"));
            }
            self.refused += 1;
            return false;
        }
        self.note(&event);
        true
    }

    /// A stroke number that was not used yet.
    pub fn new_stroke(&mut self) -> StrokeId {
        if let Some(number) = self.numbers.take() {
            return number;
        }
        // The last number is used. Far fewer strokes than numbers fit into memory, so there is a gap.
        let used = self.used_numbers().unwrap_or_else(|_| {
            self.scene.strokes().iter().filter_map(|stroke| stroke.id()).map(|id| id.0).collect()
        });
        self.numbers = FreeNumbers::widest_gap(used);
        self.numbers.take().unwrap_or(StrokeId(u32::MAX))
    }

    fn used_numbers(&self) -> Result<Vec<u32>, RecordingError> {
        let mut reader = self.journal.read()?;
        let mut used = Vec::new();
        while let Some(event) = reader.next_event()? {
            if let Event::Begin { stroke, .. } | Event::Polygon { stroke: Some(stroke), .. } = event {
                used.push(stroke.0);
            }
        }
        Ok(used)
    }

    /// Whether the session is only looked at.
    pub fn is_read_only(&self) -> bool {
        self.journal.is_read_only()
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
        out.append(&mut self.changes);
    }

    /// Box of everything that was ever drawn.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What the session says of itself.
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

    /// What there is to tell since this was last called.
    pub fn take_news(&mut self) -> Vec<String> {
        let mut news = std::mem::take(&mut self.news);
        news.append(&mut self.journal.take_news());
        news
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

    /// Writes the session at `to` and goes on there. A file that is there is replaced.
    ///
    /// # Errors
    /// The file cannot be written; the session goes on where it was.
    pub fn save_as(&mut self, to: &Path) -> Result<(), SaveError> {
        self.journal.save_as(to)
    }

    /// Makes the session, and its file, what it was when it was opened or last saved under a name.
    ///
    /// # Errors
    /// There is no memory to read it again; nothing has changed.
    pub fn discard(&mut self) -> Result<(), RecordingError> {
        let events = self.journal.discard()?;
        (self.scene, self.bounds) = (Scene::new(), Aabb::EMPTY);
        (self.numbers, self.last_secs, self.events) = (FreeNumbers::ALL, 0.0, 0);
        self.changes.clear();
        for event in &events {
            self.note(event);
        }
        self.end_open_strokes();
        Ok(())
    }

    /// Ends the session on purpose.
    ///
    /// # Errors
    /// Something of it is not where it should be.
    pub fn close(self) -> Result<(), Unwritten> {
        self.journal.close()
    }
}

/// Where a ray meets a polygon, from either side.
pub(super) fn meet_polygon(scene: &Scene, id: PolygonId, ray: &Ray) -> Option<f32> {
    scene.polygon(id).meet(ray)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_from_the_widest_gap_when_the_last_is_used() {
        let gap = |used: &[u32]| {
            let gap = FreeNumbers::widest_gap(used.to_vec());
            (gap.next, gap.end)
        };
        let last = u64::from(u32::MAX);
        assert_eq!(gap(&[]), (0, last));
        assert_eq!(gap(&[u32::MAX]), (0, last));
        assert_eq!(gap(&[0, 1, 5, 5]), (6, last));
        assert_eq!(gap(&[u32::MAX - 1, 7, 3_000_000_000]), (8, 3_000_000_000));
        let mut numbers = FreeNumbers::ALL;
        numbers.note(StrokeId(u32::MAX));
        assert_eq!(numbers.take(), None);
        let mut numbers = FreeNumbers::widest_gap(vec![2]);
        numbers.end = 5;
        assert_eq!(
            [numbers.take(), numbers.take(), numbers.take()],
            [Some(StrokeId(3)), Some(StrokeId(4)), None]
        );
    }
}
