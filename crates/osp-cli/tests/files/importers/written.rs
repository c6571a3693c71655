//! `.tilt` files that osp writes: read again, they have what the session had.

use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use osp_session::{
    export::{ExportError, KeptStrokes, TiltCounts, write_tilt},
    recording::{
        Author, Event, Flush, GroupId, Header, Layer, NormalRule, OpenOptions, Paint, RonWriter, StrokeId,
        SynthKind, Tool, Transform, open, synthesize,
    },
};
use osp_testkit::events::{Begin, SOLE, polygon};
use zip::CompressionMethod;

use super::files::{Bytes, METADATA, layer_stroke, raw_points, read_sound, sketch, small_tilt, tilt, write};

/// The events, in words that tell every bit: `==` on floats does not (-0.0).
fn bits(events: &[Event]) -> Vec<String> {
    events.iter().map(|event| format!("{event:?}")).collect()
}

fn without_metadata(header: Header) -> Header {
    Header { sketch_metadata: None, ..header }
}

/// Times and places of the points.
fn places(events: &[Event]) -> Vec<(f64, Vec3)> {
    let point = |event: &Event| if let Event::Point { t, p, .. } = event { Some((*t, *p)) } else { None };
    events.iter().filter_map(point).collect()
}

fn written(folder: &Path, name: &str, header: &Header, events: &[Event]) -> (PathBuf, TiltCounts) {
    let mut kept = KeptStrokes::default();
    events.iter().for_each(|event| kept.note(event));
    let mut bytes = Vec::new();
    let counts = write_tilt(&mut kept, header, Some(b"PNG"), &mut bytes).unwrap();
    (write(folder, name, &bytes), counts)
}

/// All of a sound session.
fn whole(path: &Path) -> (Header, Vec<Event>) {
    let mut session = open(path, &OpenOptions::default()).unwrap();
    let events = session.by_ref().map(|event| event.unwrap()).collect();
    (session.header, events)
}

/// Reads a sketch, writes it, reads that; both headers and lists of events.
fn there_and_back(folder: &Path, path: &Path) -> [(Header, Vec<Event>); 2] {
    let (header, events) = whole(path);
    let (again, counts) = written(folder, "again.tilt", &header, &events);
    assert_eq!(counts.notes, [""; 0], "{}", path.display());
    let (mut header_again, events_again) = whole(&again);
    header_again.name.clone_from(&header.name);
    [(header, events), (header_again, events_again)]
}

/// A stroke with all extensions that Open Brush writes, and with others.
fn grouped(brush: u32, flags: u32, group: u32, seed: u32) -> Bytes {
    let head = Bytes::default().u32s(&[brush]).f32s(&[0.1, 0.7, 0.3, 0.9, 0.0123]);
    let head = head.u32s(&[0x10_023f, 0x83, flags]).f32s(&[1.7]).u32s(&[group, seed, 1]);
    let head = head.append(&others_of_stroke(flags)).u32s(&[2]);
    let point = |x: f32, ms: u32| {
        let place = [x, -0.0, 1.0e-3 * x, 0.1, -0.7, 0.1, 0.7, 0.31];
        Bytes::default().f32s(&place).u32s(&[ms, !ms])
    };
    head.append(&point(12.345_678, 4_000_000_001)).append(&point(-987.654, 3))
}

/// A frame of an animation, an unknown word, and three bytes of an unknown long extension.
fn others_of_stroke(frame: u32) -> Bytes {
    Bytes::default().u32s(&[frame, 0xdead_beef, 3]).text("xyz")
}

/// Whether a file has the extensions of a stroke, and those of control points at these times.
fn has_extensions(sketch: &[u8], frame: u32, times_ms: &[u32]) -> bool {
    let has = |bytes: &[u8]| sketch.windows(bytes.len()).any(|part| part == bytes);
    let points = |ms: &u32| has(&Bytes::default().u32s(&[*ms, !*ms]).0);
    has(&others_of_stroke(frame).u32s(&[2]).0) && times_ms.iter().all(points)
}

#[test]
fn a_sketch_comes_back_with_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let strokes = [
        layer_stroke(0, [0.1, 0.2, 0.3, 1.0], 0.5, 2.0, &raw_points(40, [1.0, 2.0, 3.0], 1000)),
        grouped(1, 2, 7, u32::MAX),
        layer_stroke(1, [1.0, 0.0, 0.5, 0.25], 0.031, 0.3, &raw_points(9, [-70.1, 0.3, 1.0e5], 10)),
        grouped(2, 0, 7, 0),
        layer_stroke(0, [1.0; 4], 1.0, 1.0, &[]),
    ];
    // An older brush with the GUID of old, and one that nobody knows.
    let guids = r#""2d35bcf0-e4d8-452c-97b1-3311be063130","79168f10-6961-464a-8be1-57ed364c5600","00000000-e4d8-452c-97b1-3311be063130""#;
    let metadata = METADATA.replace("\"2d35bcf0-e4d8-452c-97b1-3311be063130\"", guids).replacen(
        '{',
        "{\"Palette\":{\"Colors\":[[1,2,3,255]]},",
        1,
    );
    let sketch = sketch(6, &strokes).0;
    let bytes =
        tilt(&[("data.sketch", &sketch), ("metadata.json", metadata.as_bytes())], CompressionMethod::Stored);
    let path = write(folder.path(), "a.tilt", &bytes);
    let [(header, events), (header_again, events_again)] = there_and_back(folder.path(), &path);
    assert_eq!(bits(&events), bits(&events_again));
    let paint = |event: &Event| if let Event::Begin { paint, .. } = event { paint.clone() } else { None };
    let paints: Vec<Paint> = events_again.iter().filter_map(|event| Some(*paint(event)?)).collect();
    assert_eq!((paints[1].sketch_group, paints[1].sketch_flags, paints[1].seed), (7, 2, u32::MAX));
    assert_eq!((paints[1].brush.as_str(), paints[1].layer, paints[1].hidden), ("CoarseBristles", 1, true));
    let text = header_again.sketch_metadata.clone().unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let expected: serde_json::Value = serde_json::from_str(&metadata).unwrap();
    assert_eq!(json, expected, "palette, media, all of it");
    assert_eq!(without_metadata(header.clone()), without_metadata(header_again));
    // The container is the one that the programs write.
    let bytes = std::fs::read(folder.path().join("again.tilt")).unwrap();
    let start = Bytes::default().text("tilT").u16(16).u16(1).u32s(&[0, 0]).text("PK\x03\x04").0;
    assert!(bytes.starts_with(&start));
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(&bytes[16..])).unwrap();
    for (at, name) in ["thumbnail.png", "data.sketch", "metadata.json"].into_iter().enumerate() {
        let entry = zip.by_index(at).unwrap();
        assert_eq!((&*entry.name().unwrap(), entry.compression()), (name, CompressionMethod::Stored));
    }
    for bytes in [&sketch, &bytes] {
        let has = |frame| has_extensions(bytes, frame, &[4_000_000_001, 3]);
        assert!(has(2) && has(0), "extensions that osp does not know");
    }
    let version = Bytes::default().u32s(&[0xc576_a5cd, 6]).0;
    assert!(bytes.windows(8).any(|part| part == version), "the version with long extensions");

    // Through a recording; and where a control point is missing, the extensions of the points have no place.
    let ron = folder.path().join("a.ron");
    let file = std::fs::File::create(&ron).unwrap();
    let mut writer = RonWriter::new(file, &ron, &header, Flush::EachEvent).unwrap();
    events.iter().for_each(|event| writer.write(event).unwrap());
    assert_eq!(bits(&whole(&ron).1), bits(&events));
    let first =
        events.iter().position(|event| matches!(event, Event::Point { t, .. } if *t > 4.0e6)).unwrap();
    let mut events = events;
    events.remove(first);
    let (path, counts) = written(folder.path(), "other.tilt", &header, &events);
    let lost = "control points' extensions are not written for 1 stroke";
    assert!(counts.notes[0].contains(lost), "{counts:?}");
    assert_eq!(whole(&path).1.len(), events.len());
}

/// A sketch of one stroke on layer 1 with this metadata.
fn of_metadata(folder: &Path, metadata: &[u8]) -> PathBuf {
    let sketch = sketch(5, &[layer_stroke(1, [1.0; 4], 0.5, 1.0, &raw_points(9, [1.0; 3], 10))]).0;
    let files = [("data.sketch", &sketch[..]), ("metadata.json", metadata)];
    write(folder, "a.tilt", &tilt(&files, CompressionMethod::Stored))
}

#[test]
fn metadata_keep_what_osp_has_no_number_and_no_word_for() {
    let folder = tempfile::tempdir().unwrap();
    let layers =
        r#"{"Name":"A","Visible":true},{"Name":"B","Visible":true,"Locked":true,"X":0.30000000000000001}"#;
    let deep = format!("{}{}", "[".repeat(2000), "]".repeat(2000));
    let odd = format!(r#""Big":1e999,"Long":123456789012345678901234567890,"Half":"\ud800","Deep":{deep}"#);
    let guid = "2d35bcf0-e4d8-452c-97b1-3311be063130";
    let metadata = format!(r#"{{"BrushIndex":["{guid}"],"Layers":[{layers}],{odd}}}"#);
    let path = of_metadata(folder.path(), metadata.as_bytes());
    let [_, (header, _)] = there_and_back(folder.path(), &path);
    let text = header.sketch_metadata.unwrap();
    for kept in odd.split(',').chain([r#""Locked":true"#, r#""X":0.30000000000000001"#]) {
        assert!(text.contains(kept), "{kept}: {text}");
    }
}

#[test]
fn metadata_that_cannot_be_kept_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let long = format!(r#"{{"X":"{}"}}"#, "x".repeat(Header::MAX_METADATA_BYTES));
    for (metadata, found) in [(long.as_bytes(), "found more"), (b"{\"X\":\"\xff\"}", "found other bytes")] {
        let path = of_metadata(folder.path(), metadata);
        let session = open(&path, &OpenOptions::default()).unwrap();
        assert_eq!(session.header.sketch_metadata, None);
        let warnings = session.events.notes().warnings;
        assert!(warnings.iter().any(|warning| warning.contains(found)), "{warnings:?}");
    }
    // A recording may have been edited by hand.
    let header = Header { sketch_metadata: Some("[]".to_owned()), ..Header::new("a", "") };
    let (_, counts) = written(folder.path(), "b.tilt", &header, &[]);
    let lost = "the metadata of the sketch that was read are no JSON object: they are not written";
    assert_eq!(counts.notes, [lost]);
}

#[test]
fn times_beyond_the_numbers_of_a_sketch_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let stroke = StrokeId(0);
    let point = |t| Event::Point { t, stroke, p: Vec3::ONE, q: Quat::IDENTITY, pressure: 1.0 };
    let path = write(folder.path(), "a.tilt", &small_tilt(CompressionMethod::Stored));
    let mut events = read_sound(&path);
    events.truncate(1);
    // Seconds since 1970.
    events.extend([point(1.0e9), point(-1.0), point(-1.0e-4), point(4_294_967.295)]);
    let (_, counts) = written(folder.path(), "b.tilt", &Header::new("a", ""), &events);
    let times = "control points before the start or later than 49 days, with the nearest time that .tilt can store: 2";
    assert_eq!(counts.notes, [times]);
}

#[test]
fn edits_of_the_session_are_in_the_sketch() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.tilt", &small_tilt(CompressionMethod::Stored));
    let mut events = read_sound(&path);
    let header = open(&path, &OpenOptions::default()).unwrap().header;
    let (author, t, name) = (Author::SOLE, 9.0, Some("Lines".to_owned()));
    let turn = Quat::from_xyzw(0.0, 0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt());
    let to = Transform { p: Vec3::X, q: turn, s: 2.0 };
    let (normal, thinnest, color) = (NormalRule::LocalX, 0.5, (1.0, 0.0, 0.0, 0.5));
    let new = |stroke, paint: Option<Paint>, tool| {
        let paint = paint.map(Box::new);
        Begin { tool, width: 0.02, color, normal, thinnest, paint, ..Begin::of(StrokeId(stroke)) }.event()
    };
    let point = |stroke, x: f32| {
        let (stroke, p, q) = (StrokeId(stroke), Vec3::X * x, Quat::IDENTITY);
        Event::Point { t: 9.5, stroke, p, q, pressure: 0.5 }
    };
    let end = |stroke| Event::End { t, stroke: StrokeId(stroke) };
    events.extend([
        SOLE.erase(StrokeId(0)),
        SOLE.grouped(GroupId(4), [StrokeId(1)], None),
        SOLE.placed(GroupId(4), to),
        new(10, Some(Paint::new("Ink", 5)), Tool::Ribbon),
        // Two hands at once.
        new(11, None, Tool::Ribbon),
        point(10, 1.0),
        point(11, 5.0),
        point(10, 1.5),
        point(11, 6.0),
        end(10),
        end(11),
        new(12, None, Tool::Tube),
        point(12, 2.0),
        end(12),
        SOLE.undo(),
        SOLE.moved([StrokeId(10)], Vec3::Y),
        Event::Layer { author, t, layer: 1, name, hidden: Some(false), locked: Some(true), mine: None },
        Event::Assign { author, t, layer: 1, strokes: vec![StrokeId(2)] },
        Event::Head { author, t, p: Vec3::ZERO, q: Quat::IDENTITY },
        polygon(None, [Vec3::ZERO, Vec3::X, Vec3::Y], color),
    ]);
    let (again, counts) = written(folder.path(), "edited.tilt", &header, &events);
    assert_eq!((counts.strokes, counts.points), (4, 11));
    let notes = [
        "1 stroke without a brush of Tilt Brush is written with the brush Marker",
        "1 transparent stroke without a brush will be opaque: the brushes above have no transparency",
        "1 polygon that no stroke drew is not written: .tilt has no place for it",
        "1 recorded pose of a head is not written: .tilt has no place for it",
    ];
    assert_eq!(counts.notes, notes);
    let back = read_sound(&again);
    let begin = |event: &Event| match event {
        Event::Begin { width, paint: Some(paint), .. } => Some((*width, (**paint).clone())),
        _ => None,
    };
    let begins: Vec<(f32, Paint)> = back.iter().filter_map(begin).collect();
    let brushes = begins.iter().map(|(_, paint)| (paint.brush.as_str(), paint.layer));
    assert!(brushes.eq([("Flat", 0), ("Flat", 1), ("Ink", 0), ("Marker", 0)]), "{begins:?}");
    // The placed one is twice as wide, turned by a quarter about +y, and in a group of its own.
    assert_eq!((begins[0].0, begins[0].1.scale, begins[0].1.sketch_group), (0.5 * 2.0 * 0.1 * 2.0, 4.0, 1));
    let places = places(&back);
    assert!(places[0].1.abs_diff_eq(Vec3::new(1.0, 2.0, 0.0), 1.0e-6), "{:?}", places[0]);
    assert_eq!(places[7], (9.5, Vec3::new(1.0, 1.0, 0.0)), "the moved one");
    // The plain one lies as it lay: the tracker's x axis, its normal, is where a brush has the way it looks. At half the
    // pressure it has three quarters of its width; Marker has a tenth at none.
    let last = back.iter().rfind(|event| matches!(event, Event::Point { .. }));
    let Some(Event::Point { q, pressure, .. }) = last else { panic!("a point") };
    assert!((pressure - 0.65 / 0.9).abs() < 1.0e-6, "{pressure}");
    let looks = *q * Vec3::NEG_Z;
    assert!(looks.dot(Vec3::X).abs() < 1.0e-6 && looks.is_normalized(), "across the travel along x: {looks}");
    let header = open(&again, &OpenOptions::default()).unwrap().header;
    let layer = |name: &str| Layer { name: name.to_owned(), hidden: false };
    assert_eq!(header.layers, [layer("Main Canvas"), layer("Lines")]);
    assert!(header.sketch_metadata.unwrap().contains(r#""Locked":true"#));
}

/// A model's polygons are no strokes: nothing empty is written for their brushes.
#[test]
fn polygons_of_brushes_are_no_strokes() {
    let mut events = vec![
        Begin { paint: Some(Box::new(Paint::new("Ink", 5))), ..Begin::of(StrokeId(1)) }.event(),
        Event::End { t: 0.0, stroke: StrokeId(1) },
        polygon(Some(StrokeId(1)), [Vec3::ZERO, Vec3::X, Vec3::Y], (1.0, 0.0, 0.0, 1.0)),
    ];
    let mut kept = KeptStrokes::default();
    events.iter().for_each(|event| kept.note(event));
    let error = write_tilt(&mut kept, &Header::new("a", ""), None, &mut Vec::new()).unwrap_err();
    assert!(matches!(error, ExportError::NoStrokes(1)), "{error}");
    events.push(Begin::of(StrokeId(2)).event());
    let (_, counts) = written(tempfile::tempdir().unwrap().path(), "a.tilt", &Header::new("a", ""), &events);
    assert_eq!(counts.strokes, 1);
    assert!(counts.notes[1].starts_with("1 polygon that no stroke drew is not written"), "{counts:?}");
}

#[test]
fn a_session_of_ours_becomes_a_sketch_with_its_camera() {
    let folder = tempfile::tempdir().unwrap();
    let mut ours = synthesize(SynthKind::Brushes, 20_000, 1);
    let events: Vec<Event> = ours.by_ref().map(|event| event.unwrap()).collect();
    let before = ours.header;
    let (path, _) = written(folder.path(), "ours.tilt", &before, &events);
    let session = open(&path, &OpenOptions::default()).unwrap();
    let (camera, before) = (session.header.camera.unwrap(), before.camera.unwrap());
    assert!(camera.p.abs_diff_eq(before.p, 1.0e-5) && camera.q.abs_diff_eq(before.q, 1.0e-6));
    // A sketch that was written once comes back with every bit.
    let [(_, first), (_, second)] = there_and_back(folder.path(), &path);
    assert!(first.len() > 1000);
    assert_eq!(bits(&first), bits(&second));
    // And each number is the nearest that the format has.
    let (before, after) = (places(&events), places(&first));
    assert_eq!(before.len(), after.len());
    for ((t, p), (t_after, p_after)) in before.into_iter().zip(after) {
        assert!((t - t_after).abs() <= 0.0005 && p.abs_diff_eq(p_after, 1.0e-6), "{p} {p_after}");
    }
}

#[test]
fn real_sketches_come_back_with_every_bit() {
    let Some(corpus) = std::env::var_os("OSP_CORPUS").map(PathBuf::from) else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut files = 0;
    for part in ["tilt", "brushes"] {
        for entry in std::fs::read_dir(corpus.join(part)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|ending| ending != "tilt") {
                continue;
            }
            let [(header, events), (header_again, events_again)] = there_and_back(folder.path(), &path);
            assert!(bits(&events) == bits(&events_again), "{}", path.display());
            assert_eq!(without_metadata(header), without_metadata(header_again), "{}", path.display());
            files += 1;
        }
    }
    assert!(files > 30, "{files} sketches");
}
