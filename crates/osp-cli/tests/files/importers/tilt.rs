//! `.tilt`: containers, axes, units, masks, camera.

use super::files::{
    Bytes, METADATA, count, raw_points, read, read_sound, sketch, sketch_stroke, small_sketch, tilt, write,
};
use glam::{Quat, Vec3};
use osp_session::recording::{Author, Event, NormalRule, OpenOptions, Paint, StrokeId, Tool, open};
use zip::CompressionMethod;

#[test]
fn a_stroke_comes_out_in_metres_and_our_axes() {
    let folder = tempfile::tempdir().unwrap();
    let points = [
        ([10.0, 20.0, 30.0], [0.5, -0.5, 0.5, 0.5], 0.25, 1500),
        ([11.0, 20.0, 30.0], [0.0, 0.6, 0.0, 0.8], 1.5, 1400),
    ];
    let stroke = sketch_stroke([0.25, 2.0, f32::NAN, -1.0], 0.5, 3.0, &points);
    let sketch = sketch(5, &[stroke]).0;
    let file =
        tilt(&[("data.sketch", &sketch), ("metadata.json", METADATA.as_bytes())], CompressionMethod::Stored);
    let events = read_sound(&write(folder.path(), "a.tilt", &file));
    let stroke = StrokeId(0);
    let point = |t, x, q, pressure| Event::Point { t, stroke, p: Vec3::new(x, 2.0, -3.0), q, pressure };
    assert_eq!(
        events,
        [
            Event::Begin {
                author: Author::SOLE,
                t: 1.5,
                stroke,
                tool: Tool::Ribbon,
                width: 0.5 * 3.0 * 0.1,
                color: (0.25, 1.0, 0.0, 0.0),
                normal: NormalRule::Travel,
                thinnest: 1.0,
                paint: Some(Box::new(Paint { scale: 3.0, sketch_flags: 2, ..Paint::new("Flat", 77) })),
            },
            point(1.5, 1.0, Quat::from_xyzw(-0.5, 0.5, 0.5, 0.5), 0.25),
            // Time runs backwards and stays so; a pressure above 1 is full.
            point(1.4, 1.1, Quat::from_xyzw(-0.0, -0.6, 0.0, 0.8), 1.0),
            Event::End { t: 1.4, stroke },
        ]
    );
}

#[test]
fn stored_deflated_and_unpacked_sketches_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let sketch = small_sketch().0;
    // Names, order and further entries vary in real files.
    let entries: [(&str, &[u8]); 3] =
        [("metadata.json", METADATA.as_bytes()), ("thumbnail.png", &[0; 5000]), ("data.sketch", &sketch)];
    let stored = write(folder.path(), "stored.tilt", &tilt(&entries, CompressionMethod::Stored));
    let deflated = write(folder.path(), "deflated.tilt", &tilt(&entries, CompressionMethod::Deflated));
    write(folder.path(), "folder.tilt/data.sketch", &sketch);
    write(folder.path(), "folder.tilt/metadata.json", METADATA.as_bytes());
    write(folder.path(), "unity/data.sketch.bytes", &sketch);
    write(folder.path(), "unity/metadata.json.bytes", METADATA.as_bytes());
    let expected = read_sound(&stored);
    let counts = count(&expected);
    assert_eq!((counts.begins, counts.points, counts.ends), (3, 11, 3));
    let header = open(&stored, &OpenOptions::default()).unwrap().header;
    assert_eq!(
        (header.name.as_str(), header.source.as_str()),
        ("stored", "Tilt Brush, drawn by Ann and Bob")
    );
    for path in [deflated, folder.path().join("folder.tilt"), folder.path().join("unity")] {
        assert_eq!(read_sound(&path), expected, "{}", path.display());
        let other = open(&path, &OpenOptions::default()).unwrap();
        assert_eq!((other.header.camera, other.format), (header.camera, "tilt"));
    }
}

#[test]
fn extensions_that_are_not_known_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let scale_and_long = 1 << 1 | 1 << 7 | 1 << 16 | 1 << 20;
    let pressure_time_and_more = 1 | 1 << 1 | 1 << 9;
    let stroke = Bytes::default().u32s(&[0]).f32s(&[1.0, 1.0, 1.0, 1.0, 2.0]);
    let stroke = stroke.u32s(&[scale_and_long, pressure_time_and_more]).f32s(&[4.0]).u32s(&[0xFFFF_FFFF]);
    let stroke = stroke.u32s(&[3]).text("abc").u32s(&[0]).u32s(&[2]);
    let point =
        |x: f32, ms| Bytes::default().f32s(&[x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5]).u32s(&[ms, 0xDEAD]);
    let stroke = stroke.append(&point(1.0, 7)).append(&point(2.0, 8));
    // And a stroke with no extensions at all: full pressure, time zero, scale 1.
    let bare = Bytes::default().u32s(&[0]).f32s(&[1.0, 1.0, 1.0, 1.0, 2.0]).u32s(&[0, 0, 1]);
    let bare = bare.f32s(&[5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    // Version 6 and a header with further bytes.
    let head = Bytes::default().u32s(&[0xC576_A5CD, 6, 0, 5]).text("extra").u32s(&[2]);
    let sketch = head.append(&stroke).append(&bare);
    write(folder.path(), "data.sketch", &sketch.0);
    write(folder.path(), "metadata.json", METADATA.as_bytes());
    let events = read_sound(folder.path());
    let widths: Vec<f32> = events
        .iter()
        .filter_map(|event| if let Event::Begin { width, .. } = event { Some(*width) } else { None })
        .collect();
    assert_eq!(widths, [2.0 * 4.0 * 0.1, 2.0 * 0.1]);
    let points: Vec<(f64, f32, f32)> = events
        .iter()
        .filter_map(|event| {
            if let Event::Point { t, p, pressure, .. } = event { Some((*t, p.x, *pressure)) } else { None }
        })
        .collect();
    assert_eq!(points, [(0.007, 0.1, 0.5), (0.008, 0.2, 0.5), (0.0, 0.5, 1.0)]);
}

#[test]
fn an_empty_stroke_is_a_beginning_and_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let full = sketch_stroke([1.0; 4], 1.0, 1.0, &raw_points(2, [0.0; 3], 40));
    let empty = sketch_stroke([1.0; 4], 1.0, 1.0, &[]);
    write(folder.path(), "data.sketch", &sketch(5, &[full, empty]).0);
    write(folder.path(), "metadata.json", b"{}");
    let events = read_sound(folder.path());
    assert!(matches!(events[4], Event::Begin { t: 0.05, stroke: StrokeId(1), .. }), "{events:?}");
    assert_eq!(events[5], Event::End { t: 0.05, stroke: StrokeId(1) });
    assert_eq!(events.len(), 6);
}

#[test]
fn the_thumbnail_camera_is_in_the_space_of_the_strokes() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "data.sketch", &sketch(5, &[]).0);
    // With a byte order mark, as some versions write it.
    write(folder.path(), "metadata.json", format!("\u{FEFF}{METADATA}").as_bytes());
    let session = open(folder.path(), &OpenOptions::default()).unwrap();
    let camera = session.header.camera.expect("a camera");
    // The scene stands at (1, 2, 3), turned by 90 degrees about y, at scale one half. The camera is 5 units along +x of
    // it, which is the scene's +z (a left-handed turn about y takes +z to +x), at scale one half 10 units, 1 metre; our z
    // is the other way. It is turned as the scene is, so it looks along the scene's +z, our -z.
    assert!(camera.p.abs_diff_eq(Vec3::new(0.0, 0.0, -1.0), 1e-5), "{}", camera.p);
    assert!(camera.q.abs_diff_eq(Quat::IDENTITY, 1e-5), "{}", camera.q);
    assert_eq!(camera.fov_degrees, 80.0);
}

#[test]
fn a_sketch_without_metadata_has_no_camera_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let sketch = small_sketch().0;
    let path = write(folder.path(), "a.tilt", &tilt(&[("data.sketch", &sketch)], CompressionMethod::Stored));
    let read = read(&path, false);
    assert!(read.error.is_none(), "{:?}", read.error);
    assert_eq!(count(&read.events).points, 11);
    assert!(read.notes.warnings[0].contains("no metadata.json"), "{:?}", read.notes);
    assert_eq!(open(&path, &OpenOptions::default()).unwrap().header.camera, None);
}
