//! What a `.tilt` says that cannot be used is left out alone, and said once.

use super::files::{
    Bytes, METADATA, RawPoint, count, layer_stroke, raw_points, read, sketch, sketch_stroke, small_sketch,
    write,
};
use osp_session::recording::{Event, Header, OpenOptions, open};

/// The header of a sketch with these metadata, and what the reader warns of.
pub(crate) fn header_of(metadata: &str, lenient: bool) -> (Header, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "data.sketch", &small_sketch().0);
    write(folder.path(), "metadata.json", metadata.as_bytes());
    let options = OpenOptions { lenient, ..OpenOptions::default() };
    let mut session = open(folder.path(), &options).unwrap();
    assert_eq!(session.header.check(), Ok(()));
    while session.events.next_event().unwrap().is_some() {}
    // The text comes back as it is, whatever can be read of it; one that is too long is left out.
    assert!(session.header.sketch_metadata.take().is_none_or(|kept| kept == metadata));
    (session.header, session.events.notes().warnings)
}

fn with_canvas(transform: &str) -> String {
    METADATA.replacen('{', &format!("{{\"CanvasTransformInSceneSpace\":{transform},"), 1)
}

#[test]
fn a_camera_that_cannot_be_is_named() {
    let (whole, warnings) = header_of(METADATA, false);
    assert!(whole.camera.is_some() && warnings.is_empty(), "{warnings:?}");
    let scene = "[0.0,0.70710678,0.0,0.70710678],0.5";
    let camera = "[[6.0,2.0,3.0],[0.0,0.70710678,0.0,0.70710678],1.0]";
    for (from, to, expected) in [
        (scene, "[0,0,0,1],0", "a scale above 0 in `SceneTransformInRoomSpace`"),
        (scene, "[0,0,0,1],-1", "a scale above 0 in `SceneTransformInRoomSpace`"),
        (scene, "[0,0,0,0],1", "a rotation and a scale above 0"),
        (scene, "[0,0,0,1],1e-38", "finite coordinates below 1e15 m of the thumbnail's camera"),
        (camera, "[[1e38,2,3],[0,0,0,1],1]", "finite coordinates below 1e15 m of the thumbnail's camera"),
        (camera, "[[6,2,3],[0,0,0,0],1]", "a unit quaternion (x, y, z, w) of the thumbnail's camera"),
        (camera, "\"x\"", "a sound `ThumbnailCameraTransformInRoomSpace`"),
        (camera, "[[6,2,3]]", "a sound `ThumbnailCameraTransformInRoomSpace`"),
    ] {
        let metadata = METADATA.replace(from, to);
        assert_ne!(metadata, METADATA);
        let (header, warnings) = header_of(&metadata, false);
        let [warning] = &warnings[..] else { panic!("{to}: {warnings:?}") };
        assert!(warning.contains(expected) && warning.contains("read without it"), "{to}: {warning}");
        assert!(warning.contains("metadata.json"), "{warning}");
        // All else is read; without a transform of the scene, the scene is not turned in the room.
        let mut rest = Header { camera: None, ..whole.clone() };
        if let (true, Some(light), Some(read)) = (from == scene, &mut rest.environment, &header.environment) {
            (light.room_rotation, light.shadows_end_m) = (read.room_rotation, read.shadows_end_m);
        }
        assert_eq!(header, rest, "{to}");
    }
}

#[test]
fn an_environment_that_cannot_be_is_named() {
    let (header, warnings) = header_of(&with_canvas("[[0,0,0],[0,0,0,1],1e9]"), false);
    assert_eq!(header.environment, None);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("density of fog") && warning.contains("read without it"), "{warning}");
    // A canvas that nobody knows how to turn back: the light stays as it is in the scene.
    let (usual, _) = header_of(METADATA, false);
    for bad in ["[[0,0,0],[0,0,0,1],-1]", "[[0,0,0],[0,0,0,0],1]"] {
        let (header, warnings) = header_of(&with_canvas(bad), false);
        let [warning] = &warnings[..] else { panic!("{bad}: {warnings:?}") };
        assert!(warning.contains("CanvasTransformInSceneSpace"), "{warning}");
        assert!(warning.contains("without a camera"), "{warning}");
        assert_eq!(header, Header { camera: None, ..usual.clone() });
    }
}

#[test]
fn a_damaged_field_takes_no_other_with_it() {
    let (whole, _) = header_of(METADATA, false);
    let (header, warnings) = header_of(&METADATA.replace("\"Ann\"", "12"), false);
    assert_eq!(header, Header { source: "Tilt Brush".to_owned(), ..whole.clone() });
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("a sound `Authors`"), "{warning}");
    // A table of brushes that cannot be read is an error; a lenient reader keeps the rest.
    let (header, warnings) = header_of(&METADATA.replace("[\"2d35bcf0", "[1,\"2d35bcf0"), true);
    assert_eq!(header, whole);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("`BrushIndex`") && warning.contains("read without it"), "{warning}");
}

/// Strokes of 4 points, of which this one is `damaged`.
fn sketch_with(damaged: &[(usize, Bytes)]) -> Bytes {
    let mut strokes: Vec<Bytes> =
        (0..6).map(|i| sketch_stroke([1.0; 4], 0.5, 1.0, &raw_points(4, [0.0; 3], 1000 * i))).collect();
    for (i, stroke) in damaged {
        strokes[*i] = Bytes(stroke.0.clone());
    }
    sketch(5, &strokes)
}

#[test]
fn a_damaged_number_ends_its_stroke_alone() {
    let points = |bad: usize, change: fn(&mut RawPoint)| {
        let mut points = raw_points(4, [0.0; 3], 0);
        change(&mut points[bad]);
        points
    };
    let head = |size, scale| sketch_stroke([1.0; 4], size, scale, &raw_points(4, [0.0; 3], 0));
    let body = |points: &[RawPoint]| layer_stroke(0, [1.0; 4], 0.5, 1.0, points);
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "metadata.json", METADATA.as_bytes());
    for (stroke, expected, begins, kept) in [
        (head(f32::NAN, 1.0), "a width from 0 to 1e15 m", 5, 20),
        (head(-0.5, 1.0), "a width from 0 to 1e15 m", 5, 20),
        (head(0.5, 0.0), "a scale of the brush above 0, at most 1e15", 5, 20),
        (body(&points(0, |point| point.0[1] = f32::NAN)), "finite coordinates", 5, 20),
        // What came before is drawn.
        (body(&points(2, |point| point.0[1] = f32::INFINITY)), "finite coordinates", 6, 22),
        (body(&points(3, |point| point.1 = [0.0; 4])), "a unit quaternion", 6, 23),
        (body(&points(1, |point| point.2 = f32::NAN)), "a finite pressure", 6, 21),
    ] {
        write(folder.path(), "data.sketch", &sketch_with(&[(1, stroke)]).0);
        let strict = read(folder.path(), false).error.expect("damage is an error").to_string();
        assert!(strict.contains("data.sketch, byte ") && strict.contains(expected), "{strict}");
        assert!(strict.contains("in stroke 1"), "{strict}");
        let lenient = read(folder.path(), true);
        assert!(lenient.error.is_none(), "{:?}", lenient.error);
        let counts = count(&lenient.events);
        assert_eq!((counts.begins, counts.points, counts.ends), (begins, kept, begins), "{expected}");
        assert!(matches!(lenient.events.last(), Some(Event::End { stroke, .. }) if stroke.0 == 5));
        let [warning] = &lenient.notes.warnings[..] else { panic!("{:?}", lenient.notes) };
        assert_eq!(*warning, format!("{strict}; the stroke is skipped from there on"));
        assert_eq!(lenient.notes.skipped, 1);
    }
    // Many are counted, not listed.
    let damaged =
        [(0, head(f32::NAN, 1.0)), (2, head(0.5, -1.0)), (5, body(&points(0, |point| point.2 = f32::NAN)))];
    write(folder.path(), "data.sketch", &sketch_with(&damaged).0);
    let lenient = read(folder.path(), true);
    assert_eq!(count(&lenient.events).begins, 3);
    let [warning] = &lenient.notes.warnings[..] else { panic!("{:?}", lenient.notes) };
    assert!(warning.contains("byte 20: ") && warning.contains("3 damaged strokes are skipped"), "{warning}");
    assert_eq!(lenient.notes.skipped, 3);
}
