//! Every message names the file, the place in it and what was expected.

use zip::CompressionMethod;

use super::files::{METADATA, OBJ, POSES, apa, raw_points, read, sketch, sketch_stroke, tilt, write};

/// The error of a file, without its folder.
fn message(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), name, bytes);
    let error = read(&path, false).error.unwrap_or_else(|| panic!("{name} was read"));
    error.to_string().replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn sketches() {
    let mut points = raw_points(3, [0.0; 3], 0);
    points[2].1 = [0.0, 0.0, 0.0, 2.0];
    let bad = sketch(5, &[sketch_stroke([1.0; 4], 1.0, 1.0, &points)]).0;
    let file = |sketch: &[u8]| {
        tilt(&[("data.sketch", sketch), ("metadata.json", METADATA.as_bytes())], CompressionMethod::Stored)
    };
    assert_eq!(
        message("a.tilt", &file(&bad)),
        "a.tilt/data.sketch, byte 144: expected a unit quaternion (x, y, z, w); \
         found position [0.05, 0.025, 0.05], orientation [-0, -0, 0, 2], pressure 0.52 in stroke 0"
    );
    let wide = sketch(5, &[sketch_stroke([1.0; 4], -1.0, 1.0, &points[..2])]).0;
    assert_eq!(
        message("a.tilt", &file(&wide)),
        "a.tilt/data.sketch, byte 20: expected a width of 0 or more metres; found a width of -0.1 m \
         at scale 1 in stroke 0"
    );
    assert_eq!(
        message("a.tilt", &file(&bad[..100])),
        "a.tilt/data.sketch, byte 100: expected a control point's pressure (4 bytes); \
         found the end of the data"
    );
    assert_eq!(
        message("a.tilt", &file(&sketch(7, &[]).0)),
        "a.tilt/data.sketch, byte 4: expected sketch version 5 or 6; found version 7"
    );
    assert_eq!(
        message("a.tilt", b"tilTxx"),
        "a.tilt, byte 30840: expected a zip archive that is whole; found invalid Zip archive: Could not find EOCD"
    );
    assert_eq!(
        message("a.tilt", &tilt(&[("other", b"x")], CompressionMethod::Stored)),
        "a.tilt: expected a sketch with the file `data.sketch`; found a zip without it"
    );
    assert_eq!(message("a.tilt", b"zip?"), "a.tilt, byte 0: expected the word `tilT`; found zip?");
    // What belongs to the scale says so.
    let flat = sketch(5, &[sketch_stroke([1.0; 4], 1.0, 0.0, &points[..2])]).0;
    assert_eq!(
        message("a.tilt", &file(&flat)),
        "a.tilt/data.sketch, byte 20: expected a positive scale of the brush; found a width of 0 m \
         at scale 0 in stroke 0"
    );
    for (metadata, expected) in [
        ("[]", "the metadata of a sketch as a JSON object; found invalid type: sequence, expected an object"),
        ("null", "the metadata of a sketch as a JSON object; found invalid type: null, expected an object"),
        ("{\"a\":", "the metadata of a sketch as a JSON object; found EOF"),
        ("{\"BrushIndex\":[1]}", "a list of the brushes' names in `BrushIndex`; found invalid type: integer"),
        ("{\"BrushIndex\":null}", "a list of the brushes' names in `BrushIndex`; found invalid type: null"),
    ] {
        let bytes = tilt(
            &[("data.sketch", &sketch(5, &[]).0), ("metadata.json", metadata.as_bytes())],
            CompressionMethod::Stored,
        );
        let error = message("a.tilt", &bytes);
        assert!(error.starts_with(&format!("a.tilt/metadata.json, line 1: expected {expected}")), "{error}");
    }
}

#[test]
fn drawings() {
    let whole = apa(&[([1.0; 3], 0.1, raw_points(2, [0.0; 3], 0))]);
    assert_eq!(
        message("a.apa", &whole[..whole.len() - 1]),
        "a.apa, byte 117: expected a point's time stamp (4 bytes); found the end of the data"
    );
    let mut version = whole.clone();
    version[9] = 3;
    assert_eq!(message("a.apa", &version), "a.apa, byte 9: expected version 1; found version 3");
    let more = [whole.as_slice(), b"x"].concat();
    assert_eq!(
        message("a.apa", &more),
        "a.apa, byte 121: expected the end of the data after 1 strokes; found more bytes"
    );
    assert_eq!(
        message("a.apa", b"not a drawing"),
        "a.apa, byte 0: expected the word `apainter`, its length first; found not a dra"
    );
}

#[test]
fn lines() {
    let poses = POSES.replace("10.02 0.1", "10.02 O.1");
    assert_eq!(
        message("a.poses", poses.as_bytes()),
        "a.poses, line 5: expected `time x y z qw qx qy qz`; found `10.02 O.1 0.2 0.5 0.5 0.5 -0.5 0.5`"
    );
    let poses = POSES.replace("0.5 0.5 -0.5 0.5", "0.5 0.5 -0.5 0.9");
    let error = message("a.poses", poses.as_bytes());
    assert!(error.starts_with("a.poses, line 5: expected a unit quaternion"), "{error}");
    let obj = OBJ.replace("f 1/1 2/1 3/1 4/1", "f 1/1 2/1 3/1 5/1");
    assert_eq!(
        message("a.obj", obj.as_bytes()),
        "a.obj, line 11: expected corners from 1 to 4 or from -4 to -1; found corner 5 in `f 1/1 2/1 3/1 5/1`"
    );
    for (line, expected) in [
        ("f 0 1 2", "corners from 1 to 4"),
        ("f -5 1 2", "corners from 1 to 4"),
        ("f 1 2", "3 to 1024 vertices"),
        ("f 1 2 x", "`f` and corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`"),
        ("f 1 2 -9223372036854775808", "corners from 1 to 4"),
        ("v 1 2", "`v x y z`, finite and below 1e15"),
        ("v 1 nan 2", "`v x y z`, finite and below 1e15"),
        ("v 1 1e16 2", "`v x y z`, finite and below 1e15"),
    ] {
        let error = message("a.obj", format!("{OBJ}{line}\n").as_bytes());
        assert!(error.starts_with(&format!("a.obj, line 16: expected {expected}")), "{error}");
    }
}

/// Lenient readers of lines pass over the bad ones, and a vertex that is passed over keeps its number.
#[test]
fn bad_lines_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv x x x\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    let path = write(folder.path(), "a.obj", obj.as_bytes());
    let lenient = read(&path, true);
    assert!(lenient.error.is_none());
    assert_eq!((lenient.events.len(), lenient.notes.skipped, lenient.notes.warnings.len()), (1, 2, 2));
    let poses = POSES.replace("10.01", "ten");
    let lenient = read(&write(folder.path(), "a.poses", poses.as_bytes()), true);
    assert!(lenient.error.is_none());
    assert_eq!(lenient.notes.skipped, 1);
    assert!(lenient.notes.warnings[0].contains("line 3"), "{:?}", lenient.notes);
    // Warnings do not pile up; the count goes on.
    let many = "x\n".repeat(1000);
    let lenient = read(&write(folder.path(), "b.poses", many.as_bytes()), true);
    assert_eq!((lenient.notes.skipped, lenient.notes.warnings.len()), (1000, 16));
}

#[test]
fn what_cannot_be_opened() {
    let folder = tempfile::tempdir().unwrap();
    let missing = read(&folder.path().join("missing.tilt"), true).error.unwrap().to_string();
    assert!(missing.contains("missing.tilt: "), "{missing}");
    let empty = read(folder.path(), false).error.unwrap().to_string();
    assert!(empty.contains("expected"), "{empty}");
    let unknown = read(&write(folder.path(), "a.txt", b"hello"), false).error.unwrap().to_string();
    assert!(unknown.contains("expected") && unknown.contains(".tilt"), "{unknown}");
}
