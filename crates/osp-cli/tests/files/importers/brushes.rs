//! Which of our brushes the strokes of other programs get.

use super::files::{Bytes, apa, raw_points, read_sound, write, write_cassie};
use osp_session::{
    brush,
    recording::{Event, OpenOptions, open},
};

/// Brush, width and pressures of each stroke.
fn painted(events: &[Event]) -> Vec<(Option<String>, f32, Vec<f32>)> {
    let mut strokes = Vec::new();
    for event in events {
        match event {
            Event::Begin { paint, width, .. } => {
                strokes.push((paint.as_ref().map(|paint| paint.brush.clone()), *width, Vec::new()));
            }
            Event::Point { pressure, .. } => strokes.last_mut().expect("a stroke").2.push(*pressure),
            _ => {}
        }
    }
    strokes
}

#[test]
fn a_painters_brushes_become_the_nearest_and_keep_their_width() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["flat", "leaf1", "gear1", "column", "lines2"];
    let mut bytes = Bytes::default().u8(8).text("apainter").u16(1).u8(names.len() as u8);
    for name in names {
        bytes = bytes.u8(name.len() as u8).text(name);
    }
    bytes = bytes.u32s(&[5]);
    for brush in [0, 1, 2, 4, 9] {
        bytes = bytes.u8(brush).f32s(&[1.0, 1.0, 1.0, 0.1]).u32s(&[2]);
        for pressure in [0.75, 1.0] {
            bytes = bytes.f32s(&[0.0, pressure, 0.0, 0.0, 0.0, 0.0, 1.0, pressure]).u32s(&[0]);
        }
    }
    let path = write(folder.path(), "a.apa", &bytes.0);
    let strokes = painted(&read_sound(&path));
    let brushes: Vec<_> = strokes.iter().map(|(brush, ..)| brush.as_deref()).collect();
    // A number without a name is a plain ribbon, too.
    assert_eq!(brushes, [None, Some("Leaves"), None, Some("OilPaint"), None]);
    for (brush, width, pressures) in &strokes {
        let part =
            |pressure| brush.as_ref().map_or(pressure, |name| brush::find(name).unwrap().size(pressure));
        assert!((width * part(pressures[0]) - 0.075).abs() < 1e-6, "{brush:?}: {pressures:?}");
        assert!((width * part(pressures[1]) - 0.1).abs() < 1e-6, "{brush:?}: {pressures:?}");
    }
    // What draws with a look of its own is named; what only stands in the list is not.
    let header = open(&path, &OpenOptions::default()).unwrap().header;
    assert_eq!(header.left_out, ["the look of the brushes gear1: they are plain ribbons"]);
}

/// A drawing as JSON has the fields of a binary one; without its end, the strokes before it are kept.
#[test]
fn a_painters_json_is_read_like_its_binary_files() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/files/models/apainter.json");
    let events = read_sound(path.as_ref());
    let strokes = painted(&events);
    assert_eq!((strokes.len(), strokes[0].1, strokes[0].2.len()), (1, 0.03, 12));
    assert!(matches!(events[11], Event::Point { t: 0.16, .. }), "{:?}", events[11]);
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    for (damaged, expected) in [
        (text.replace("[0, 0, 0, 1]", "[0, 0, 0, 0]"), "a quaternion other than 0"),
        (text.replace("\"points\"", "\"pts\""), "A-Painter drawing"),
    ] {
        let path = write(folder.path(), "a.json", damaged.as_bytes());
        let error = super::files::read(&path, false).error.expect("damage").to_string();
        assert!(error.contains(expected) && error.contains("line 1"), "{error}");
    }
}

#[test]
fn plain_drawings_leave_nothing_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.apa", &apa(&[([0.5; 3], 0.02, raw_points(3, [0.0; 3], 0))]));
    assert_eq!(open(&path, &OpenOptions::default()).unwrap().header.left_out, [""; 0]);
    assert!(painted(&read_sound(&path)).iter().all(|(brush, ..)| brush.is_none()));
}

#[test]
fn cassie_draws_wires() {
    let folder = tempfile::tempdir().unwrap();
    let (history, _) = write_cassie(folder.path());
    let read = super::files::read(&history, false);
    let strokes = painted(&read.events);
    assert!(!strokes.is_empty());
    for (brush, width, _) in strokes {
        assert_eq!((brush.as_deref(), width), (Some("Wire"), 0.005));
    }
}
