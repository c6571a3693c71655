use osp_testkit::{events::events_in, shipped_session};
use std::net::UdpSocket;

use super::tracker::wait_until;
use osp_app::tracker::{
    EventEncoder, Hands, Message, Tracker, TrackerAddress, TrackerOptions, osc_packet, parse_line, write_line,
};
use osp_session::{
    recording::{Event, StrokeId},
    scene::Scene,
};

fn told(events: &[Event]) -> Vec<Message> {
    let mut encoder = EventEncoder::new();
    let mut messages = Vec::new();
    events.iter().for_each(|event| encoder.encode(event, &mut messages));
    messages
}

fn line_of(message: &Message) -> String {
    let mut line = String::new();
    write_line(message, &mut line);
    line
}

#[test]
fn a_session_told_and_heard_gives_the_same_strokes() {
    let events = events_in(shipped_session("scribble"));
    let mut original = Scene::new();
    events.iter().for_each(|event| original.apply(event, &mut Vec::new()));
    let (mut hands, mut heard, mut out) = (Hands::default(), Scene::new(), Vec::new());
    let mut next = 0;
    for message in told(&events) {
        let stroke = || {
            next += 1;
            StrokeId(next)
        };
        let message = parse_line(&line_of(&message));
        hands.take(0.0, &message.expect("a line").expect("a message"), stroke, &mut out);
        out.drain(..).for_each(|event| heard.apply(&event, &mut Vec::new()));
    }
    let (a, b) = (original.counts(), heard.counts());
    assert_eq!((a.strokes, a.points), (b.strokes, b.points));
    // Pressures are combined with the least width by a multiplication, so the polygons are the same except for
    // rounding.
    assert!(a.polygons.abs_diff(b.polygons) * 100 <= a.polygons, "{} and {}", a.polygons, b.polygons);
}

#[test]
fn silence_ends_a_stroke() {
    let mut hands = Hands::default();
    let mut out = Vec::new();
    let message = parse_line("hand 0 1 0 0 0 0 1 0.5").expect("a line").expect("a message");
    hands.take(10.0, &message, || StrokeId(7), &mut out);
    hands.rest(10.5, &mut out);
    assert!(hands.is_drawing());
    hands.rest(10.1 + Hands::SILENCE_SECS, &mut out);
    assert!(!hands.is_drawing());
    assert!(matches!(out.last(), Some(Event::End { stroke: StrokeId(7), .. })));
}

#[test]
fn malformed_lines_are_refused() {
    for line in [
        "hand",
        "hand 0 0 0 0 0 0 1",
        "hand 0 0 0 0 0 0 1 x",
        "hand 0 0 0 0 0 0 0 1",
        "hand nan 0 0 0 0 0 1 1",
        "hand 1e30 0 0 0 0 0 1 1",
        "hand 0 0 0 0 0 0 1 1 256",
        "hand 0 0 0 0 0 0 1 1 0 0",
        "head 0 0 0 0 0 0 9",
        "brush pencil 1 0 0 0",
        "brush tube -1 0 0 0 1",
        "brush tube 1 0 0 0 1 0 sideways",
        "erase 1 2",
        "undo now",
        "jump",
    ] {
        assert!(parse_line(line).is_err(), "{line}");
    }
    for line in ["", "   ", "# hand"] {
        assert_eq!(parse_line(line), Ok(None));
    }
    assert!(
        parse_line("hand 0 0 0  0 0 0 1.02  3").is_ok(),
        "rounded quaternions and heavy hands are common"
    );
}

#[test]
fn a_socket_counts_what_it_cannot_read_and_lives_on() {
    let address = TrackerAddress::Udp("127.0.0.1:0".parse().expect("an address"));
    let tracker = Tracker::open(&address, &TrackerOptions::default(), || {}).expect("a tracker");
    let to = tracker.local_address.expect("a port");
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let mut nested = osc_packet(&Message::Undo);
    // Bundles are nested far deeper than any real ones.
    for _ in 0..1500 {
        let mut bundle = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
        bundle.extend((nested.len() as u32).to_be_bytes());
        bundle.extend(&nested);
        nested = bundle;
    }
    let packets: [&[u8]; 6] = [
        b"\xff\xfe\xfd",
        b"hand 1",
        b"/nowhere\0\0\0\0,\0\0\0",
        b"#bundle\0",
        &nested[..30_000.min(nested.len())],
        &nested,
    ];
    for (number, packet) in packets.iter().enumerate() {
        socket.send_to(packet, to).expect("sent");
        wait_until("a packet", || tracker.counts().malformed > number as u64);
    }
    socket.send_to(b"undo\nnonsense\nredo\n", to).expect("sent");
    wait_until("a packet", || tracker.counts().messages == 2);
    assert_eq!(
        (tracker.take(), tracker.take(), tracker.take()),
        (Some(Message::Undo), Some(Message::Redo), None)
    );
    let counts = tracker.counts();
    assert_eq!((counts.messages, counts.malformed, counts.dropped), (2, 7, 0));
}
