//! Brushes, light and layers in a recording: they are read back as written, and invalid numbers are refused.

use super::events::{STRICT, read, undo, write};
use glam::{Quat, Vec3};
use osp_session::recording::{
    Environment, Event, Flush, Header, Layer, NormalRule, OpenOptions, Paint, RonReader, RonWriter, StrokeId,
    open,
};
use osp_testkit::events::Begin;

fn environment() -> Environment {
    Environment {
        preset: "Standard".into(),
        sky: [Vec3::splat(0.25), Vec3::new(0.0, 0.125, 1.0)],
        sky_rotation: Quat::from_xyzw(0.5, -0.5, 0.5, 0.5),
        room_rotation: Quat::from_xyzw(0.0, 0.6, 0.0, 0.8),
        floor: Some(Vec3::splat(0.1)),
        fog: (Vec3::X, 0.025),
        ambient: Vec3::splat(0.4),
        lights: [(Vec3::NEG_Y, Vec3::splat(30.0)), (Vec3::ZERO, Vec3::ZERO)],
        reflection: 0.3,
        ..Environment::default()
    }
}

pub(crate) fn header() -> Header {
    Header {
        environment: Some(Box::new(environment())),
        layers: vec![
            Layer { name: "one".into(), hidden: false },
            Layer { name: "\"two\"\n".into(), hidden: true },
        ],
        left_out: vec!["2 models (a.glb, b)".into()],
        sketch_metadata: Some("{\"Palette\":\n []}\u{2028}".into()),
        ..Header::new("n", "s")
    }
}

fn begin(stroke: u32, paint: Option<Paint>) -> Event {
    Begin {
        width: 0.01,
        color: (1.0, 0.5, 0.0, 1.0),
        normal: NormalRule::Travel,
        paint: paint.map(Box::new),
        ..Begin::of(StrokeId(stroke))
    }
    .event()
}

#[test]
fn light_layers_and_brushes_come_back() {
    let events = [
        begin(1, Some(Paint { scale: 0.5, layer: 1, hidden: true, sketch_group: 9, ..Paint::new("Ink", 7) })),
        begin(2, Some(Paint::new("Ink", 0))),
        begin(3, None),
    ];
    let bytes = write(&header(), &events);
    assert_eq!(*RonReader::new(&bytes[..], "test.ron", STRICT).unwrap().header(), header());
    assert_eq!(read(&bytes, STRICT).events, events);
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines[1].ends_with(r#"paint:(brush:"Ink",seed:7,scale:0.5,layer:1,hidden:true,sketch_group:9))"#),
        "{}",
        lines[1]
    );
    assert!(lines[2].ends_with(r#"paint:(brush:"Ink"))"#), "what is usual is left out: {}", lines[2]);
    assert!(!lines[3].contains("paint"), "{}", lines[3]);
    assert!(lines[0].contains(r#"sketch_metadata:"{\"Palette\":\n []}"#), "{}", lines[0]);
    assert!(lines[0].contains(r#"layers:[(name:"one"),(name:"\"two\"\n",hidden:true)]"#), "{}", lines[0]);
}

#[test]
fn light_and_brushes_that_make_no_sense_are_refused() {
    let painted = begin(1, Some(Paint { scale: 0.5, seed: 3, layer: 2, ..Paint::new("Ink", 0) }));
    let sound = String::from_utf8(write(&header(), &[painted])).unwrap();
    let long = format!("\"{}\"", "x".repeat(65));
    let mut said = String::new();
    for (from, to) in [
        ("sky:((0.25,", "sky:((-0.25,"),
        ("ambient:(0.4,", "ambient:(NaN,"),
        ("30.0", "1e30"),
        ("0.025", "-0.025"),
        ("0.025", "inf"),
        ("reflection:0.3", "reflection:NaN"),
        ("((0.0,-1.0,0.0)", "((0.0,-3.0,0.0)"),
        ("(0.5,-0.5,0.5,0.5)", "(0.5,-0.5,0.5,0.1)"),
        ("(0.0,0.6,0.0,0.8)", "(0.0,0.6,0.0,0.1)"),
        ("\"Standard\"", &long),
        ("reflection:", "shine:"),
        ("fog:", "fog:3,ambient:"),
        ("scale:0.5", "scale:0.0"),
        ("scale:0.5", "scale:-1.0"),
        ("scale:0.5", "scale:NaN"),
        ("scale:0.5", "scale:1e30"),
        ("\"Ink\"", &long),
        ("seed:3", "seed:4294967296"),
        ("layer:2", "layer:-2"),
        ("layer:2", "hidden:2"),
        ("brush:\"Ink\",", ""),
        ("seed:", "seeds:"),
    ] {
        let text = sound.replacen(from, to, 1);
        assert_ne!(text, sound, "{from}");
        said += &format!("{from} as {to}: {}\n", read(text.as_bytes(), STRICT).error.expect("an error"));
    }
    insta::assert_snapshot!(said);
    let environment = Some(Box::new(Environment { reflection: f32::NAN, ..environment() }));
    let unsound = Header { environment, ..header() };
    assert!(RonWriter::new(Vec::new(), "x.ron", &unsound, Flush::AtEnd).is_err(), "nor is it written");
}

#[test]
fn a_recording_of_format_1_may_be_gone_on_with_and_hold_brushes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.ron");
    std::fs::write(&path, "Header(format: 1, name: \"old\")\nUndo(t: 1)\n").unwrap();
    let painted = begin(1, Some(Paint::new("Light", 5)));
    let (mut writer, header) = RonWriter::append(&path, Flush::EachEvent).unwrap();
    assert_eq!(header.format, 1);
    writer.write(&painted).unwrap();
    writer.finish().unwrap();
    let mut session = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(session.header.format, 1);
    assert_eq!(session.events.next_event().unwrap(), Some(undo(1.0)));
    assert_eq!(session.events.next_event().unwrap(), Some(painted));
    assert_eq!(session.events.next_event().unwrap(), None);
}
