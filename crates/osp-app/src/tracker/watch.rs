use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use glam::{Quat, Vec3};

use super::Message;
use osp_session::platform::time::Instant;

/// Number of latencies for the median.
const KEPT: usize = 64;
/// Time without messages after which the rate of a body is 0.
const SILENCE: Duration = Duration::from_millis(1500);
/// Duration over which poses are counted.
const COUNTED: Duration = Duration::from_secs(1);

/// Recent poses, rates and latencies of a tracker, for its operator.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    head: Body,
    hands: BTreeMap<u8, Body>,
    last_hand: u8,
    /// Arrival of the first pose that no picture has shown yet.
    waiting: Option<Instant>,
    latencies: VecDeque<Duration>,
}

/// A received pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received {
    /// Time of arrival.
    pub at: Instant,
    /// Pose in tracker space: position, and rotation from body space to tracker space.
    pub in_tracker: (Vec3, Quat),
    /// Pose in room space: position, and rotation from body space to room space.
    pub in_room: (Vec3, Quat),
    /// Pressure of the hand, 0 to 1.
    pub pressure: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Body {
    last: Option<Received>,
    /// The start of the count, and the number of poses since.
    counting: Option<(Instant, u32)>,
    /// Poses per second at the last count.
    rate: f32,
}

impl Body {
    fn note(&mut self, heard: Received) {
        if self.last.is_some_and(|last| heard.at.saturating_duration_since(last.at) > SILENCE) {
            (self.counting, self.rate) = (None, 0.0);
        }
        let (began, poses) = self.counting.get_or_insert((heard.at, 0));
        let taken = heard.at.saturating_duration_since(*began);
        if taken >= COUNTED {
            self.rate = *poses as f32 / taken.as_secs_f32();
            (*began, *poses) = (heard.at, 0);
        }
        *poses += 1;
        self.last = Some(heard);
    }

    fn rate(&self, now: Instant) -> f32 {
        let is_silent = self.last.is_none_or(|heard| now.saturating_duration_since(heard.at) > SILENCE);
        if is_silent { 0.0 } else { self.rate }
    }
}

impl Watch {
    /// Records a message in tracker space and in room space.
    pub fn note(&mut self, at: Instant, in_tracker: &Message, in_room: &Message) {
        match (in_tracker, in_room) {
            (Message::Head { p, q }, &Message::Head { p: room_p, q: room_q }) => {
                self.head.note(Received {
                    at,
                    in_tracker: (*p, *q),
                    in_room: (room_p, room_q),
                    pressure: 0.0,
                });
            }
            (Message::Hand { p, q, .. }, &Message::Hand { hand, p: room_p, q: room_q, pressure }) => {
                self.last_hand = hand;
                self.hands.entry(hand).or_default().note(Received {
                    at,
                    in_tracker: (*p, *q),
                    in_room: (room_p, room_q),
                    pressure,
                });
            }
            _ => return,
        }
        self.waiting.get_or_insert(at);
    }

    /// Records that a picture of all recorded poses was passed to the display.
    pub fn note_shown(&mut self, now: Instant) {
        let Some(at) = self.waiting.take() else { return };
        if self.latencies.len() == KEPT {
            self.latencies.pop_front();
        }
        self.latencies.push_back(now.saturating_duration_since(at));
    }

    /// The head's last pose.
    pub fn head(&self) -> Option<Received> {
        self.head.last
    }

    /// The last pose of the hand of the last message.
    pub fn hand(&self) -> Option<Received> {
        self.hand_of(self.last_hand)
    }

    /// The last pose of a hand.
    pub fn hand_of(&self, hand: u8) -> Option<Received> {
        self.hands.get(&hand)?.last
    }

    /// The hands that have sent messages.
    pub fn hands(&self) -> impl Iterator<Item = u8> + '_ {
        self.hands.keys().copied()
    }

    /// Poses per second of the head, and of the hand of the last message, over the last second.
    pub fn rates(&self, now: Instant) -> [f32; 2] {
        [self.head.rate(now), self.hands.get(&self.last_hand).map_or(0.0, |hand| hand.rate(now))]
    }

    /// Median time from the arrival of the first pose to the submission of the picture that shows it. The delays of the
    /// tracker and the display are not included.
    pub fn latency(&self) -> Option<Duration> {
        let mut sorted: Vec<Duration> = self.latencies.iter().copied().collect();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(x: f32) -> Message {
        Message::Head { p: Vec3::X * x, q: Quat::IDENTITY }
    }

    #[test]
    fn rates_ages_and_latencies_are_those_of_the_messages() {
        let mut watch = Watch::default();
        let start = Instant::now();
        let at = |millis: u64| start + Duration::from_millis(millis);
        for i in 0..200 {
            watch.note(at(i * 10), &head(1.0), &head(2.0));
            // A picture is shown 3 ms after each second pose, so the first of the two has waited for 13 ms.
            if i % 2 == 1 {
                watch.note_shown(at(i * 10 + 3));
            }
        }
        let last = watch.head().expect("a pose");
        assert_eq!((last.in_tracker.0.x, last.in_room.0.x, last.at), (1.0, 2.0, at(1990)));
        let [head_rate, hand_rate] = watch.rates(at(2000));
        assert!((head_rate - 100.0).abs() < 2.0 && hand_rate == 0.0, "{head_rate}");
        assert_eq!(watch.latency(), Some(Duration::from_millis(13)));
        assert_eq!(watch.rates(at(4000)), [0.0; 2], "no messages, so the rate is 0");
        assert!(watch.hand().is_none());
        watch.note_shown(at(5000));
        assert_eq!(
            watch.latency(),
            Some(Duration::from_millis(13)),
            "a picture without a pose is none of its"
        );
    }
}
