//! Members and a server in one thread. Messages get lost, come late or twice, and members fall silent. In the end all
//! members have the same session, with everything that was drawn.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use glam::{Quat, Vec3};
use rand_pcg::{Pcg32, rand_core::Rng as _};

use super::{
    ME,
    member::{Member, News},
    outbox::{Outgoing, Who},
};
use osp_session::recording::{Author, Event, NormalRule, Sender, StrokeId, Tool};

/// A stream of a server. It stores the messages that it receives, except messages with an id that it has already.
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

    fn read(&mut self, server: &Server, now: Duration) {
        let from = usize::try_from(self.member.last_sequence).expect("a short test");
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

    /// Publishes the member's messages; each may be lost at random.
    fn publish(&mut self, server: &mut Server, now: Duration, lost: &mut dyn FnMut() -> bool) {
        let mut out = self.member.pump(now);
        let is_late = self.member.waits_for(now).is_some_and(|waits| waits > Duration::from_millis(400));
        if is_late && now.saturating_sub(self.resent) > Duration::from_millis(400) {
            self.resent = now;
            out = self.member.again();
        }
        out.extend(self.member.message_of_absence(now));
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

/// The points of each author's strokes, by the author's name.
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
                // At times, all members or one member do not read.
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
        // Ann is disconnected from the 100th frame to the 1200th, in the middle of a stroke, and continues to draw.
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
    // The last point that was received begins the continued stroke.
    let points = &points_of(&ann.events)["Ann"];
    let again = points.windows(2).position(|pair| pair[0] == pair[1]).expect("a point twice");
    let mut once = points.clone();
    once.remove(again);
    assert_eq!(once, (0..1300).collect::<Vec<_>>());
    // Nothing is drawn on a stroke that has ended, and every stroke belongs to its author.
    let begun = ann.events.iter().filter(|event| matches!(event, Event::Begin { .. })).count();
    assert_eq!(begun, 3);
}

/// Ann draws `first` and loses the connection. Bob reports that she is gone. She draws `out` without a connection, and
/// `after` once she is connected again and has read the report. Returns the final session, which contains everything that
/// she drew.
fn gone_in_the_middle(first: Vec<Event>, out: Vec<Event>, after: Vec<Event>) -> Vec<Event> {
    let (mut server, mut now) = (Server::default(), STEP);
    let (mut ann, mut bob) = (Client::new("Ann", 1), Client::new("Bob", 2));
    let run = |who: &mut [&mut Client], server: &mut Server, now: &mut Duration, frames: u32| {
        for _ in 0..frames {
            *now += STEP;
            for client in &mut *who {
                client.publish(server, *now, &mut || false);
                client.read(server, *now);
            }
        }
    };
    run(&mut [&mut ann, &mut bob], &mut server, &mut now, 5);
    ann.draw(first, now);
    run(&mut [&mut ann, &mut bob], &mut server, &mut now, 5);
    ann.draw(out, now);
    run(&mut [&mut bob], &mut server, &mut now, 1200);
    ann.read(&server, now);
    ann.draw(after, now);
    run(&mut [&mut ann, &mut bob], &mut server, &mut now, 100);
    assert_eq!((ann.member.pending(), ann.refused, ann.own), (0, 0, ann.drawn));
    assert_eq!(ann.events, bob.events);
    assert!(ann.events.iter().any(|event| matches!(event, Event::Leave { author: Author(1), .. })));
    ann.events
}

#[test]
fn a_hand_that_held_still_while_it_was_taken_for_gone_goes_on() {
    let after = vec![point(0, 3), point(0, 4), end(0), begin(1), point(1, 5)];
    let events = gone_in_the_middle(vec![begin(0), point(0, 1), point(0, 2)], vec![], after);
    assert_eq!(points_of(&events)["Ann"], [1, 2, 2, 3, 4, 5]);
}

#[test]
fn the_end_of_a_stroke_that_has_ended_already_takes_nothing_with_it() {
    let out = vec![end(0), begin(1), point(1, 3)];
    let events = gone_in_the_middle(vec![begin(0), point(0, 1), point(0, 2)], out, vec![point(1, 4)]);
    assert_eq!(points_of(&events)["Ann"], [1, 2, 3, 4]);
    // No event is left to send.
    let events = gone_in_the_middle(vec![begin(0), point(0, 1)], vec![], vec![end(0)]);
    assert_eq!(points_of(&events)["Ann"], [1]);
}

#[test]
fn faces_of_a_stroke_go_on_as_a_stroke_of_the_next_author() {
    let face = |x: u32| {
        let vertices = vec![Vec3::ZERO, Vec3::X * (x + 1) as f32, Vec3::Y];
        let stroke = Some(StrokeId(ME.number(0).expect("few")));
        Event::Polygon {
            author: Author::SOLE,
            t: 0.0,
            stroke,
            vertices,
            shading: None,
            color: (1.0, 1.0, 1.0, 1.0),
        }
    };
    let events = gone_in_the_middle(vec![face(0), face(1)], vec![face(2)], vec![face(3), face(4)]);
    let faces = |of| {
        let is_of = |event: &&Event| matches!(event, Event::Polygon { author, .. } if *author == Author(of));
        events.iter().filter(is_of).count()
    };
    assert_eq!((faces(1), faces(3)), (2, 3));
}

#[test]
fn who_speaks_under_anothers_number_takes_nothing_away() {
    let mut server = Server::default();
    let mut ann = Client::new("Ann", 1);
    let mut now = STEP;
    ann.publish(&mut server, now, &mut || false);
    ann.read(&server, now);
    ann.draw(vec![begin(0), point(0, 0)], now);
    // Another client's message under Ann's number comes first, and hers second.
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

/// Joins of `joins` unknown senders at one time.
fn flood(server: &mut Server, joins: u64, now: Duration) {
    for sender in 0..joins {
        let event = Event::Join { t: 0.0, author: ME, name: String::new(), color: None };
        let mut text = super::packet::head(Sender(1 << 32 | sender), 0);
        assert!(super::packet::push(&mut text, &event));
        server.publish(&Outgoing { id: format!("flood {sender}"), bytes: text.into_bytes() }, now);
    }
}

#[test]
fn who_comes_into_a_crowd_draws_on_and_joins_once_there_is_room() {
    let (mut server, mut now) = (Server::default(), STEP);
    flood(&mut server, 4094, now);
    let mut ann = Client::new("Ann", 1);
    let mut joined = None;
    for frame in 0..1500u32 {
        now += STEP;
        ann.draw(if frame == 0 { vec![begin(0)] } else { vec![point(0, frame)] }, now);
        ann.publish(&mut server, now, &mut || false);
        ann.read(&server, now);
        assert!(!ann.member.is_full);
        match ann.member.author() {
            Some(_) => _ = joined.get_or_insert(now),
            None => assert!(ann.member.is_crowded, "frame {frame}"),
        }
    }
    // One sender can join every ten seconds.
    let joined = joined.expect("she has joined").as_secs_f64();
    assert!((10.0..12.0).contains(&joined), "{joined}");
    assert!(!ann.member.is_crowded);
    assert_eq!((ann.own, ann.refused, ann.member.pending()), (ann.drawn, 0, 0));
    assert_eq!(points_of(&ann.events)["Ann"], (1..1500).collect::<Vec<_>>());
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
        // Ann is soon gone, and the watcher does not report this, either.
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
    assert!((2..=4).contains(&rest.len()), "what waited is a few messages: {}", rest.len());
    for message in rest {
        assert!(message.bytes.len() <= 32 << 10, "a slow connection carries each of them");
        server.publish(&message, now);
    }
    ann.read(&server, now);
    assert_eq!((ann.own, ann.member.pending()), (1001, 0));
}

/// An event that is too long for a message is refused; later events are not.
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
    // If the server accepts only short messages, the member sends more of them.
    ann.member.set_limit_bytes(2000);
    let events: Vec<_> = [begin(1)].into_iter().chain((0..200).map(|x| point(1, x))).collect();
    ann.draw(events, now);
    let out = ann.member.pump(now);
    assert!(out.len() >= 5 && out.iter().all(|message| message.bytes.len() <= 2000), "{}", out.len());
}
