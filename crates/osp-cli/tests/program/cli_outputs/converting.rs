//! `osp convert`: folders of sessions, and sketches of Tilt Brush.

use std::{
    fs,
    path::Path,
    time::{Duration, SystemTime},
};

use super::{assert_refused, names, write_session};
use crate::OSP;
use osp_session::recording::{Event, OpenOptions, open};
use osp_testkit::{stderr, stdout, temp};

fn events(path: &Path) -> Vec<Event> {
    let session = open(path, &OpenOptions::default()).expect("a session");
    session.map(|event| event.expect("a sound event")).collect()
}

fn set_changed(path: &Path, time: SystemTime) {
    let file = fs::File::options().append(true).open(path).expect("a file");
    file.set_modified(time).expect("its time");
}

fn changed(path: &Path) -> SystemTime {
    fs::metadata(path).and_then(|data| data.modified()).expect("its time")
}

#[test]
fn folders_are_converted_and_continued_and_errors_come_last() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("in/below")).expect("folders");
    write_session(&at("in"), "a.ron");
    write_session(&at("in/below"), "b.ron");
    fs::write(at("in/bad.ron"), "Header(format: 1)\nnonsense\n").expect("written");
    fs::write(at("in/notes.txt"), "no session").expect("written");
    let long_ago = SystemTime::now() - Duration::from_secs(1000);
    for name in ["in/a.ron", "in/below/b.ron", "in/bad.ron"] {
        set_changed(&at(name), long_ago);
    }
    // What it writes below the folder it reads is no session of the next run.
    let convert = || OSP.run_in(folder.path(), ["convert", "in", "--to", "ron.zst", "--out", "in/out"]);
    let output = convert();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stdout(&output), "3 sessions: 2 converted now, 0 before, 1 failed\n");
    let said = stderr(&output);
    let [error, last] = said.lines().collect::<Vec<_>>()[..] else { panic!("{said}") };
    assert!(error.starts_with("error: ") && error.contains("bad.ron, line 2: expected "), "{error}");
    assert!(last.contains("1 of 3 sessions could not be converted"), "{last}");
    assert_eq!(
        (names(&at("in/out")), names(&at("in/out/below"))),
        (vec!["a.ron.zst".to_owned(), "below".to_owned()], vec!["b.ron.zst".to_owned()])
    );
    assert_eq!(events(&at("in/out/below/b.ron.zst")), events(&at("in/below/b.ron")));

    // Only what is missing is done again.
    let before = changed(&at("in/out/a.ron.zst"));
    fs::write(at("in/bad.ron"), "Header(format: 1)\n").expect("written");
    let output = convert();
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stdout(&output), "3 sessions: 1 converted now, 2 before, 0 failed\n");
    assert_eq!(changed(&at("in/out/a.ron.zst")), before);

    // A session that changed since is not written over somebody's recording, unless asked.
    set_changed(&at("in/a.ron"), SystemTime::now() + Duration::from_secs(1000));
    let output = convert();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("a.ron.zst: exists already; --force replaces it"),
        "{}",
        stderr(&output)
    );
    let output =
        OSP.run_in(folder.path(), ["convert", "in", "--to", "ron.zst", "--out", "in/out", "--force"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stdout(&output), "3 sessions: 3 converted now, 0 before, 0 failed\n");
    assert!(changed(&at("in/out/a.ron.zst")) > before);
}

#[test]
fn models_lie_beside_their_sessions_and_no_two_share_a_name() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    write_session(folder.path(), "b.ron");
    let output = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let output = OSP.run_in(folder.path(), ["convert", ".", "--to", "glb"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["a.ron", "a.ron.glb", "a.tilt", "a.tilt.glb", "b.glb", "b.ron"]);
    let output = OSP.run_in(folder.path(), ["convert", ".", "--to", "glb"]);
    assert_eq!(stdout(&output), "3 sessions: 0 converted now, 3 before, 0 failed, 3 are .glb already\n");
    fs::create_dir(at("other")).expect("a folder");
    write_session(&at("other"), "b.ron");
    let refused = OSP.run_in(folder.path(), ["convert", "b.ron", "other/b.ron", "--to", "glb", "--out", "x"]);
    assert_refused(&refused, &["would both become", "b.ron.glb", "--out"]);
    assert!(!at("x").exists());
}

#[test]
fn a_sketch_has_the_strokes_and_replaces_nothing_unasked() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    let mut text = fs::read_to_string(at("a.ron")).expect("text");
    text += "Erase(t: 9.0, stroke: 1)\nHead(t: 9.0, p: (0, 1, 0), q: (0, 0, 0, 1))\n";
    fs::write(at("a.ron"), text).expect("written");
    let output = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("a.tilt: 2 strokes, 40 points; "), "{}", stdout(&output));
    assert_eq!(
        stderr(&output),
        "warning: 2 strokes without a brush of Tilt Brush are written with the brush Flat\n\
         warning: 1 recorded pose of a head is left out: .tilt has no place for it\n"
    );
    let widths: Vec<f32> = events(&at("a.tilt"))
        .iter()
        .filter_map(|event| if let Event::Begin { width, .. } = event { Some(*width) } else { None })
        .collect();
    assert_eq!(widths, [0.05, 0.05]);
    let sketch = fs::read(at("a.tilt")).expect("a sketch");
    let again = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    assert_refused(&again, &["a.tilt: exists already; --force replaces it"]);
    let onto_itself = OSP.run_in(folder.path(), ["convert", "a.tilt", "a.tilt", "--force"]);
    assert_refused(&onto_itself, &["a.tilt: is the input, too"]);
    assert_eq!(fs::read(at("a.tilt")).expect("a sketch"), sketch);
    let forced = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt", "--force"]);
    assert!(forced.status.success(), "{}", stderr(&forced));
    for (args, words) in [
        (&["convert", "a.ron"][..], &["--to FORMAT", "found 1 paths"][..]),
        (&["convert", "a.ron", "a.obj"], &["a.obj: expected a name that ends in .glb"]),
        (&["convert", "none", "--to", "glb"], &["none"]),
    ] {
        assert_refused(&OSP.run_in(folder.path(), args), words);
    }
    assert_eq!(names(folder.path()), ["a.ron", "a.tilt"]);
}
