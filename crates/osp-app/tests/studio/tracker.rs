//! Any program may act as a tracker. The cost of its messages is bounded, and strangers are ignored.

use std::{net::UdpSocket, path::Path};

use crate::drawing::Table;
use osp::glam::Vec3;
use osp_app::{
    Button, Command, Room, Studio,
    tracker::{Message, Tracker, TrackerAddress, TrackerOptions},
};
use osp_session::{
    recording::{Event, Flush, Header, OpenOptions, RonWriter, StrokeId, open},
    rig::Rig,
};
use osp_testkit::events::polygon;
pub(crate) use osp_testkit::wait_until;

pub(crate) fn listen(options: &TrackerOptions) -> Tracker {
    let address = TrackerAddress::Udp("127.0.0.1:0".parse().expect("an address"));
    Tracker::open(&address, options, || {}).expect("a tracker")
}

pub(crate) fn sender(to: &Tracker) -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.connect(to.local_address.expect("a port")).expect("an address");
    socket
}

/// Makes a studio listen to a tracker, which sends this datagram with this number of messages.
pub(crate) fn hear(studio: &mut Studio, packet: &str, messages: u64) -> UdpSocket {
    studio.set_tracker(listen(&TrackerOptions::default()));
    let tracker = studio.tracker().expect("a tracker");
    let socket = sender(tracker);
    socket.send(packet.as_bytes()).expect("sent");
    wait_until("the datagram", || tracker.counts().messages == messages);
    socket
}

/// Writes a session of triangles of this size, each with its stroke and its place.
fn write_triangles(path: &Path, size_m: f32, triangles: impl Iterator<Item = (u32, Vec3)>) {
    let mut writer = RonWriter::create(path, &Header::new("", ""), Flush::AtEnd).expect("a file");
    for (stroke, p) in triangles {
        let vertices = [p, p + Vec3::X * size_m, p + Vec3::Y * size_m];
        writer.write(&polygon(Some(StrokeId(stroke)), vertices, (1.0, 1.0, 1.0, 1.0))).expect("a line");
    }
    writer.finish().expect("a file");
}

/// Returns places in a plane, 5 cm apart.
fn place(i: u32, k: u32) -> Vec3 {
    Vec3::new(i as f32 * 0.05, k as f32 * 0.05, 0.0)
}

/// Shows frames until no message is left. Returns their number.
fn frames(table: &mut Table) -> u32 {
    let mut frames = 0;
    loop {
        table.frame();
        frames += 1;
        if !table.studio.is_moving() {
            return frames;
        }
    }
}

#[test]
fn an_erasure_looks_at_what_is_near_and_a_frame_takes_few_of_them() {
    const SIDE: u32 = 140;
    let mut table = Table::new();
    let session = table.folder.path().join("field.ron");
    let triangles = (0..SIDE * SIDE).map(|number| (number, place(number % SIDE, number / SIDE)));
    write_triangles(&session, 0.004, triangles);
    table.act([Command::Open(session)]);
    assert_eq!(table.visible(), u64::from(SIDE * SIDE));
    // One datagram holds a thousand erasures, and every second one of them hits nothing.
    let mut packet = String::new();
    for number in 0..500 {
        let p = place(number % SIDE, number / SIDE);
        packet += &format!("erase {} {} {}\nerase {} {} 0.3\n", p.x, p.y, p.z, p.x, p.y);
    }
    hear(&mut table.studio, &packet, 1000);
    table.frame();
    let in_a_frame = table.studio.culling().searches().points;
    assert!((1..=64).contains(&in_a_frame), "{in_a_frame} erasures in a frame");
    assert!(table.studio.is_moving(), "the others have the next frames");
    assert!(frames(&mut table) >= 1000 / 64);
    assert_eq!(table.visible(), u64::from(SIDE * SIDE) - 500);
    let reaches = table.studio.culling().searches();
    assert_eq!(reaches.points, 1000);
    // Each erasure found its own triangle or nothing. Polygons that were erased in the same frame are still in the
    // index.
    assert!(reaches.near <= 2000, "{} polygons looked at for 1,000 erasures", reaches.near);
}

#[test]
fn what_was_drawn_in_the_same_frame_is_erased_and_the_nearest_first() {
    let mut table = Table::new();
    let mut packet = String::from("brush ribbon 0.002 1 1 1 1\n");
    for x in [0.0, 0.006] {
        for i in 0..4 {
            packet += &format!("hand {x} {} 0 0 0 0 1 1\n", 0.1 * i as f32);
        }
        packet += &format!("hand {x} 0.3 0 0 0 0 1 0\n");
    }
    packet += "erase 0.005 0.15 0\n";
    hear(&mut table.studio, &packet, 12);
    frames(&mut table);
    let left: Vec<f32> =
        table.studio.scene().visible_ids().map(|id| table.studio.scene().bounds(id).center().x).collect();
    assert!(left.len() == 3 && left.iter().all(|x| x.abs() < 0.002), "{left:?}");
}

#[test]
fn a_flood_of_edits_of_a_large_stroke_is_spread_over_frames() {
    const POLYGONS: u32 = 70_000;
    let folder = tempfile::tempdir().expect("a folder");
    let session = folder.path().join("large.ron");
    write_triangles(&session, 0.01, (0..POLYGONS).map(|number| (7, place(number % 300, number / 300))));
    let mut table = Table::new();
    table.act([Command::Open(session)]);
    hear(&mut table.studio, &"undo\nredo\n".repeat(10), 20);
    let mut frames = 0;
    while table.studio.is_moving() || frames == 0 {
        let record = table.frame().record;
        frames += 1;
        assert!(record.inserted + record.removed <= u64::from(POLYGONS), "{record:?}");
    }
    assert_eq!((frames, table.visible()), (21, u64::from(POLYGONS)));
}

#[test]
fn one_sender_is_listened_to_and_others_are_counted() {
    let tracker = listen(&TrackerOptions::default());
    let (first, second) = (sender(&tracker), sender(&tracker));
    first.send(b"undo").expect("sent");
    wait_until("a message", || tracker.counts().messages == 1);
    second.send(b"redo\nredo").expect("sent");
    wait_until("a refusal", || tracker.counts().refused == 1);
    first.send(b"nonsense\nundo").expect("sent");
    wait_until("a message", || tracker.counts().messages == 2);
    assert_eq!(
        [tracker.take(), tracker.take(), tracker.take()],
        [Some(Message::Undo), Some(Message::Undo), None]
    );
    assert_eq!(tracker.counts().malformed, 1);
}

#[test]
fn a_datagram_has_so_many_messages_and_no_more() {
    let tracker = listen(&TrackerOptions::default());
    let socket = sender(&tracker);
    socket.send("undo\n".repeat(13_000).as_bytes()).expect("sent");
    wait_until("the datagram", || {
        tracker.counts().messages >= 1024 && tracker.counts().dropped >= 13_000 - 1024
    });
    assert_eq!((tracker.counts().messages, tracker.counts().dropped), (1024, 13_000 - 1024));
    let mut bundle = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
    for _ in 0..3000 {
        bundle.extend(b"\0\0\0\x10/osp/undo\0\0\0,\0\0\0");
    }
    socket.send(&bundle).expect("sent");
    wait_until("the bundle", || {
        tracker.counts().messages >= 2048 && tracker.counts().dropped >= 13_000 - 1024 + 3000 - 1024
    });
    assert_eq!(tracker.counts().messages, 2048);
}

#[test]
fn a_stream_without_lines_is_given_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("noise.txt");
    let mut text = "undo\n".to_owned();
    text += &"x".repeat(3 << 20);
    text += "\nredo\n";
    std::fs::write(&path, text).expect("a file");
    let open = |path: &Path| {
        let address = TrackerAddress::File(path.to_owned());
        Tracker::open(&address, &TrackerOptions::default(), || {}).expect("a tracker")
    };
    let tracker = open(&path);
    wait_until("the end of patience", || tracker.counts().has_given_up);
    assert_eq!((tracker.take(), tracker.take(), tracker.counts().malformed), (Some(Message::Undo), None, 1));
    // A line that is only too long is skipped.
    let mut text = "undo\n".to_owned();
    text += &"x".repeat(1 << 19);
    text += "\nredo\n";
    std::fs::write(&path, text).expect("a file");
    let tracker = open(&path);
    wait_until("both messages", || tracker.counts().messages == 2);
    assert_eq!((tracker.counts().has_given_up, tracker.counts().malformed), (false, 1));
    // A file without an end is refused at once.
    if cfg!(unix) {
        let address = TrackerAddress::File("/dev/zero".into());
        let error = Tracker::open(&address, &TrackerOptions::default(), || {}).expect_err("no file");
        let told = error.to_string();
        assert!(told.contains("/dev/zero") && told.contains("expected a regular file"), "{told}");
    }
}

#[test]
fn a_long_file_is_read_whole_however_slowly_it_is_taken() {
    const LINES: usize = (1 << 16) + 5000;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("poses.txt");
    std::fs::write(&path, "undo\n".repeat(LINES)).expect("a file");
    let (sender, woken) = std::sync::mpsc::channel();
    let wake = move || sender.send(()).unwrap_or(());
    let tracker =
        Tracker::open(&TrackerAddress::File(path), &TrackerOptions::default(), wake).expect("a tracker");
    wait_until("a full queue", || tracker.counts().messages > 1 << 16);
    assert_eq!(woken.try_iter().count(), 1, "woken once until somebody looks");
    let mut taken = 0;
    wait_until("every line", || {
        taken += std::iter::from_fn(|| tracker.take()).count();
        taken == LINES
    });
    assert_eq!((tracker.counts().messages, tracker.counts().dropped), (LINES as u64, 0));
    assert!(woken.try_iter().count() >= 1);
}

#[test]
fn a_brush_that_nobody_knows_is_a_plain_ribbon_and_named_once() {
    let mut table = Table::new();
    table.studio.set_tracker(listen(&TrackerOptions::default()));
    let tracker = table.studio.tracker().expect("a tracker");
    let socket = sender(tracker);
    let stroke = "hand 0 0 0 0 0 0 1 1\nhand 0.1 0 0 0 0 0 1 1\nhand 0.1 0 0 0 0 0 1 0\n";
    for brush in ["Foo", "Foo", "B\u{202e}ar"] {
        let packet = format!("brush {brush} 0.02 1 0 0 1\n{stroke}");
        socket.send(packet.as_bytes()).expect("sent");
    }
    // As OSC, too.
    let mut osc = b"/osp/brush\0\0,sfffff\0Baz\0".to_vec();
    osc.extend([0.02_f32, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|number| number.to_be_bytes()));
    socket.send(&osc).expect("sent");
    wait_until("the datagrams", || tracker.counts().messages == 13);
    assert_eq!(tracker.counts().malformed, 0);
    frames(&mut table);
    let strokes: Vec<_> = table.studio.scene().strokes().iter().collect();
    assert_eq!(strokes.len(), 3);
    assert!(strokes.iter().all(|stroke| stroke.brush().is_none() && stroke.polygon_count() > 0));
    let said = |name: &str| {
        let text = format!("tracker: the brush `{name}` is unknown: its strokes are plain ribbons");
        table.studio.messages().iter().filter(|message| **message == text).count()
    };
    assert_eq!([said("Foo"), said("B\\u{202e}ar"), said("Baz")], [1, 1, 1], "{:?}", table.studio.messages());
}

/// The head and the hand are at one place of a room that was flown through the model. In the session they must also be
/// at the same place.
#[test]
fn head_and_hand_are_recorded_in_the_same_space() {
    let mut table = Table::new();
    table.studio.set_room(Room::new(Rig::open("dual-wall").expect("a shipped rig")));
    table.drag(Button::Secondary, &[(0.0, 0.0), (0.3, 0.1), (0.8, 0.2)]);
    let (turn, mut packet) = ("0 0.6 0 0.8", String::new());
    for i in 0..4 {
        packet += &format!(
            "head 0.2 {} 0.3 {turn}\nhand 0.2 {} 0.3 {turn} 1\n",
            1.0 + 0.1 * i as f32,
            1.0 + 0.1 * i as f32
        );
    }
    packet += "hand 0.2 1.3 0.3 0 0 0 1 0\n";
    hear(&mut table.studio, &packet, 9);
    frames(&mut table);
    let saved = table.folder.path().join("walls.ron");
    table.act([Command::SaveAs(saved.clone())]);
    let (mut heads, mut points) = (Vec::new(), Vec::new());
    for event in open(&saved, &OpenOptions::STRICT).expect("a session") {
        match event.expect("a whole line") {
            Event::Head { p, q, .. } => heads.push((p, q)),
            Event::Point { p, q, .. } => points.push((p, q)),
            _ => {}
        }
    }
    assert_eq!(heads.len(), 4);
    for ((head, turn), (hand, of_hand)) in heads.iter().zip(&points) {
        assert!(head.distance(*hand) < 1.0e-5 && turn.dot(*of_hand).abs() > 0.9999, "{head} {hand}");
        assert!(head.distance(Vec3::new(0.2, head.y, 0.3)) > 0.1, "the room stands elsewhere: {head}");
    }
}
