//! Limits of a session's size: everything that takes memory is refused beyond the limits, and the part before is used.

use std::path::Path;

use super::events::{Outcome, read_file};
use osp_session::recording::{Event, Limits, Notes, OpenOptions, RecordingError, open};

const BEGIN: &str = "Begin(t:0,stroke:0,tool:Ribbon,width:0.1,color:(1,1,1,1))\n";
const POINT: &str = "Point(t:0,stroke:0,p:(0,0,0))\n";

fn read(path: &Path, lenient: bool, limits: Limits) -> Outcome {
    read_file(path, OpenOptions { lenient, limits, ..OpenOptions::STRICT })
}

/// Reads all of `allowed`. Of `allowed` followed by `more` it reads the allowed part; checks the error about the rest.
fn refuses(allowed: &str, more: &str, expected: &str, read_before: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.ron");
    let limits = Limits { polygons: 32, ..Limits::DEFAULT };
    let header = "Header(format:1,name:\"x\",source:\"y\")\n";
    std::fs::write(&path, format!("{header}{allowed}")).unwrap();
    let whole = read(&path, false, limits);
    assert!(whole.error.is_none(), "{:?}", whole.error);
    assert_eq!(whole.notes, Notes::default());
    std::fs::write(&path, format!("{header}{allowed}{more}{POINT}{POINT}")).unwrap();

    let strict = read(&path, false, limits);
    let Some(error @ RecordingError::Limit { .. }) = strict.error else { panic!("{:?}", strict.error) };
    assert_eq!(strict.events, whole.events);
    let line = allowed.lines().count() + 2;
    let said = error.to_string();
    assert!(said.contains(&format!("large.ron, line {line}: expected at most {expected}")), "{said}");
    assert!(said.contains("(--max-polygons N allows more)"), "{said}");
    assert!(said.contains(&format!("read before: {read_before}")), "{said}");

    let lenient = read(&path, true, limits);
    assert!(lenient.error.is_none());
    assert_eq!((&lenient.events, lenient.notes.skipped), (&whole.events, 1));
    assert!(lenient.notes.warnings[0].contains(expected), "{:?}", lenient.notes);

    let raised = read(&path, false, Limits::DEFAULT);
    assert_eq!((raised.error.is_none(), raised.events.len()), (true, whole.events.len() + 3));
}

#[test]
fn polygons_are_limited_by_what_makes_them() {
    let ribbon = format!("{BEGIN}{}", POINT.repeat(32));
    refuses(&ribbon, POINT, "32 polygons", "1 strokes, 32 points");
    // A stroke between others, and samples without a stroke.
    let other = "Begin(t:0,stroke:1,tool:Wall,width:0.1,color:(1,1,1,1))\nPoint(t:0,stroke:1,p:(0,0,0))\n";
    let nobody = "Point(t:0,stroke:9,p:(0,0,0))\n";
    refuses(
        &format!("{BEGIN}{}{other}{nobody}", POINT.repeat(31)),
        POINT,
        "32 polygons",
        "2 strokes, 33 points",
    );
    // A tube has one polygon per side for each sample.
    let samples = 32 / osp_session::stroke::TUBE_SIDES;
    let tube = BEGIN.replace("Ribbon", "Tube") + &POINT.repeat(samples);
    refuses(&tube, POINT, "32 polygons", &format!("1 strokes, {samples} points"));
    // A second `Begin` does not change a tube to a ribbon.
    refuses(&format!("{tube}{BEGIN}"), POINT, "32 polygons", "2 strokes");
    let quad = "Polygon(vertices:[(0,0,0),(1,0,0),(1,1,0),(0,1,0)],color:(1,1,1,1))\n";
    refuses(&quad.repeat(16), quad, "32 polygons", "0 strokes, 0 points, 16 faces");
}

#[test]
fn strokes_groups_and_events_are_limited() {
    let begins: String = (0..8).map(|i| BEGIN.replace("stroke:0", &format!("stroke:{i}"))).collect();
    refuses(&begins, &BEGIN.replace("stroke:0", "stroke:8"), "8 strokes", "8 strokes");
    let face = "Polygon(stroke:77,vertices:[(0,0,0),(1,0,0),(1,1,0)],color:(1,1,1,1))\n";
    refuses(&begins, face, "8 strokes", "8 strokes");
    let group = "Group(t:0,group:1,strokes:[])\n";
    refuses(&group.repeat(8), group, "8 groupings", "0 strokes, 0 points, 0 faces, 8 groupings");
    let undo = "Undo(t:0)\n";
    refuses(&undo.repeat(128), undo, "128 events and strokes in edits", "0 strokes");
}

/// Undo stores the strokes that a move lists, so many moves of many strokes take memory.
#[test]
fn strokes_that_edits_name_are_limited() {
    let names = |n: usize| vec!["3"; n].join(",");
    let a_move = |n| format!("Move(t:0,strokes:[{}],by:(1,0,0))\n", names(n));
    refuses(&format!("{}{}", a_move(61), a_move(65)), &a_move(1), "128 events", "0 strokes");
    let group = format!("Group(t:0,group:1,strokes:[{}])\n", names(200));
    refuses("", &group, "128 events", "0 strokes");
}

mod packed {
    use super::*;

    /// Many copies of a compressed line, each in its own frame: a file that expands to a thousand times its size.
    fn bomb(line: &str, times: usize) -> Vec<u8> {
        let frame = zstd::encode_all(line.repeat(1000).as_bytes(), 19).unwrap();
        let head = format!("Header(format:1,name:\"x\",source:\"y\")\n{BEGIN}");
        [zstd::encode_all(head.as_bytes(), 1).unwrap(), frame.repeat(times)].concat()
    }

    #[test]
    fn what_a_packed_file_may_become_is_limited() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bomb.ron.zst");
        for line in [POINT, "// nothing at all, over and over\n"] {
            let bytes = bomb(line, 200);
            std::fs::write(&path, &bytes).unwrap();
            let most = Limits::DEFAULT.unpacked_bytes(bytes.len() as u64);
            assert_eq!(most, (1 << 20) + 32 * bytes.len() as u64);
            assert!((line.len() * 200_000) as u64 > most * 2, "it unpacks to more");
            let strict = read(&path, false, Limits::DEFAULT);
            let said = strict.error.expect("a limit").to_string();
            assert!(said.contains("bomb.ron.zst, line "), "{said}");
            let expected =
                format!("expected at most {most} bytes unpacked from {} (--max-polygons N", bytes.len());
            assert!(said.contains(&expected) && said.contains("read before: 1 strokes"), "{said}");
            // All events came before the limit, except for those in a buffer.
            let allowed = if line == POINT { most as usize / line.len() } else { 0 };
            assert!(
                strict.events.len() > allowed.saturating_sub(6000) && strict.events.len() <= allowed + 1,
                "{}",
                strict.events.len()
            );

            let lenient = read(&path, true, Limits::DEFAULT);
            assert!(lenient.error.is_none());
            assert_eq!((lenient.events, lenient.notes.skipped), (strict.events, 1));
            assert!(lenient.notes.warnings[0].contains("--max-polygons"), "{:?}", lenient.notes);
            let raised = read(&path, false, Limits { unpacking: 10_000, ..Limits::DEFAULT });
            assert!(raised.error.is_none());
            assert_eq!(raised.events.len(), if line == POINT { 200_001 } else { 1 });
        }
    }

    #[test]
    fn a_header_behind_a_bomb_is_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bomb.ron.zst");
        let frame = zstd::encode_all("// nothing\n".repeat(10_000).as_bytes(), 19).unwrap();
        std::fs::write(&path, frame.repeat(100)).unwrap();
        let error = open(&path, &OpenOptions::default()).expect_err("a limit");
        assert!(matches!(error, RecordingError::Limit { .. }), "{error}");
    }

    #[test]
    fn what_packs_as_drawings_do_is_read_whole() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["portrait", "room", "grow", "scribble"] {
            let text = std::fs::read(format!("{}/recordings/{name}.ron", osp_testkit::ROOT)).unwrap();
            let packed = zstd::encode_all(&text[..], 3).unwrap();
            let ratio = text.len() as f64 / packed.len() as f64;
            assert!(ratio < 0.25 * Limits::DEFAULT.unpacking as f64, "{name} packs to 1/{ratio}");
            let path = folder.path().join("a.ron.zst");
            std::fs::write(&path, packed).unwrap();
            assert!(read(&path, false, Limits::DEFAULT).error.is_none(), "{name}");
        }
    }
}

#[test]
fn lists_count_for_what_they_hold() {
    let text = "Header(format:1,name:\"x\",source:\"y\")\nMove(t:0,strokes:[1,2,3],by:(0,0,0))\nUndo(t:0)\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, text).unwrap();
    let events: Vec<Event> = open(&path, &OpenOptions::default()).unwrap().map(Result::unwrap).collect();
    assert_eq!(events.iter().map(Event::list_len).collect::<Vec<_>>(), [3, 0]);
}
