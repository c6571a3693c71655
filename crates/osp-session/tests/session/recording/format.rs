//! The format: written events are read back unchanged, and hand-written forms are accepted.

use super::events::{LENIENT, STRICT, event, pose_event, read, sample_events, undo, write};
use glam::{Quat, Vec3};
use osp_session::recording::{
    Camera, Event, Header, OpenOptions, RecordingError, RonReader, Root, StrokeId, Tool, open, open_ron,
};
use proptest::prelude::*;

fn header() -> Header {
    Header {
        root: Some(Root { center: Vec3::new(0.0, 1.5, 0.0), size: 4.0 }),
        camera: Some(Camera { p: Vec3::ZERO, q: Quat::IDENTITY, fov_degrees: 60.0, near_m: Some(0.05) }),
        ..Header::new("two\nlines, \"quotes\", a // comment and \u{2028}", "a test")
    }
}

/// Bitwise equality, because `==` treats -0.0 and 0.0 as equal.
fn same(a: &Event, b: &Event) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

fn parse(line: &str) -> Event {
    let outcome = read(format!("Header(format: 1)\n{line}\n").as_bytes(), STRICT);
    assert!(outcome.error.is_none(), "{line}: {:?}", outcome.error);
    outcome.events.into_iter().next().unwrap()
}

fn message(text: &str) -> String {
    read(text.as_bytes(), STRICT).error.expect("an error").to_string()
}

#[test]
fn every_kind_of_event_comes_back() {
    let bytes = write(&header(), &sample_events());
    assert_eq!(bytes.iter().filter(|&&b| b == b'\n').count(), 1 + sample_events().len(), "one line each");
    let reader = RonReader::new(&bytes[..], "test.ron", STRICT).unwrap();
    assert_eq!(*reader.header(), header());
    let outcome = read(&bytes, STRICT);
    assert!(outcome.error.is_none() && outcome.notes.warnings.is_empty());
    assert_eq!(outcome.events.len(), sample_events().len());
    assert!(outcome.events.iter().zip(&sample_events()).all(|(a, b)| same(a, b)));
}

#[test]
fn lines_are_compact_and_leave_out_what_is_usual() {
    let text = String::from_utf8(write(&Header::new("n", "s"), &sample_events())).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], r#"Header(format:2,name:"n",source:"s")"#);
    assert_eq!(lines[1], "Head(t:0.016,p:(0.1,1.6,-0.3),q:(0.5,-0.5,0.5,0.5))");
    assert_eq!(
        lines[3],
        "Point(t:0.03,stroke:7,p:(1e-7,-0.0,34000000000.0),q:(0.5,-0.5,0.5,0.5),pressure:0.8)"
    );
    assert_eq!(lines[6], "Point(t:0.06,stroke:7,p:(1.0,1.0,1.0))");
    assert_eq!(lines[13], "Group(t:0.0,group:4,strokes:[],parent:3)");
}

#[test]
fn a_hand_written_file_is_understood() {
    let text = "\u{FEFF}// a comment before the header\r\n\
                \r\n\
                Header(format: 1, name: \"x\", root: (center: (0, 1.5, 0), size: 4))\r\n\
                // comment\r\n\
                \t Begin( t : 0, stroke : 0x10, tool: Ribbon, width: 1e-2, color: (1,1,1,1), ) // trailing\r\n\
                Point(stroke: 16, p: (1, 2, 3), t: 1_0.5)\r\n\
                Polygon(vertices: [(0,0,0),(1,0,0),(0,1,0)], stroke: Some(3), color: (0,0,0,1))\r\n\
                // the end";
    let outcome = read(text.as_bytes(), STRICT);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert!(outcome.notes.warnings.is_empty());
    let [Event::Begin { stroke: StrokeId(16), tool: Tool::Ribbon, width: 0.01, .. }, point, polygon] =
        &outcome.events[..]
    else {
        panic!("{:?}", outcome.events);
    };
    let p = Vec3::new(1.0, 2.0, 3.0);
    assert_eq!(*point, Event::Point { t: 10.5, stroke: StrokeId(16), p, q: Quat::IDENTITY, pressure: 1.0 });
    assert!(matches!(polygon, Event::Polygon { stroke: Some(StrokeId(3)), t: 0.0, .. }));
}

#[test]
fn headers_that_are_none_are_refused_shortly() {
    let gibberish: Vec<u8> =
        (0..100_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8 | 0x80).collect();
    let error = read(&gibberish, STRICT).error.expect("an error").to_string();
    assert!(error.contains("not UTF-8") && error.chars().count() < 300, "{error}");
    let only = read(b"Header(format: 1)", STRICT);
    assert!(only.error.is_none() && only.events.is_empty() && only.notes.warnings.is_empty());
}

/// The errors of headers, a newer format among them, and of lines.
#[test]
fn messages_name_line_expectation_and_finding() {
    let headers = [
        "",
        "\n// only this\n",
        "PK\u{3}\u{4}binary\n",
        "Undo(t: 1)\n",
        "Header(name: \"x\")\n",
        "Header(format: 1, colour: 3)\n",
        "Header(format: 1, root: (center: (0,0,0), size: -1))\n",
        "Header(format: 5, shape: [1, 2], root: (where: 3))\nGlow(t: 1)\n",
        "Header(format: 0)\n",
    ];
    let with = |line: &str| message(&format!("Header(format: 1)\nUndo(t: 1)\n{line}\nUndo(t: 2)\n"));
    let lines = [
        "Glow(t: 1, stroke: 2)",
        "Undo(t: 1, s: 2)",
        "Point(t: 1, p: (0,0,0))",
        "End(t: 1, stroke: x)",
        "Undo(t: 1) Undo(t: 2)",
        "End(t: 1, stroke: -1)",
        "Head(t: 1, p: (0, zero, 0), q: (0,0,0,1))",
        "\"Undo\"",
        "Undo(t: 1",
        "Begin(t: 1, stroke: 1, tool: Ribbon, width: 1e38, color: (1, 1, 1, 1))",
        "Undo(t: NaN)",
        "Point(t: 1, stroke: 2, p: (0,0,1e16))",
    ];
    insta::assert_snapshot!([&headers.map(message)[..], &lines.map(with)].concat().join("\n"));
    assert!(with(&"(".repeat(100_000)).chars().count() < 300);
    let long = with(&format!("Undo(t: {}x)", "1".repeat(1000)));
    assert!(long.chars().count() < 250, "{long}");
}

#[test]
fn a_lenient_reader_skips_and_counts() {
    let text = "Header(format: 1)\nUndo(t: 1)\nGlow(t: 1)\n\u{1}\u{2}\nUndo(t: NaN)\nUndo(t: 2)\nUndo(t:";
    let outcome = read(text.as_bytes(), LENIENT);
    assert_eq!(outcome.events, [undo(1.0), undo(2.0)]);
    assert_eq!(outcome.notes.skipped, 3);
    assert_eq!(outcome.notes.warnings.len(), 2, "the first skipped line, and the cut: {:?}", outcome.notes);
    assert!(outcome.notes.warnings[1].contains("line 7: the file ends inside this line"));
    assert!(read(b"Glow\n", LENIENT).error.is_some(), "a header is never skipped");
}

#[test]
fn open_decides_by_content_and_says_what_it_knows() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let options = OpenOptions::default();
    let text = write(&header(), &sample_events());
    for name in ["a.ron", "a.RON", "a.txt", "a", "plain.ron.zst"] {
        let session = open(&path(name, &text), &options).unwrap();
        assert_eq!((session.format, &session.header), ("ron", &header()), "{name}");
        assert_eq!(session.filter(Result::is_ok).count(), sample_events().len());
    }
    let error = open(&path("b.dat", b"what is this?"), &options).unwrap_err();
    assert!(matches!(error, RecordingError::Unknown { .. }));
    assert!(error.to_string().contains(".ron"), "{error}");
    assert!(matches!(open(&path("c.ron", b"what?"), &options), Err(RecordingError::Line { line: 1, .. })));
    assert!(matches!(open_ron(&path("d", b""), &options), Err(RecordingError::Line { line: 1, .. })));
    let missing = open(&folder.path().join("missing.ron"), &options).unwrap_err();
    assert!(missing.to_string().contains("missing.ron"), "{missing}");
    assert!(matches!(open(folder.path(), &options), Err(RecordingError::Unknown { .. })));
}

proptest! {
    #[test]
    fn any_event_comes_back_bit_for_bit(events in prop::collection::vec(event(), 1..40)) {
        let bytes = write(&header(), &events);
        let outcome = read(&bytes, STRICT);
        prop_assert!(outcome.error.is_none(), "{:?}", outcome.error);
        prop_assert_eq!(outcome.events.len(), events.len());
        for (read, written) in outcome.events.iter().zip(&events) {
            prop_assert!(same(read, written), "{:?} {:?}", read, written);
        }
        prop_assert_eq!(write(&header(), &outcome.events), bytes, "written again, the same bytes");
    }

    /// Compares the fast parser for poses with the general parser: the same bits, or the same error, also for damaged
    /// or unusual lines.
    #[test]
    fn the_short_way_agrees_with_ron(
        event in pose_event(),
        spaces in any::<bool>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), "[-+0-9a-z.,:() _e]{0,2}"), 0..3),
    ) {
        let mut line = String::from_utf8(write(&header(), std::slice::from_ref(&event))).unwrap();
        line = line.lines().nth(1).unwrap().to_owned();
        if spaces {
            line = line.replace(':', ": ").replace(',', ", ");
        }
        for (at, text) in &edits {
            let at = at.index(line.len());
            line.replace_range(at..(at + 1).min(line.len()), text);
        }
        if line.trim().is_empty() {
            return Ok(());
        }
        let general = ron::from_str::<Event>(&line).ok().filter(|event| event.check().is_ok());
        let outcome = read(format!("Header(format: 1)\n{line}\n").as_bytes(), STRICT);
        match general {
            Some(event) => {
                prop_assert_eq!(outcome.events.len(), 1, "{}: {:?}", line, outcome.error);
                prop_assert!(same(&outcome.events[0], &event), "{}", line);
            }
            None => prop_assert!(outcome.error.is_some(), "{}", line),
        }
    }
}

#[test]
fn numbers_of_every_notation_agree_with_ron() {
    for number in [
        "0", "-0", "1.", ".5", "+1", "1e3", "1E3", "1e+3", "1e-3", "007", "0x1F", "1_000.5", "1.5f32", "1f64",
    ] {
        let line = format!("Point(t:0.0,stroke:1,p:({number},0.0,0.0))");
        match ron::from_str::<Event>(&line) {
            Ok(event) => assert!(same(&parse(&line), &event), "{line}"),
            Err(_) => {
                let outcome = read(format!("Header(format: 1)\n{line}\n").as_bytes(), STRICT);
                assert!(outcome.error.is_some(), "{line}");
            }
        }
    }
}
