//! `osp import` as a user meets it.

use std::path::Path;
use std::process::Output;

use osp_session::recording::{OpenOptions, open};
use zip::CompressionMethod;

use super::files::{read, read_sound, small_apa, small_tilt, write, write_cassie};
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
