//! Events of a shared session that were received but are not in the model yet. The model takes them piece by piece, so
//! that a burst of events does not stall a frame.

use std::collections::VecDeque;

use super::super::model::PIECE;
use osp_session::recording::Event;

/// Events in order of arrival. New events are added only to an empty inbox.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    events: VecDeque<Event>,
    /// Number of the user's events in `events`.
    own: usize,
}

impl Inbox {
    /// Whether the inbox has no events.
    pub(super) fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// Adds received events. `own` is the number of the user's events among them.
    pub(super) fn add(&mut self, events: Vec<Event>, own: usize) {
        self.events.extend(events);
        self.own += own;
    }

    /// Moves the next piece to `out`. For the last piece, returns the number of the user's events; for all other
    /// pieces, 0.
    pub(super) fn take_piece(&mut self, out: &mut Vec<Event>) -> usize {
        let mut room = PIECE;
        while let Some(event) = self.events.front() {
            let weight = weight(event);
            if weight > room && !out.is_empty() {
                break;
            }
            room = room.saturating_sub(weight);
            out.extend(self.events.pop_front());
        }
        if self.events.is_empty() { std::mem::take(&mut self.own) } else { 0 }
    }

    /// Removes and returns all events.
    pub(super) fn take_all(&mut self) -> Vec<Event> {
        self.own = 0;
        std::mem::take(&mut self.events).into()
    }
}

/// The size of an event; the sizes in a piece add up to at most [`PIECE`]. A drawing event counts by its length. An
/// edit counts as a whole piece, because a short event may change the whole model.
fn weight(event: &Event) -> usize {
    match event {
        Event::Erase { .. }
        | Event::Undo { .. }
        | Event::Redo { .. }
        | Event::Move { .. }
        | Event::Group { .. }
        | Event::Place { .. }
        | Event::Layer { .. }
        | Event::Assign { .. }
        | Event::Leave { .. } => PIECE,
        Event::Join { .. }
        | Event::Head { .. }
        | Event::Begin { .. }
        | Event::Point { .. }
        | Event::End { .. }
        | Event::Step { .. }
        | Event::View { .. }
        | Event::Polygon { .. } => 1 + event.list_len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::{Author, StrokeId};

    #[test]
    fn pieces_are_bounded_edits_are_alone_and_the_order_stays() {
        let end = |n: u32| Event::End { t: 0.0, stroke: StrokeId(n) };
        let undo = || Event::Undo { author: Author(1), t: 0.0 };
        let vertices = vec![glam::Vec3::ZERO; 2 * PIECE];
        let color = (1.0, 1.0, 1.0, 1.0);
        let large = Event::Polygon { author: Author(1), t: 0.0, stroke: None, vertices, color };
        let mut all: Vec<Event> = (0..2 * PIECE as u32 + 3).map(end).collect();
        all.extend([undo(), undo(), end(1), large.clone(), end(2)]);
        let mut inbox = Inbox::default();
        inbox.add(all.clone(), 2);
        inbox.add(vec![end(3)], 5);
        all.push(end(3));
        let (mut taken, mut sizes, mut own) = (Vec::new(), Vec::new(), Vec::new());
        while !inbox.is_empty() {
            let mut piece = Vec::new();
            own.push(inbox.take_piece(&mut piece));
            sizes.push(piece.len());
            taken.extend(piece);
        }
        assert!(taken == all);
        assert_eq!(sizes, [PIECE, PIECE, 3, 1, 1, 1, 1, 2]);
        assert_eq!(own, [0, 0, 0, 0, 0, 0, 0, 7]);
        let mut none = Vec::new();
        assert_eq!((inbox.take_piece(&mut none), none.len()), (0, 0));
        inbox.add(all.clone(), 1);
        assert!(inbox.take_all() == all && inbox.is_empty());
        assert_eq!(inbox.take_piece(&mut none), 0);
    }
}
