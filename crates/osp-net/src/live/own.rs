//! Numbers of this member's strokes and groups. The member draws before it has an author number, and may get another author
//! number after a long silence. Until they are sent, its strokes and groups belong to the author [`ME`].

use std::collections::{BTreeMap, BTreeSet};

use osp_session::recording::{Author, Event, GroupId, StrokeId};

/// The author of a member's own strokes and groups before they are sent; `ME.number(n)` is the number of the `n`th
/// stroke or group. No shared session has so many authors.
pub const ME: Author = Author(Author::MAX - 1);

/// The authors under which the log has this member's strokes and groups, and the strokes that are being drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Own {
    strokes: BTreeMap<u32, Author>,
    groups: BTreeMap<u32, Author>,
    /// Unfinished strokes in the log, with their beginning and their last point.
    open: BTreeMap<u32, (Event, Option<Event>)>,
    /// Unfinished strokes of an author that was declared gone, until they continue.
    interrupted: BTreeMap<u32, (Event, Option<Event>)>,
    /// Strokes that consist of faces. Such strokes have no end.
    faces: BTreeSet<u32>,
    /// Strokes of faces whose author was declared gone.
    old_faces: BTreeSet<u32>,
}

fn own_number(number: u32) -> u32 {
    number & ((1 << Author::NUMBER_BITS) - 1)
}

fn shared(number: u32, known: &BTreeMap<u32, Author>, author: Author) -> u32 {
    if Author(number >> Author::NUMBER_BITS) != ME {
        return number;
    }
    let n = own_number(number);
    let of = known.get(&n).copied().unwrap_or(author);
    of.number(n).unwrap_or(number)
}

impl Own {
    /// An event of this member in the form of the log, with its author and with its time shifted.
    pub(super) fn event(&self, event: &Event, author: Author, later_secs: f64) -> Event {
        let mut event = event.clone();
        let stroke = |id: &mut StrokeId| id.0 = shared(id.0, &self.strokes, author);
        let group = |id: &mut GroupId| id.0 = shared(id.0, &self.groups, author);
        match &mut event {
            Event::Join { author: of, .. }
            | Event::Leave { author: of, .. }
            | Event::Head { author: of, .. }
            | Event::Undo { author: of, .. }
            | Event::Redo { author: of, .. }
            | Event::Step { author: of, .. }
            | Event::Layer { author: of, .. }
            | Event::View { author: of, .. }
            | Event::Polygon { author: of, stroke: None, .. } => *of = author,
            Event::Point { stroke: id, .. } | Event::End { stroke: id, .. } => stroke(id),
            Event::Begin { author: of, stroke: id, .. }
            | Event::Erase { author: of, stroke: id, .. }
            | Event::Polygon { author: of, stroke: Some(id), .. } => {
                *of = author;
                stroke(id);
            }
            Event::Move { author: of, strokes, .. } | Event::Assign { author: of, strokes, .. } => {
                *of = author;
                strokes.iter_mut().for_each(stroke);
            }
            Event::Group { author: of, group: id, strokes, parent, .. } => {
                *of = author;
                group(id);
                strokes.iter_mut().for_each(stroke);
                parent.iter_mut().for_each(group);
            }
            Event::Place { author: of, group: id, .. } => {
                *of = author;
                group(id);
            }
        }
        // The time is rounded to a tenth of a millisecond, so that its text is short.
        let t = ((event.time_secs() + later_secs).max(0.0) * 1.0e4).round() / 1.0e4;
        *time_of(&mut event) = t;
        event
    }

    /// Records that an event of this author counts in the log.
    pub(super) fn taken(&mut self, event: &Event, author: Author) {
        match event {
            Event::Begin { stroke, .. } => {
                let n = own_number(stroke.0);
                self.strokes.entry(n).or_insert(author);
                self.open.insert(n, (event.clone(), None));
            }
            Event::Point { stroke, .. } => {
                if let Some((_, last)) = self.open.get_mut(&own_number(stroke.0)) {
                    *last = Some(event.clone());
                }
            }
            Event::End { stroke, .. } => _ = self.open.remove(&own_number(stroke.0)),
            Event::Polygon { stroke: Some(stroke), .. } => {
                let n = own_number(stroke.0);
                self.strokes.entry(n).or_insert(author);
                self.faces.insert(n);
            }
            Event::Group { group, .. } if group.author() == ME => {
                self.groups.entry(own_number(group.0)).or_insert(author);
            }
            _ => {}
        }
    }

    /// Records that the author was declared gone, which ends its strokes for all members. A stroke that this member
    /// continues later gets the member's next author number.
    pub(super) fn interrupt(&mut self) {
        self.interrupted.append(&mut self.open);
        self.old_faces.append(&mut self.faces);
    }

    /// Prepares an event that was not sent yet. Returns the events to send before it, and the event. A stroke that was
    /// interrupted begins again before its next point. `None` if nothing has to be sent, because the event ends a
    /// stroke that has ended already.
    pub(super) fn admit(&mut self, event: Event) -> Option<(Vec<Event>, Event)> {
        let mut before = Vec::new();
        match &event {
            Event::Point { stroke, .. } => {
                let n = own_number(stroke.0);
                if let Some((begin, last)) = self.interrupted.remove(&n) {
                    self.strokes.remove(&n);
                    before.extend([Some(begin), last].into_iter().flatten());
                }
            }
            Event::End { stroke, .. } if self.interrupted.remove(&own_number(stroke.0)).is_some() => {
                return None;
            }
            Event::Polygon { stroke: Some(stroke), .. } => {
                let n = own_number(stroke.0);
                if self.old_faces.remove(&n) {
                    self.strokes.remove(&n);
                }
            }
            _ => {}
        }
        Some((before, event))
    }
}

fn time_of(event: &mut Event) -> &mut f64 {
    match event {
        Event::Join { t, .. }
        | Event::Leave { t, .. }
        | Event::Head { t, .. }
        | Event::Begin { t, .. }
        | Event::Point { t, .. }
        | Event::End { t, .. }
        | Event::Erase { t, .. }
        | Event::Undo { t, .. }
        | Event::Redo { t, .. }
        | Event::Move { t, .. }
        | Event::Group { t, .. }
        | Event::Place { t, .. }
        | Event::Step { t, .. }
        | Event::Layer { t, .. }
        | Event::Assign { t, .. }
        | Event::View { t, .. }
        | Event::Polygon { t, .. } => t,
    }
}
