//! Members and a server in one thread: messages get lost, come late and twice, members fall silent, and in the end all have
//! the same session, with everything that was drawn.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use glam::{Quat, Vec3};
use rand_pcg::{Pcg32, rand_core::Rng as _};

use super::{
    ME,
    member::{Member, News},
    outbox::{Outgoing, Who},
};
use crate::recording::{Author, Event, NormalRule, Sender, StrokeId, Tool};

/// A server's stream: it keeps what it gets, but for ids that it has had.
#[derive(Default)]
struct Server {
    log: Vec<(u64, Vec<u8>)>,
    ids: BTreeSet<String>,
}

impl Server {
    fn publish(&mut self, message: &Outgoing, now: Duration) {
        if self.ids.insert(message.id.clone()) {
            let nanos = u64::try_from(now.as_nanos()).expect("a short test");
            self.log.push((nanos, message.bytes.clone()));
        }
    }
}

struct Client {
    member: Member,
    events: Vec<Event>,
    own: usize,
    refused: usize,
    resent: Duration,
    drawn: usize,
    left: bool,
}

impl Client {
    fn new(name: &str, sender: u64) -> Self {
        let who = Who { name: name.to_owned(), color: None };
        let member = Member::new(Some((who, Sender(sender))));
        let resent = Duration::ZERO;
        Self { member, events: Vec::new(), own: 0, refused: 0, resent, drawn: 0, left: false }
    }

    fn draw(&mut self, events: Vec<Event>, now: Duration) {
        self.drawn += events.len();
        self.member.hand_over(events, now);
    }

    /// Reads the log to its end.
    fn read(&mut self, server: &Server, now: Duration) {
        let from = usize::try_from(self.member.last_sequence()).expect("a short test");
        for ((nanos, bytes), i) in server.log[from..].iter().zip(from as u64 + 1..) {
            self.member.take(i, *nanos, bytes, now);
        }
        for news in self.member.news.drain(..) {
            match news {
                News::Events { events, own } => {
                    self.events.extend(events);
                    self.own += own;
                }
                News::Refused { own, .. } => self.refused += own,
                News::Joined(_) => {}
                News::Left => self.left = true,
            }
        }
    }

    /// What it publishes, each message by chance lost on the way.
    fn publish(&mut self, server: &mut Server, now: Duration, lost: &mut dyn FnMut() -> bool) {
        let mut out = self.member.pump(now);
        let is_late = self.member.waits_for(now).is_some_and(|waits| waits > Duration::from_millis(400));
        if is_late && now.saturating_sub(self.resent) > Duration::from_millis(400) {
            self.resent = now;
            out = self.member.again();
        }
        out.extend(self.member.say_who_is_gone(now));
        for message in out {
            if !lost() {
                server.publish(&message, now);
            }
        }
    }
}

fn begin(n: u32) -> Event {
    Event::Begin {
        t: 0.0,
        author: Author::SOLE,
        stroke: StrokeId(ME.number(n).expect("few")),
        tool: Tool::Ribbon,
        width: 0.1,
        color: (1.0, 0.5, 0.25, 1.0),
        normal: NormalRule::LocalX,
        thinnest: 0.0,
        paint: None,
    }
}

fn point(n: u32, x: u32) -> Event {
    let p = Vec3::new(x as f32, 0.0, 0.0);
    let stroke = StrokeId(ME.number(n).expect("few"));
    Event::Point { t: 0.0, stroke, p, q: Quat::IDENTITY, pressure: 1.0 }
}

fn end(n: u32) -> Event {
    Event::End { t: 0.0, stroke: StrokeId(ME.number(n).expect("few")) }
}

/// Places of the points of each author's strokes, by the author's name.
fn points_of(events: &[Event]) -> BTreeMap<String, Vec<u32>> {
    let (mut names, mut points) = (BTreeMap::new(), BTreeMap::<String, Vec<u32>>::new());
    for event in events {
        match event {
            Event::Join { author, name, .. } => _ = names.insert(*author, name.clone()),
            Event::Point { stroke, p, .. } => {
                points.entry(names[&stroke.author()].clone()).or_default().push(p.x as u32);
            }
            _ => {}
        }
    }
    points
}

const STEP: Duration = Duration::from_millis(11);

#[test]
fn whatever_is_lost_on_the_way_all_have_the_same_and_everything() {
    for seed in 0..20 {
        let mut random = Pcg32::new(seed, 1);
        let mut server = Server::default();
        let mut clients: Vec<_> = (0..4).map(|i| Client::new(&format!("author {i}"), i + 1)).collect();
        let mut now = Duration::ZERO;
        let per_mille = [0, 20, 300, 600][seed as usize % 4];
        for frame in 0..3000 {
            now += STEP;
            for client in &mut clients {
                if frame < 300 {
                    let n = frame / 30;
                    let mut events = if frame % 30 == 0 { vec![begin(n)] } else { Vec::new() };
                    events.push(point(n, frame));
                    events.extend((frame % 30 == 29).then(|| end(n)));
                    client.draw(events, now);
                } else if frame == 300 {
                    client.member.leave(now);
                }
                let mut lost = || random.next_u32() % 1000 < per_mille;
                client.publish(&mut server, now, &mut lost);
                // Reading stops now and then, for all or for one.
                if random.next_u32().is_multiple_of(2) {
                    client.read(&server, now);
                }
            }
            if clients.iter().all(|client| client.left) {
                break;
            }
        }
        for client in &mut clients {
            client.read(&server, now);
            assert!(client.left, "seed {seed}: {:?}", client.member.counts);
            assert_eq!(
                (client.own, client.refused, client.member.pending()),
                (client.drawn, 0, 0),
                "seed {seed}"
            );
        }
        let first = clients[0].events.clone();
        assert!(clients.iter().all(|client| client.events == first), "seed {seed}");
        for (name, points) in points_of(&first) {
            assert_eq!(points, (0..300).collect::<Vec<_>>(), "seed {seed}, {name}");
        }
        let losses = clients.iter().map(|client| client.member.counts.resent).sum::<u64>();
        assert_eq!(losses > 0, per_mille > 0, "seed {seed}: something was sent again");
    }
}

#[test]
fn who_was_taken_for_gone_comes_again_and_nothing_of_it_is_lost() {
    let mut server = Server::default();
    let mut ann = Client::new("Ann", 1);
    let mut bob = Client::new("Bob", 2);
    let mut now = Duration::ZERO;
    let mut x = 0;
    for frame in 0..1400u32 {
        now += STEP;
        // Ann's cable is out from the 100th frame to the 1200th, in the middle of a stroke; she draws on.
        let is_out = (100..1200).contains(&frame);
        if frame < 1300 {
            let mut events = if frame == 0 || frame == 650 { vec![begin(frame / 650)] } else { Vec::new() };
            events.push(point(frame / 650, x));
            x += 1;
            events.extend((frame == 649).then(|| end(0)));
            ann.draw(events, now);
        }
        if frame % 50 == 0 {
            bob.draw(vec![Event::Undo { t: 0.0, author: Author::SOLE }], now);
        }
        if !is_out {
            ann.publish(&mut server, now, &mut || false);
            ann.read(&server, now);
        }
        bob.publish(&mut server, now, &mut || false);
        bob.read(&server, now);
    }
    ann.draw(vec![end(1)], now);
    for _ in 0..100 {
        now += STEP;
        ann.publish(&mut server, now, &mut || false);
        ann.read(&server, now);
        bob.read(&server, now);
    }
    assert_eq!((ann.member.pending(), ann.refused), (0, 0));
    assert_eq!((ann.own, ann.drawn), (ann.drawn, 1300 + 2 + 2));
    assert_eq!(ann.events, bob.events);
    let joins = ann.events.iter().filter(|event| matches!(event, Event::Join { .. })).count();
    assert_eq!((joins, ann.member.author()), (3, Some(Author(3))));
    let left: Vec<_> = ann.events.iter().filter(|event| matches!(event, Event::Leave { .. })).collect();
    assert!(matches!(left[..], [Event::Leave { author: Author(1), .. }]), "{left:?}");
    // The last point that was heard begins the stroke that goes on.
    let points = &points_of(&ann.events)["Ann"];
    let again = points.windows(2).position(|pair| pair[0] == pair[1]).expect("a point twice");
    let mut once = points.clone();
    once.remove(again);
    assert_eq!(once, (0..1300).collect::<Vec<_>>());
    // Nothing is drawn on a stroke that has ended, and every stroke is its author's.
    let begun = ann.events.iter().filter(|event| matches!(event, Event::Begin { .. })).count();
    assert_eq!(begun, 3);
}

#[test]
fn who_speaks_under_anothers_number_takes_nothing_away() {
    let mut server = Server::default();
    let mut ann = Client::new("Ann", 1);
    let mut now = STEP;
    ann.publish(&mut server, now, &mut || false);
    ann.read(&server, now);
    ann.draw(vec![begin(0), point(0, 0)], now);
    // What she says comes second.
    let mallory = super::packet::head(Sender(1), 1);
    server.publish(&Outgoing { id: "x".into(), bytes: mallory.into_bytes() }, now);
    for x in 1..100 {
        now += STEP;
        ann.draw(vec![point(0, x)], now);
        ann.publish(&mut server, now, &mut || false);
        ann.read(&server, now);
    }
    assert_eq!((ann.own, ann.member.pending()), (ann.drawn, 0));
    assert_eq!(points_of(&ann.events)["Ann"], (0..100).collect::<Vec<_>>());
}

#[test]
fn a_watcher_says_nothing_and_learns_all() {
    let mut server = Server::default();
    let mut ann = Client::new("Ann", 1);
    let mut watcher = Client::new("", 9);
    watcher.member = Member::new(None);
    let mut now = Duration::ZERO;
    for frame in 0..2000u32 {
        now += STEP;
        if frame == 0 {
            ann.draw(vec![begin(0)], now);
        }
        // She is gone soon, and the watcher says nothing of that either.
        if frame < 50 {
            ann.draw(vec![point(0, frame)], now);
            ann.publish(&mut server, now, &mut || false);
            ann.read(&server, now);
        }
        watcher.member.hand_over(vec![point(1, 1)], now);
        watcher.member.leave(now);
        watcher.publish(&mut server, now, &mut || panic!("a watcher publishes nothing"));
        watcher.read(&server, now);
        assert_eq!(watcher.member.presence(now), None);
    }
    assert_eq!(watcher.events, ann.events);
    assert!(watcher.events.len() > 40 && watcher.member.authors() == 1);
}

#[test]
fn a_slow_answer_makes_longer_messages_not_more() {
    let mut ann = Client::new("Ann", 1);
    let mut server = Server::default();
    let mut now = STEP;
    ann.publish(&mut server, now, &mut || false);
    ann.read(&server, now);
    let mut published = 0;
    ann.draw(vec![begin(0)], now);
    for x in 0..1000 {
        now += Duration::from_micros(100);
        ann.draw(vec![point(0, x)], now);
        published += ann.member.pump(now).len();
    }
    assert_eq!(published, super::outbox::WINDOW);
    for message in ann.member.again() {
        server.publish(&message, now);
    }
    ann.read(&server, now);
    let rest = ann.member.pump(now);
    assert_eq!(rest.len(), 1, "all that waited is one message");
    server.publish(&rest[0], now);
    ann.read(&server, now);
    assert_eq!((ann.own, ann.member.pending()), (1001, 0));
}

/// An event that no message can hold is refused, and what follows is not.
#[test]
fn an_event_that_is_too_long_is_refused_alone() {
    let mut ann = Client::new("Ann", 1);
    let mut server = Server::default();
    let now = STEP;
    ann.publish(&mut server, now, &mut || false);
    ann.read(&server, now);
    let strokes = vec![StrokeId(Author(4000).number(0).expect("an author")); 60_000];
    let long = Event::Move { t: 0.0, author: Author::SOLE, strokes, by: Vec3::X };
    ann.draw(vec![begin(0), long, point(0, 1), end(0)], now);
    for _ in 0..3 {
        ann.publish(&mut server, now, &mut || false);
        ann.read(&server, now);
    }
    assert_eq!((ann.own, ann.refused, ann.member.pending()), (3, 1, 0));
    // A server that takes short messages gets more of them.
    ann.member.set_limit_bytes(2000);
    let events: Vec<_> = [begin(1)].into_iter().chain((0..200).map(|x| point(1, x))).collect();
    ann.draw(events, now);
    let out = ann.member.pump(now);
    assert!(out.len() >= 5 && out.iter().all(|message| message.bytes.len() <= 2000), "{}", out.len());
}
