//! Recordings of several authors: which events readers accept and refuse, and how messages become a session.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};
use osp_session::recording::{
    AUTHORS_FORMAT, Author, Event, Flush, GroupId, Header, Message, NormalRule, Paint, Reduced, Reducer,
    RonWriter, Sender, StrokeId,
};
use osp_testkit::events::{self, Begin, By, SOLE};
use proptest::prelude::*;

use super::events::{LENIENT, STRICT, read, write};

fn header() -> Header {
    Header { format: AUTHORS_FORMAT, ..Header::new("together", "test") }
}

fn text(lines: &str) -> String {
    format!("Header(format: 4)\n{lines}")
}

fn error(lines: &str) -> String {
    read(text(lines).as_bytes(), STRICT).error.expect("an error").to_string()
}

fn join(author: u32) -> Event {
    let color = author.is_multiple_of(2).then_some((0.25, 0.5, 1.0));
    Event::Join { t: 0.5, author: Author(author), name: format!("Ann {author}"), color }
}

fn begin(author: u32, stroke: u32) -> Event {
    let (author, color) = (Author(author), (1.0, 0.5, 0.25, 1.0));
    Begin { author, color, width: 0.25, normal: NormalRule::LocalX, ..Begin::of(StrokeId(stroke)) }.event()
}

fn layer(author: Author, layer: u32, name: Option<String>, mine: Option<bool>) -> Event {
    Event::Layer { t: 1.0, author, layer, name, hidden: None, locked: None, mine }
}

fn point(stroke: u32, i: u32) -> Event {
    events::point(StrokeId(stroke), Vec3::new(i as f32, stroke as f32 / 65536.0, 0.0))
}

#[test]
fn authors_are_written_and_read_again_and_the_sole_one_is_not_written() {
    let stroke = Author(2).number(7).unwrap();
    let events = [
        join(1),
        join(2),
        begin(2, stroke),
        point(stroke, 0),
        Event::End { t: 1.0, stroke: StrokeId(stroke) },
        Event::Head { t: 1.0, author: Author(1), p: Vec3::Y, q: Quat::IDENTITY },
        Event::Head { t: 1.0, author: Author::SOLE, p: Vec3::Y, q: Quat::IDENTITY },
        Event::Undo { t: 2.0, author: Author(2) },
        Event::Undo { t: 2.0, author: Author::SOLE },
        Event::Leave { t: 3.0, author: Author(2) },
    ];
    let bytes = write(&header(), &events);
    let lines: Vec<&str> = std::str::from_utf8(&bytes).unwrap().lines().collect();
    assert_eq!(lines[1], "Join(t:0.5,author:1,name:\"Ann 1\")");
    assert_eq!(lines[2], "Join(t:0.5,author:2,name:\"Ann 2\",color:(0.25,0.5,1.0))");
    assert_eq!(lines[6], "Head(t:1.0,author:1,p:(0.0,1.0,0.0),q:(0.0,0.0,0.0,1.0))");
    assert_eq!(lines[7], "Head(t:1.0,p:(0.0,1.0,0.0),q:(0.0,0.0,0.0,1.0))");
    assert_eq!(lines[9], "Undo(t:2.0)");
    let again = read(&bytes, STRICT);
    assert!(again.error.is_none(), "{:?}", again.error);
    assert_eq!(again.events, events);
}

#[test]
fn what_is_not_the_authors_is_refused_with_its_line() {
    let joined = "Join(t:0,author:1,name:\"Ann\")\nJoin(t:0,author:2)\n";
    let alone = [
        "Undo(t:1,author:1)\n",
        "Join(t:0,author:0)\n",
        "Join(t:0,author:4096)\n",
        "Join(t:0,author:1,color:Some((0,0,2)))\n",
    ];
    let mut said = alone.map(error).join("\n");
    for lines in [
        "Begin(t:1,author:1,stroke:2097152,tool:Ribbon,width:0.1,color:(1,1,1,1))\n",
        "Polygon(author:1,stroke:Some(3),vertices:[(0,0,0),(1,0,0),(0,1,0)],color:(1,1,1,1))\n",
        "Group(t:1,author:1,group:2097152,strokes:[])\n",
        "Leave(t:1,author:2)\nUndo(t:1,author:2)\n",
        "Join(t:0,author:2)\n",
    ] {
        let error = error(&format!("{joined}{lines}"));
        let rest = format!("{joined}{lines}Undo(t:7)\n");
        let lenient = read(text(&rest).as_bytes(), LENIENT);
        assert!(lenient.error.is_none() && lenient.notes.skipped == 1, "{lines}: {:?}", lenient.notes);
        assert!(lenient.notes.warnings[0].contains(&error), "{error}: {:?}", lenient.notes);
        assert_eq!(lenient.events.last(), Some(&Event::Undo { t: 7.0, author: Author::SOLE }), "{lines}");
        said += &format!("\n{error}");
    }
    insta::assert_snapshot!(said);
    // Any author may add strokes to an existing group.
    let shared =
        "Group(t:1,author:2,group:2097152,strokes:[])\nGroup(t:1,author:1,group:2097152,strokes:[])\n";
    assert!(read(text(&format!("{joined}{shared}")).as_bytes(), STRICT).error.is_none());
}

#[test]
fn a_damaged_join_costs_a_lenient_reader_that_author() {
    let lines =
        "Join(t:0,author:1)\nJoin(t:0,autor:2)\nJoin(t:0,author:3)\nUndo(t:1,author:2)\nUndo(t:1,author:3)\n";
    let lenient = read(text(lines).as_bytes(), LENIENT);
    assert!(lenient.error.is_none() && lenient.notes.skipped == 2, "{:?}", lenient.notes);
    assert_eq!(lenient.events.last(), Some(&Event::Undo { t: 1.0, author: Author(3) }));
    // The undamaged events form a recording that a strict reader accepts.
    let rescued = "Join(t:0,author:1)\nJoin(t:0,author:3)\nUndo(t:1,author:3)\n";
    assert!(read(text(rescued).as_bytes(), STRICT).error.is_none());
}

#[test]
fn earlier_formats_have_one_author_with_any_numbers() {
    for format in 1..AUTHORS_FORMAT {
        let bytes = format!("Header(format: {format})\nUndo(t: 1, author: 1)\n");
        let error = read(bytes.as_bytes(), STRICT).error.expect("an error").to_string();
        let expected =
            format!("line 2: expected an event without an author in a recording of format {format}");
        assert!(error.contains(&expected), "{error}");
        let header = Header { format, ..Header::new("", "") };
        let mut writer = RonWriter::new(Vec::new(), "out.ron", &header, Flush::EachEvent).unwrap();
        let error = writer.write(&join(1)).unwrap_err().to_string();
        assert!(error.contains("out.ron, line 2: expected an event without an author"), "{error}");
        writer.write(&begin(0, u32::MAX)).unwrap();
        let again = read(&writer.get_ref().clone(), STRICT);
        assert!(again.error.is_none() && again.events == [begin(0, u32::MAX)]);
    }
    // In a recording of several authors, the sole author, who has not joined, has the first numbers.
    let bytes = write(&header(), &[begin(0, (1 << Author::NUMBER_BITS) - 1)]);
    assert!(read(&bytes, STRICT).error.is_none());
    let beyond = "Begin(t:1,stroke:1048576,tool:Ribbon,width:0.1,color:(1,1,1,1))\n";
    assert!(error(beyond).contains("stroke of author 0"));
}

#[test]
fn a_layer_of_ones_own_needs_several_authors() {
    let mine = |mine| layer(Author(1), 2, None, mine);
    let events = [join(1), mine(Some(true)), mine(Some(false)), mine(None)];
    let bytes = write(&header(), &events);
    let lines: Vec<&str> = std::str::from_utf8(&bytes).unwrap().lines().collect();
    let expected = [",mine:true", ",mine:false", ""];
    assert_eq!(lines[2..], expected.map(|mine| format!("Layer(t:1.0,author:1,layer:2{mine})")));
    assert_eq!(read(&bytes, STRICT).events, events);
    let alone = b"Header(format: 3)\nLayer(t:1,layer:2,mine:true)\n";
    let error = read(alone, STRICT).error.expect("an error").to_string();
    let expected = "line 2: expected an event without an author in a recording of format 3";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn a_message_counts_once_in_its_turn_and_whole() {
    let (mut reducer, mut out) = (Reducer::new(), Vec::new());
    let (ann, host) = (Sender(77), Sender::HOST);
    let message = |sender, number, events: &[Event]| Message { sender, number, events: events.to_vec() };
    let mut take = |message: &Message| {
        let first = out.len();
        let reduced = reducer.take(message, &mut out);
        (reduced, out.len() - first)
    };
    let stroke = Author(1).number(0).unwrap();
    let drawn = [begin(1, stroke), point(stroke, 0)];
    assert_eq!(take(&message(ann, 0, &drawn)), (Reduced::Stranger, 0));
    assert_eq!(take(&message(ann, 1, &drawn)), (Reduced::Gap(0), 0));
    assert_eq!(take(&message(host, 0, &[begin(0, 3), point(3, 0)])), (Reduced::Taken, 2));
    // The author number in a sender's first message is ignored.
    assert_eq!(take(&message(ann, 0, &[join(9)])), (Reduced::Taken, 1));
    assert_eq!(take(&message(ann, 0, &[join(9)])), (Reduced::Duplicate, 0));
    assert_eq!(take(&message(ann, 1, &drawn)), (Reduced::Taken, 2));
    // A message with another author's event has no effect at all, and the sender's next message has the next number.
    let wrong = [point(stroke, 1), SOLE.undo()];
    let refused = Reduced::Refused("event 2: expected an event of author 1".to_owned());
    assert_eq!(take(&message(ann, 2, &wrong)), (refused, 0));
    let made = By(Author(1)).grouped(GroupId(stroke), [], None);
    assert!(matches!(take(&message(ann, 3, &[made.clone(), point(3, 1)])), (Reduced::Refused(_), 0)));
    // The message has created no group either.
    let theirs = SOLE.grouped(GroupId(stroke), [], None);
    assert!(matches!(take(&message(host, 1, std::slice::from_ref(&theirs))), (Reduced::Refused(_), 0)));
    assert_eq!(take(&message(ann, 4, &[made])), (Reduced::Taken, 1));
    assert_eq!(take(&message(host, 2, &[theirs])), (Reduced::Taken, 1));
    // The host reports who has left; the sender has no author then.
    let gone = Event::Leave { t: 0.0, author: Author(1) };
    assert_eq!(take(&message(host, 3, &[gone])), (Reduced::Taken, 1));
    assert_eq!(take(&message(ann, 5, &[point(stroke, 2)])), (Reduced::Stranger, 0));
    assert_eq!(take(&message(Sender(78), 0, &[join(0)])), (Reduced::Taken, 1));
    let joined = out.iter().filter(|event| matches!(event, Event::Join { .. }));
    assert!(joined.map(|event| event.author()).eq([1, 2].map(|number| Some(Author(number)))));
}

/// The actions of a sender in a message, encoded in two numbers.
type Doing = (u8, u32);

/// The messages of senders in the order in which they count.
fn session_of(senders: u64, order: &[(u64, Vec<Doing>)]) -> Vec<Message> {
    let (mut numbers, mut strokes): (BTreeMap<u64, u64>, BTreeMap<u64, u32>) = Default::default();
    let mut authors: BTreeMap<u64, Author> = BTreeMap::new();
    let mut messages = Vec::new();
    for (sender, doings) in order {
        let sender = 1 + sender % senders;
        let number = *numbers.entry(sender).and_modify(|number| *number += 1).or_default();
        let events = match authors.get(&sender) {
            None => {
                authors.insert(sender, Author(authors.len() as u32 + 1));
                vec![join(0)]
            }
            Some(&author) => doings
                .iter()
                .flat_map(|&(kind, pick)| {
                    let next = strokes.entry(sender).or_default();
                    let any = StrokeId(Author(1 + pick % authors.len() as u32).number(pick / 8 % 4).unwrap());
                    let t = f64::from(pick % 100) / 10.0;
                    match kind % 9 {
                        0 | 1 => {
                            let stroke = author.number(*next).unwrap();
                            *next += 1;
                            let mut events = vec![begin(author.0, stroke)];
                            if let Event::Begin { paint, .. } = &mut events[0] {
                                *paint = Some(Box::new(Paint { layer: pick % 3, ..Paint::new("", 0) }));
                            }
                            events.extend((0..4).map(|i| point(stroke, i)));
                            events
                        }
                        2 => vec![By(author).erase(any)],
                        3 => vec![By(author).moved([any], Vec3::X * (pick % 7) as f32)],
                        4 => vec![By(author).undo()],
                        5 => {
                            let mine = [None, Some(true), Some(false)][pick as usize / 3 % 3];
                            vec![layer(author, pick % 3, Some(format!("layer of {author}")), mine)]
                        }
                        6 => vec![Event::Assign { t, author, layer: pick / 32 % 3, strokes: vec![any] }],
                        _ => vec![By(author).redo()],
                    }
                })
                .collect(),
        };
        messages.push(Message { sender: Sender(sender), number, events });
    }
    messages
}

/// The bytes of the recording and the scene that result from a log.
fn reduce(log: &[Message]) -> (Vec<u8>, Vec<u32>, u64, String) {
    let (mut reducer, mut events) = (Reducer::new(), Vec::new());
    for message in log {
        reducer.take(message, &mut events);
    }
    let bytes = write(&header(), &events);
    assert!(read(&bytes, STRICT).error.is_none(), "a session that a reader takes");
    let (mut scene, mut changes) = (osp_session::scene::Scene::new(), Vec::new());
    scene.apply_all(&events, &mut changes);
    let visible: Vec<u32> = scene.visible_ids().map(|id| id.0).collect();
    let offsets = scene.strokes().iter().map(|stroke| stroke.offset().x.to_bits());
    let mixed = offsets.fold(0u64, |sum, bits| sum.wrapping_mul(31).wrapping_add(bits.into()));
    let on_layers: Vec<u32> = scene.strokes().iter().map(|stroke| stroke.layer()).collect();
    let closed = (0..3).map(|layer| scene.closed_by(layer)).collect::<Vec<_>>();
    let ignored = scene.counts().ignored_events;
    (bytes, visible, mixed, format!("{on_layers:?} {closed:?} {:?} {ignored}", scene.layer_states()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Messages that arrive twice, too early, or again after all others have no effect, at any position.
    #[test]
    fn duplicates_gaps_and_resends_change_nothing(
        senders in 1u64..5,
        order in prop::collection::vec((any::<u64>(), prop::collection::vec(any::<Doing>(), 0..4)), 1..60),
        noise in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..80),
    ) {
        let canonical = session_of(senders, &order);
        let expected = reduce(&canonical);
        let mut log: Vec<(usize, Message)> = canonical.iter().cloned().enumerate().collect();
        for (which, place) in noise {
            let which = which.index(canonical.len());
            let message = canonical[which].clone();
            let position = |of: usize| log.iter().position(|(number, _)| *number == of).expect("it is in the log");
            // Any position, except for the range in which the message would be its sender's next one.
            let first = position(which);
            let before = canonical[..which].iter().rposition(|earlier| earlier.sender == message.sender);
            let place = place.index(log.len() + 1);
            let place = match before.map(position) {
                Some(before) if place > before && place <= first => before,
                None if place <= first => first + 1,
                _ => place,
            };
            log.insert(place, (usize::MAX, message));
        }
        let log: Vec<Message> = log.into_iter().map(|(_, message)| message).collect();
        prop_assert_eq!(reduce(&log), expected);
    }

    /// For any sequence of messages, a prefix of the log gives a prefix of the session, and no call panics.
    #[test]
    fn any_log_gives_a_session_that_grows(
        senders in 1u64..4,
        order in prop::collection::vec((any::<u64>(), prop::collection::vec(any::<Doing>(), 0..4)), 1..30),
        mess in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..60),
    ) {
        let mut log = session_of(senders, &order);
        for (a, b) in mess {
            let (a, b) = (a.index(log.len()), b.index(log.len()));
            log.swap(a, b);
            let copy = log[a].clone();
            log.push(copy);
        }
        let (whole, ..) = reduce(&log);
        let (half, ..) = reduce(&log[..log.len() / 2]);
        prop_assert!(whole.starts_with(&half));
    }
}
