//! Every message names the file, the place in it and what was expected.

use zip::CompressionMethod;

use super::files::{
    METADATA, OBJ, POSES, apa, glb, raw_points, read, sketch, sketch_stroke, small_gltf, tilt, write,
};

/// The error of a file, without its folder.
fn message(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), name, bytes);
    let error = read(&path, false).error.unwrap_or_else(|| panic!("{name} was read"));
    error.to_string().replace(&format!("{}/", folder.path().display()), "")
}

/// The errors of damaged files of every format, a line each.
#[test]
fn messages_are_as_recorded() {
    let mut said = String::new();
    let mut say = |name: &str, bytes: &[u8]| said.extend([&*message(name, bytes), "\n"]);
    let zip = |entries: &[(&str, &[u8])]| tilt(entries, CompressionMethod::Stored);
    let file = |sketch: &[u8]| zip(&[("data.sketch", sketch), ("metadata.json", METADATA.as_bytes())]);
    let mut points = raw_points(3, [0.0; 3], 0);
    points[2].1 = [0.0, 0.0, 0.0, 2.0];
    let bad = sketch(5, &[sketch_stroke([1.0; 4], 1.0, 1.0, &points)]).0;
    let of_size = |size, scale| file(&sketch(5, &[sketch_stroke([1.0; 4], size, scale, &points[..2])]).0);
    for bytes in
        [file(&bad), of_size(-1.0, 1.0), of_size(1.0, 0.0), file(&bad[..100]), file(&sketch(7, &[]).0)]
    {
        say("a.tilt", &bytes);
    }
    for bytes in [&b"tilTxx"[..], &zip(&[("other", b"x")]), b"zip?"] {
        say("a.tilt", bytes);
    }
    for metadata in ["[]", "null", "{\"a\":", "{\"BrushIndex\":[1]}", "{\"BrushIndex\":null}"] {
        let empty = sketch(5, &[]).0;
        say("a.tilt", &zip(&[("data.sketch", &empty), ("metadata.json", metadata.as_bytes())]));
    }
    let whole = apa(&[([1.0; 3], 0.1, raw_points(2, [0.0; 3], 0))]);
    let mut version = whole.clone();
    version[9] = 3;
    for bytes in [&whole[..whole.len() - 1], &version, &[&whole[..], b"x"].concat(), b"not a drawing"] {
        say("a.apa", bytes);
    }
    for (from, to) in [("10.02 0.1", "10.02 O.1"), ("0.5 0.5 -0.5 0.5", "0.5 0.5 -0.5 0.9")] {
        say("a.poses", POSES.replace(from, to).as_bytes());
    }
    say("a.obj", OBJ.replace("f 1/1 2/1 3/1 4/1", "f 1/1 2/1 3/1 5/1").as_bytes());
    let lines = "f 0 1 2|f -5 1 2|f 1 2|f 1 2 x|f 1 2 -9223372036854775808|v 1 2|v 1 nan 2|v 1 1e16 2";
    for line in lines.split('|') {
        say("a.obj", format!("{OBJ}{line}\n").as_bytes());
    }
    let (json, buffer) = small_gltf();
    for (from, to) in [
        (r#""version":"2.0""#, r#""version":"1.0""#),
        (
            r#""meshes":[
 {"#,
            r#""extensionsRequired":["X_packed"],"meshes":[{"extensions":{"X_packed":{}},"#,
        ),
        (r#""children":[2]"#, r#""children":[0]"#),
        (r#""children":[2]"#, r#""children":[77]"#),
        (r#""mesh":1"#, r#""mesh":9"#),
        (r#""POSITION":1"#, r#""POSITION":50"#),
        (r#""count":6"#, r#""count":600"#),
        (r#""byteOffset":96,"byteLength":12"#, r#""byteOffset":12,"byteLength":12"#),
        (r#""byteLength":16}"#, r#""byteLength":4000000000}"#),
        (r#"[{"byteLength":124}]"#, r#"[{"byteLength":124,"uri":"../a.bin"}]"#),
        (r#""translation":[1,2,3]"#, r#""translation":[1e16,2,3]"#),
        (r#""asset""#, r#""asset" ""#),
    ] {
        assert!(json.contains(from), "{from}");
        say("a.glb", &glb(&json.replacen(from, to, 1), &buffer));
    }
    insta::assert_snapshot!(said);
}

/// A lenient reader skips the damaged part of a model, and reports it.
#[test]
fn a_damaged_part_of_a_model_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (json, buffer) = small_gltf();
    for (from, to) in [("[2]", "[77]"), ("\"POSITION\":1", "\"POSITION\":50"), ("[1,2,3]", "[1e16,2,3]")] {
        let path = write(folder.path(), "a.glb", &glb(&json.replacen(from, to, 1), &buffer));
        let lenient = read(&path, true);
        assert!(lenient.error.is_none() && !lenient.events.is_empty(), "{to}");
        assert!(!lenient.notes.warnings.is_empty(), "{to}: nothing was said");
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
