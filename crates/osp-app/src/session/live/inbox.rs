//! Events of a shared session that were received but are not in the model yet. A frame applies a bounded number of them.

use std::collections::VecDeque;

use osp_session::recording::Event;

/// Largest number of events that a frame applies, with the lengths of their lists.
pub(super) const EVENTS_A_FRAME: usize = 8192;

#[derive(Debug, Default)]
pub(super) struct Inbox {
    events: VecDeque<Event>,
    /// For each message of the server, the number of its events in `events`, and the number of the user's events that
    /// it answers.
    messages: VecDeque<[usize; 2]>,
}

impl Inbox {
    pub(super) fn has_enough(&self) -> bool {
        self.events.len() >= EVENTS_A_FRAME
    }

    pub(super) fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// Adds a received message. `own` is the number of the user's events that it answers.
    pub(super) fn add(&mut self, events: Vec<Event>, own: usize) {
        self.messages.push_back([events.len(), own]);
        self.events.extend(events);
    }

    pub(super) fn next(&mut self) -> &[Event] {
        let mut room = EVENTS_A_FRAME;
        let fits = |event: &&Event| {
            let had_room = room > 0;
            room = room.saturating_sub(1 + event.list_len());
            had_room
        };
        let count = self.events.iter().take_while(fits).count();
        &self.events.make_contiguous()[..count]
    }

    /// Moves the first events to `out`. Returns the number of the user's events that the completed messages answer.
    pub(super) fn take(&mut self, mut count: usize, out: &mut Vec<Event>) -> usize {
        out.extend(self.events.drain(..count));
        let mut answered = 0;
        while let Some([left, own]) = self.messages.front_mut() {
            if *left > count {
                *left -= count;
                break;
            }
            (count, answered) = (count - *left, answered + *own);
            self.messages.pop_front();
        }
        answered
    }

    pub(super) fn take_all(&mut self) -> Vec<Event> {
        self.messages.clear();
        std::mem::take(&mut self.events).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::{Author, StrokeId};

    #[test]
    fn frames_are_bounded_and_the_order_stays() {
        let end = |n: u32| Event::End { t: 0.0, stroke: StrokeId(n) };
        let vertices = vec![glam::Vec3::ZERO; 2 * EVENTS_A_FRAME];
        let color = (1.0, 1.0, 1.0, 1.0);
        let large =
            Event::Polygon { author: Author(1), t: 0.0, stroke: None, vertices, shading: None, color };
        let mut all: Vec<Event> = (0..2 * EVENTS_A_FRAME as u32 + 3).map(end).collect();
        all.extend([large, end(2)]);
        let mut inbox = Inbox::default();
        inbox.add(all.clone(), 2);
        inbox.add(Vec::new(), 3);
        inbox.add(vec![end(3)], 5);
        all.push(end(3));
        let (mut taken, mut sizes, mut own) = (Vec::new(), Vec::new(), Vec::new());
        while !inbox.is_empty() {
            let count = inbox.next().len();
            own.push(inbox.take(count, &mut taken));
            sizes.push(count);
        }
        assert!(taken == all);
        assert_eq!(sizes, [EVENTS_A_FRAME, EVENTS_A_FRAME, 4, 2]);
        assert_eq!(own, [0, 0, 0, 10]);
        inbox.add(Vec::new(), 1);
        assert_eq!((inbox.next().len(), inbox.take(0, &mut taken)), (0, 1));
        inbox.add(all.clone(), 1);
        assert!(inbox.take_all() == all && inbox.is_empty());
        assert_eq!(inbox.take(0, &mut taken), 0);
    }
}
