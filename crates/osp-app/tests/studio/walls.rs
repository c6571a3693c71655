//! The strip for the operator of a wall: the state of the tracker, the place of the head, and the form of the screens'
//! pictures.

use std::{
    io::Write,
    net::UdpSocket,
    process::{Command as Process, Stdio},
};

use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use osp::glam::{Quat, Vec3};
use osp_app::{
    Room,
    tracker::{Message, TrackerOptions, parse_line},
};
use osp_session::rig::{Eye, Rig};

use crate::{
    panel::{Person, Window, sketch},
    tracker::{listen, sender, wait_until},
};

/// Returns a window on the rig `dual-wall` with a tracker, and the socket that sends to it.
fn on_walls() -> (Harness<'static, Window>, UdpSocket) {
    let mut harness = sketch();
    let studio = &mut harness.state_mut().studio;
    studio.set_room(Room::new(Rig::open("dual-wall").expect("a shipped rig")));
    studio.set_tracker(listen(&TrackerOptions::default()));
    let socket = sender(studio.tracker().expect("a tracker"));
    harness.run_steps(2);
    (harness, socket)
}

/// Sends a packet and shows frames until it was handled.
fn send(harness: &mut Harness<'_, Window>, socket: &UdpSocket, packet: &str) {
    let messages = |harness: &Harness<'_, Window>| {
        harness.state().studio.tracker().expect("a tracker").counts().messages
    };
    let before = messages(harness);
    socket.send(packet.as_bytes()).expect("sent");
    wait_until("the packet", || messages(harness) > before);
    harness.run_steps(2);
}

fn has(harness: &Harness<'_, Window>, part: &str) -> bool {
    harness.query_all_by_label_contains(part).next().is_some()
}

#[test]
fn a_head_behind_a_screen_sees_it_from_in_front_and_is_told() {
    let (mut harness, socket) = on_walls();
    let views = |harness: &Harness<'_, Window>| {
        let views = harness.state().studio.views();
        views.iter().map(|view| (view.screen, view.eye, view.is_clamped)).collect::<Vec<_>>()
    };
    let both =
        |screen: usize, is_clamped: bool| [(screen, Eye::Left, is_clamped), (screen, Eye::Right, is_clamped)];
    assert_eq!(views(&harness), [both(0, false), both(1, false)].concat());
    assert!(!has(&harness, "behind"));
    // A metre behind the right wall.
    send(&mut harness, &socket, "head 1.6 1.6 -1.6 0 0 0 1");
    assert_eq!(views(&harness), [both(0, false), both(1, true)].concat());
    assert!(has(&harness, "The head is behind right or too near to it"));
    let said = |harness: &Harness<'_, Window>| {
        let messages = harness.state().studio.messages();
        messages.iter().filter(|message| message.contains("behind `right` or too near to it")).count()
    };
    assert_eq!(said(&harness), 1);
    let rig = Rig::open("dual-wall").expect("a shipped rig");
    for view in harness.state().studio.views() {
        let projection = view.view.projection;
        assert!(projection.left.is_finite() && projection.right > projection.left);
        assert!(view.view.eye_in_world.is_finite());
        // Five centimetres in front of the right wall, and all of the wall in its picture.
        if view.screen == 1 {
            let width_m = rig.screens[1].lower_left.distance(rig.screens[1].lower_right);
            assert!(((projection.right - projection.left) * 0.05 - width_m).abs() < 1.0e-3);
        }
    }
    harness.run_steps(3);
    assert_eq!(said(&harness), 1, "it is said once");
    send(&mut harness, &socket, "head 0 1.6 0 0 0 0 1");
    assert_eq!(views(&harness), [both(0, false), both(1, false)].concat());
    assert!(!has(&harness, "The head is behind"));
}

#[test]
fn three_touched_corners_put_the_tracker_into_the_room() {
    let (mut harness, socket) = on_walls();
    let rig = Rig::open("dual-wall").expect("a shipped rig");
    let (turn, shift) = (Quat::from_rotation_y(2.0), Vec3::new(0.5, -1.25, 2.0));
    let in_tracker = |p: Vec3| turn.conjugate() * (p - shift);
    let hand = |p: Vec3, pressure: f32| {
        let p = in_tracker(p);
        format!("hand {} {} {} 0 0 0 1 {pressure}", p.x, p.y, p.z)
    };
    harness.choose("Calibrate the tracker…");
    let take = "Take this point (Enter)";
    assert!(harness.get_by_label(take).accesskit_node().is_disabled(), "there is no hand yet");
    let screen = &rig.screens[0];
    let corners = [screen.lower_left, screen.lower_right, screen.upper_left];
    for (corner, name) in corners.into_iter().zip(["lower left", "lower right", "upper left"]) {
        assert!(has(&harness, &format!("{name} corner: hold it there")));
        send(&mut harness, &socket, &hand(corner, 0.0));
        harness.choose(take);
    }
    assert!(has(&harness, "The points fit the corners to 0 mm."));
    assert!(has(&harness, "room_from_tracker: (p: ("));
    harness.choose("Use it now");
    assert!(!has(&harness, "Use it now"), "the dialog is closed");
    let of_rig = harness.state().studio.room().rig().expect("a rig").room_from_tracker;
    assert!(of_rig.p.distance(shift) < 1.0e-4 && of_rig.q.dot(turn).abs() > 0.9999);

    // New strokes are at the hand's place in the room, wherever the room is.
    let places = [Vec3::new(0.0, 1.0, -0.5), Vec3::new(0.2, 1.0, -0.5), Vec3::new(0.4, 1.0, -0.5)];
    for p in places {
        send(&mut harness, &socket, &hand(p, 1.0));
        let heard = harness.state().studio.watch().hand().expect("a hand");
        assert!(heard.in_room.0.distance(p) < 1.0e-4);
    }
    let studio = &harness.state().studio;
    let stroke = studio.scene().strokes().iter().next().expect("a stroke");
    let bounds = studio.session().bounds();
    let expected = places.map(|p| studio.room().to_world(studio.navigator(), p));
    assert!(stroke.polygon_count() > 0);
    for p in expected {
        assert!(bounds.min.cmple(p + 0.03).all() && bounds.max.cmpge(p - 0.03).all(), "{p} {bounds:?}");
    }

    // Escape closes the dialog, and points on a line are refused.
    harness.choose("Calibrate the tracker…");
    (0..3).for_each(|_| harness.choose(take));
    assert!(has(&harness, "expected three points that are apart"));
    harness.choose("Begin again");
    assert!(!has(&harness, "expected three points"));
    harness.press(egui::Key::Escape);
    assert!(!has(&harness, take));
}

/// The script that docs/walls.md names turns the output of VRPN's `vrpn_print_devices` into messages.
#[test]
fn a_script_makes_messages_of_what_vrpn_prints() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/vrpn.awk");
    let started =
        Process::new("awk").args(["-f", script]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let Ok(mut awk) = started else {
        eprintln!("skipped: there is no awk");
        return;
    };
    let printed = "Opened Tracker0@host as: Tracker Button Warning/Error.\n\
        Tracker Tracker0@host, sensor 0:\n        pos ( 0.10,  1.62, -0.30); quat ( 0.00,  0.71,  0.00,  0.71)\n\
        Tracker Tracker0@host, sensor 1:\n        pos ( 0.30,  1.10, -0.40); quat ( 0.00,  0.00,  0.00,  1.00)\n\
        Button Tracker0@host, number 0 was just pressed\n\
        Tracker Tracker0@host, sensor 1:\n        vel ( 9.30,  9.10, -9.40); quatvel ( 0.00,  0.00,  0.00,  1.00)\n\
        Tracker Tracker0@host, sensor 1:\n        pos ( 0.32,  1.10, -0.40); quat ( 0.00,  0.00,  0.00,  1.00)\n\
        Button Tracker0@host, number 0 was just released\n\
        Tracker Tracker0@host, sensor 3:\n        pos (-0.32,  1.10, -0.40); quat ( 0.00,  0.00,  0.00,  1.00)\n";
    awk.stdin.take().expect("a pipe").write_all(printed.as_bytes()).expect("written");
    let output = awk.wait_with_output().expect("awk");
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    let messages: Vec<Message> =
        lines.lines().map(|line| parse_line(line).expect("a message").expect("no comment")).collect();
    let Message::Head { p, q } = messages[0] else { panic!("a head first: {messages:?}") };
    assert_eq!(p, Vec3::new(0.1, 1.62, -0.3));
    assert!(q.dot(Quat::from_xyzw(0.0, 0.71, 0.0, 0.71).normalize()) > 0.9999, "{q}");
    let hands = messages[1..].iter().map(|message| match message {
        Message::Hand { hand, p, pressure, .. } => (*hand, p.x, *pressure),
        other => panic!("a hand: {other:?}"),
    });
    assert!(
        hands.eq([(1, 0.3, 0.0), (1, 0.3, 1.0), (1, 0.32, 1.0), (1, 0.32, 0.0), (3, -0.32, 0.0)]),
        "{lines}"
    );
}
