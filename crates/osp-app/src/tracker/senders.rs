use std::collections::BTreeMap;
use std::net::SocketAddr;

use glam::Vec3;

use super::{Hands, Message, admittance::Admittance};
use osp_session::{
    platform::time::Instant,
    recording::{Author, Event, StrokeId},
    scene::Scene,
};

/// Senders of a tracker's messages. Each sender is an author of the session with its own hands, strokes and undo. A
/// sender joins with its first message, and leaves after five seconds without a message. A sender that returns becomes
/// another author.
#[derive(Clone, Debug, Default)]
pub struct Senders {
    present: BTreeMap<SocketAddr, Sender>,
    /// The last author who joined through this tracker.
    last: Author,
}

#[derive(Clone, Debug)]
struct Sender {
    author: Author,
    hands: Hands,
    /// Number of strokes that the sender has begun.
    strokes: u32,
    received: Instant,
}

impl Senders {
    /// Processes a message of the sender `from`, like [`Hands::take`]. `at` is the message's time of arrival, `t` the
    /// session's time. Returns the author and the point at which the message erases; `None` if the session can have no
    /// more authors.
    pub fn take(
        &mut self,
        (from, at): (SocketAddr, Instant),
        t: f64,
        message: &Message,
        scene: &Scene,
        out: &mut Vec<Event>,
    ) -> Option<(Author, Option<Vec3>)> {
        if self.present.get(&from).is_some_and(|sender| sender.author.number(sender.strokes).is_none()) {
            // All numbers of the author are used, so the sender's further strokes belong to another author.
            self.leave(from, t, out);
        }
        if !self.present.contains_key(&from) {
            let last = scene.authors().map(|(author, _)| author).max().unwrap_or_default().max(self.last);
            let author = Some(Author(last.0 + 1)).filter(|next| next.is_valid())?;
            self.last = author;
            out.push(Event::Join { t, author, name: from.to_string(), color: None });
            let hands = Hands::default().of_author(author);
            self.present.insert(from, Sender { author, hands, strokes: 0, received: at });
        }
        let Sender { author, hands, strokes, received } = self.present.get_mut(&from)?;
        *received = at.max(*received);
        let next_stroke = || {
            *strokes += 1;
            StrokeId(author.number(*strokes - 1).expect("looked at above: a message begins one stroke"))
        };
        Some((*author, hands.take(t, message, next_stroke, out)))
    }

    /// The present author with the lowest number who has sent a head pose.
    pub fn first_with_head(&self) -> Option<Author> {
        let with_head = self.present.values().filter(|sender| sender.hands.head().is_some());
        with_head.map(|sender| sender.author).min()
    }

    /// Ends the strokes of hands that have been inactive for too long, and removes inactive senders.
    pub fn rest(&mut self, now: Instant, t: f64, out: &mut Vec<Event>) {
        for sender in self.present.values_mut() {
            sender.hands.rest(t, out);
        }
        self.leave_if(|sender| now.saturating_duration_since(sender.received) >= Admittance::SILENCE, t, out);
    }

    /// Removes all senders, because their later strokes belong to another session.
    pub fn stop(&mut self, t: f64, out: &mut Vec<Event>) {
        self.leave_if(|_| true, t, out);
        self.last = Author::default();
    }

    /// Whether no sender is present.
    pub fn is_empty(&self) -> bool {
        self.present.is_empty()
    }

    /// Removes the senders for which `is_over` returns `true`, in the order in which they joined.
    fn leave_if(&mut self, is_over: impl Fn(&Sender) -> bool, t: f64, out: &mut Vec<Event>) {
        let over = self.present.iter().filter(|(_, sender)| is_over(sender));
        let mut over: Vec<_> = over.map(|(&from, sender)| (sender.author, from)).collect();
        over.sort_unstable();
        over.into_iter().for_each(|(_, from)| self.leave(from, t, out));
    }

    fn leave(&mut self, from: SocketAddr, t: f64, out: &mut Vec<Event>) {
        if let Some(Sender { author, mut hands, .. }) = self.present.remove(&from) {
            hands.stop(t, out);
            out.push(Event::Leave { t, author });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use glam::Quat;

    use super::*;

    fn sender(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn hand(pressure: f32) -> Message {
        Message::Hand { hand: 0, p: Vec3::ZERO, q: Quat::IDENTITY, pressure }
    }

    #[test]
    fn who_falls_silent_leaves_and_comes_back_as_another() {
        let (mut senders, scene, mut out) = (Senders::default(), Scene::new(), Vec::new());
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        let head = Message::Head { p: Vec3::X, q: Quat::IDENTITY };
        assert!(senders.is_empty() && senders.first_with_head().is_none());
        let by = |author, from, at, message: &Message, senders: &mut Senders, out: &mut Vec<Event>| {
            let taken = senders.take((sender(from), at), 0.0, message, &scene, out);
            assert_eq!(taken, Some((Author(author), None)));
        };
        by(1, 7, at(0), &hand(1.0), &mut senders, &mut out);
        by(2, 8, at(1000), &head, &mut senders, &mut out);
        assert_eq!(senders.first_with_head(), Some(Author(2)));
        by(1, 7, at(2000), &head, &mut senders, &mut out);
        assert_eq!(senders.first_with_head(), Some(Author(1)));
        out.clear();
        senders.rest(at(5999), 0.5, &mut out);
        assert_eq!(out, []);
        senders.rest(at(6000), 0.5, &mut out);
        assert_eq!(out, [Event::Leave { t: 0.5, author: Author(2) }]);
        out.clear();
        senders.rest(at(7000), 0.75, &mut out);
        let stroke = StrokeId(1 << Author::NUMBER_BITS);
        assert_eq!(
            out,
            [Event::End { t: 0.75, stroke }, Event::Leave { t: 0.75, author: Author(1) }],
            "its stroke ends"
        );
        assert!(senders.is_empty());
        by(3, 7, at(8000), &hand(1.0), &mut senders, &mut out);
    }

    #[test]
    fn who_has_had_all_numbers_of_an_author_is_the_next_one() {
        let (mut senders, scene, mut out) = (Senders::default(), Scene::new(), Vec::new());
        let now = Instant::now();
        let mut take = |message: &Message, out: &mut Vec<Event>| {
            senders.take((sender(7), now), 0.0, message, &scene, out).expect("an author").0
        };
        for _ in 1..1 << Author::NUMBER_BITS {
            assert_eq!(take(&hand(1.0), &mut out), Author(1));
            take(&hand(0.0), &mut out);
            out.clear();
        }
        assert_eq!(take(&hand(1.0), &mut out), Author(1));
        out.clear();
        assert_eq!(take(&hand(1.0), &mut out), Author(2));
        let [Event::End { stroke: last, .. }, Event::Leave { .. }, Event::Join { .. }, begin, _] = &out[..]
        else {
            panic!("{out:?}")
        };
        let Event::Begin { stroke: next, author, .. } = begin else { panic!("{begin:?}") };
        assert_eq!((last.author(), next.author(), *author), (Author(1), Author(2), Author(2)));
    }
}
