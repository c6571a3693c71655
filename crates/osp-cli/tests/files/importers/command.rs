//! `osp import` as a user meets it.

use std::path::Path;
use std::process::Output;

use osp_session::recording::{OpenOptions, open};
use zip::CompressionMethod;

use super::files::{
    METADATA, layer_stroke, raw_points, read, read_sound, sketch, small_apa, small_sketch, small_tilt, write,
    write_cassie,
};
use crate::OSP;
use osp_testkit::{names, stderr, stdout};

fn import(folder: &Path, args: &[&str]) -> Output {
    OSP.run_in(folder, [&["import"], args].concat())
}

#[test]
fn every_session_comes_back_from_its_recording() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    write(folder, "a.tilt", &small_tilt(CompressionMethod::Deflated));
    write(folder, "b.apa", &small_apa());
    write_cassie(folder);
    for (input, output, said) in [
        ("a.tilt", "a.ron", "3 strokes, 11 points"),
        ("b.apa", "b.ron.zst", "2 strokes, 8 points"),
        ("sketch_history/a.json", "c.ron", "4 head poses, 1 edits"),
        ("a.ron", "d.ron.zst", "a.ron (ron) -> d.ron.zst: 3 strokes"),
    ] {
        let done = import(folder, &[input, output]);
        assert!(done.status.success(), "{}", stderr(&done));
        assert!(stdout(&done).contains(said), "{done:?}");
        let original = open(&folder.join(input), &OpenOptions::default()).unwrap();
        let copy = open(&folder.join(output), &OpenOptions::default()).unwrap();
        assert_eq!(copy.header, original.header);
        assert_eq!(read_sound(&folder.join(output)), read(&folder.join(input), false).events, "{input}");
    }
    assert_eq!(
        names(folder),
        ["a.ron", "a.tilt", "b.apa", "b.ron.zst", "c.ron", "d.ron.zst", "raw_data", "sketch_history"]
    );
}

/// What `osp info` says of a session, without the names of file and format.
fn info(folder: &Path, file: &str) -> serde_json::Value {
    let mut info = OSP.json_in(folder, ["info", "--json", file]);
    for name in ["recording", "format"] {
        info.as_object_mut().unwrap().remove(name).expect("it is named");
    }
    info
}

#[test]
fn info_says_the_same_of_a_sketch_and_of_its_recording() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let stroke = |layer| layer_stroke(layer, [1.0; 4], 0.5, 1.0, &raw_points(6, [0.0; 3], 0));
    write(folder, "a.tilt/data.sketch", &sketch(5, &[stroke(0), stroke(1)]).0);
    write(folder, "a.tilt/metadata.json", METADATA.as_bytes());
    assert!(import(folder, &["a.tilt", "a.ron"]).status.success());
    let said = info(folder, "a.tilt");
    assert_eq!(said, info(folder, "a.ron"));
    assert_eq!(said["environment"]["preset"], "Standard");
    assert_eq!(said["layers"][1]["name"], "Notes");
    assert_eq!(said["left_out"][0], "2 models (a.glb, b)");
    let [row] = &said["brushes"].as_array().unwrap()[..] else { panic!("{said}") };
    assert_eq!((&row["brush"], &row["drawn_as"]), (&"Flat".into(), &"ribbon, opaque, matte".into()));
    assert_eq!((&row["strokes"], &row["hidden_strokes"], &row["points"]), (&2.into(), &1.into(), &12.into()));
    let text = OSP.done_in(folder, ["info", "a.ron"]);
    for line in [
        "light       Standard, sky (0, 51, 102) below",
        "layers      Main Canvas, Notes (hidden)",
        "not shown   2 models (a.glb, b)",
        "ribbon, opaque, matte; 1 of them hidden",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
}

#[test]
fn import_and_info_name_a_brush_that_nobody_knows() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    write(folder, "a.tilt/data.sketch", &small_sketch().0);
    write(folder, "a.tilt/metadata.json", METADATA.replace("2d35bcf0-e4d8", "00000000-0000").as_bytes());
    let warning =
        "the brush `00000000-0000-452c-97b1-3311be063130` is unknown: its strokes are plain ribbons";
    let done = import(folder, &["a.tilt", "a.ron"]);
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(stderr(&done).matches(warning).count(), 1, "{}", stderr(&done));
    let said = info(folder, "a.ron");
    assert_eq!(said["brushes"][0]["drawn_as"], "unknown: drawn as a plain ribbon");
    assert_eq!(said["brushes"][0]["strokes"], 3);
    assert!(said["warnings"][0].as_str().unwrap().contains(warning), "{said}");
}

#[test]
fn damage_writes_nothing_unless_lenient() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let drawing = small_apa();
    write(folder, "a.apa", &drawing[..drawing.len() - 10]);
    let strict = import(folder, &["a.apa", "a.ron"]);
    assert_eq!(strict.status.code(), Some(2));
    let said = stderr(&strict);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("a.apa, byte ") && said.contains("--lenient"), "{said}");
    assert_eq!(names(folder), ["a.apa"]);
    let lenient = import(folder, &["a.apa", "a.ron", "--lenient"]);
    assert!(lenient.status.success(), "{}", stderr(&lenient));
    assert!(stderr(&lenient).contains("warning: a.apa, byte "), "{}", stderr(&lenient));
    assert!(stdout(&lenient).contains("2 strokes, 7 points"), "{lenient:?}");
}
