//! What a tracker, or anybody on the network, sends: lines and OSC packets. What is understood is sound, survives being
//! written and read again, and becomes sound events.

use osp_app::tracker::{Hands, Message, osc_packet, parse_line, parse_osc, write_line};
use osp_session::{recording::StrokeId, scene::Scene};

pub fn run(data: &[u8]) {
    let mut messages = Vec::new();
    let malformed = parse_osc(data, &mut messages);
    assert!(malformed + messages.len() as u64 <= data.len() as u64 + 1, "more messages than bytes");
    let text = String::from_utf8_lossy(data);
    for line in text.lines() {
        messages.extend(parse_line(line).ok().flatten());
    }
    for message in &messages {
        let mut line = String::new();
        write_line(message, &mut line);
        let again = parse_line(&line).expect(&line).expect("a message");
        assert!(is_close(&again, message), "{message:?} as a line: {again:?}");
        let mut again = Vec::new();
        assert_eq!(parse_osc(&osc_packet(message), &mut again), 0, "{message:?}");
        assert!(again.len() == 1 && is_close(&again[0], message), "{message:?} as a packet: {again:?}");
    }
    let (mut hands, mut events, mut next) = (Hands::default(), Vec::new(), 0);
    for (t, message) in messages.iter().enumerate() {
        let stroke = || {
            next += 1;
            StrokeId(next)
        };
        hands.take(t as f64 * 0.4, message, stroke, &mut events);
        hands.rest(t as f64 * 0.4, &mut events);
    }
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in &events {
        assert_eq!(event.check(), Ok(()), "{event:?}");
        scene.apply(event, &mut changes);
    }
}

/// The same, but for what making a quaternion's length one a second time changes.
fn is_close(a: &Message, b: &Message) -> bool {
    let mut turns = (None, None);
    let mut rest = [*a, *b];
    for (message, turn) in rest.iter_mut().zip([&mut turns.0, &mut turns.1]) {
        if let Message::Head { q, .. } | Message::Hand { q, .. } = message {
            *turn = Some(std::mem::take(q));
        }
    }
    let is_turned_alike = match turns {
        (Some(a), Some(b)) => a.abs_diff_eq(b, 1.0e-6),
        (None, None) => true,
        _ => false,
    };
    rest[0] == rest[1] && is_turned_alike
}
