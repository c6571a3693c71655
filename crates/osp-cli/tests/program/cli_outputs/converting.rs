//! `osp convert`: folders of sessions, and sketches of Tilt Brush.

use std::{
    fs,
    io::Cursor,
    path::Path,
    time::{Duration, SystemTime},
};

use super::{assert_refused, names, write_session};
use crate::OSP;
use osp_session::recording::Event;
use osp_testkit::{events::events_in, make_pipe, stderr, stdout, temp};

fn set_changed(path: &Path, time: SystemTime) {
    let file = fs::File::options().append(true).open(path).expect("a file");
    file.set_modified(time).expect("its time");
}

fn changed(path: &Path) -> SystemTime {
    fs::metadata(path).and_then(|data| data.modified()).expect("its time")
}

#[test]
fn static_models_are_those_of_export() {
    let folder = temp();
    fs::create_dir(folder.path().join("in")).expect("a folder");
    write_session(&folder.path().join("in"), "a.ron");
    OSP.done_in(folder.path(), ["convert", "in", "--to", "glb", "--static"]);
    OSP.done_in(folder.path(), ["export", "in/a.ron", "a.glb", "--static"]);
    let bytes = |name: &str| fs::read(folder.path().join(name)).expect("a model");
    assert_eq!(bytes("in/a.glb"), bytes("a.glb"));
    OSP.done_in(folder.path(), ["convert", "in", "--to", "glb", "--force"]);
    assert_ne!(bytes("in/a.glb"), bytes("a.glb"));

    let said = OSP.refused_in(folder.path(), ["convert", "in", "--to", "tilt", "--static"]);
    assert!(said.contains("--static is for .glb only; found .tilt"), "{}", said);
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
    assert_eq!(names(&at("in/out")), ["a.ron.zst", "below"]);
    assert_eq!(names(&at("in/out/below")), ["b.ron.zst"]);
    assert_eq!(events_in(at("in/out/below/b.ron.zst")), events_in(at("in/below/b.ron")));

    // Only what is missing is done again.
    let before = changed(&at("in/out/a.ron.zst"));
    fs::write(at("in/bad.ron"), "Header(format: 1)\n").expect("written");
    let said = stdout(&convert());
    assert_eq!(said, "3 sessions: 1 converted now, 2 before (--force makes them again), 0 failed\n");
    assert_eq!(changed(&at("in/out/a.ron.zst")), before);

    // A session that changed since is not written over somebody's recording, unless asked.
    set_changed(&at("in/a.ron"), SystemTime::now() + Duration::from_secs(1000));
    let output = convert();
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.contains("a.ron.zst: exists already; --force replaces it"), "{said}");
    let said = OSP.done_in(folder.path(), ["convert", "in", "--to", "ron.zst", "--out", "in/out", "--force"]);
    assert_eq!(said, "3 sessions: 3 converted now, 0 before, 0 failed\n");
    assert!(changed(&at("in/out/a.ron.zst")) > before);
}

#[test]
fn models_lie_beside_their_sessions_and_no_two_share_a_name() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    write_session(folder.path(), "b.ron");
    OSP.done_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    OSP.done_in(folder.path(), ["convert", ".", "--to", "glb"]);
    assert_eq!(names(folder.path()), ["a.ron", "a.ron.glb", "a.tilt", "a.tilt.glb", "b.glb", "b.ron"]);
    let said = OSP.done_in(folder.path(), ["convert", ".", "--to", "glb"]);
    let (again, already) = ("(--force makes them again)", "3 are .glb already");
    assert_eq!(said, format!("3 sessions: 0 converted now, 3 before {again}, 0 failed, {already}\n"));
    // A model that osp made of an older session is made again unasked.
    set_changed(&at("b.ron"), SystemTime::now() + Duration::from_secs(100));
    let said = OSP.done_in(folder.path(), ["convert", ".", "--to", "glb"]);
    assert!(said.starts_with(&format!("3 sessions: 1 converted now, 2 before {again}, 0 failed")), "{said}");
    fs::create_dir(at("other")).expect("a folder");
    write_session(&at("other"), "b.ron");
    let refused = OSP.run_in(folder.path(), ["convert", "b.ron", "other/b.ron", "--to", "glb", "--out", "x"]);
    assert_refused(&refused, &["would both become", "b.ron.glb", "--out"]);
    assert!(!at("x").exists());
}

#[test]
fn every_session_has_a_target_of_its_own_in_any_order_of_conversions() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    OSP.done_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    fs::copy(at("a.ron"), at("A.RON.ron")).expect("copied");
    let convert = |args: &[&str]| OSP.done_in(folder.path(), [&["convert"], args].concat());
    // One of them has the name that another gets with its ending; file systems may ignore case.
    assert_eq!(convert(&[".", "--to", "glb"]), "3 sessions: 3 converted now, 0 before, 0 failed\n");
    let models = ["A.RON.ron.glb", "a.ron.glb", "a.tilt.glb"];
    assert!(models.iter().all(|model| at(model).is_file()), "{:?}", names(folder.path()));
    // Models that osp wrote beside their sessions are no further sessions, unless named.
    assert_eq!(
        convert(&[".", "--to", "ron.zst", "--out", "packed"]),
        "3 sessions: 3 converted now, 0 before, 0 failed\n"
    );
    assert_eq!(
        convert(&["a.tilt.glb", "--to", "ron.zst", "--out", "model"]),
        "1 sessions: 1 converted now, 0 before, 0 failed\n"
    );
    // A file and its folder.
    fs::create_dir(at("in")).expect("a folder");
    write_session(&at("in"), "b.ron");
    assert_eq!(
        convert(&["in", "in/b.ron", "./in/b.ron", "--to", "glb"]),
        "1 sessions: 1 converted now, 0 before, 0 failed\n"
    );
    assert_eq!(names(&at("in")), ["b.glb", "b.ron"]);
}

#[test]
fn the_folder_of_a_sketch_may_be_named_by_a_dot_and_keeps_its_picture() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    OSP.done_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    fs::create_dir(at("open.tilt")).expect("a folder");
    let file = fs::read(at("a.tilt")).expect("a sketch");
    let mut zip = zip::ZipArchive::new(Cursor::new(&file[16..])).expect("a zip");
    zip.extract(at("open.tilt")).expect("unpacked");
    fs::write(at("open.tilt/thumbnail.png"), "a picture").expect("written");
    for out in [&["--out", "../out"][..], &[]] {
        OSP.done_in(at("open.tilt"), [&["convert", ".", "--to", "glb"], out].concat());
    }
    assert_eq!(names(&at("out")), ["open.glb"]);
    assert_eq!(names(folder.path()), ["a.ron", "a.tilt", "open.glb", "open.tilt", "out"]);
    OSP.done_in(folder.path(), ["convert", "open.tilt", "whole.tilt"]);
    let file = fs::read(at("whole.tilt")).expect("a sketch");
    assert!(file.windows(9).any(|part| part == b"a picture"));
    // No other file of a sketch is kept.
    osp_testkit::add_to_sketch(&at("whole.tilt"), "notes.txt");
    let expected = "warning: whole.tilt: no part of a sketch that osp knows, and not read: `notes.txt`";
    for command in [["convert", "whole.tilt", "second.tilt"], ["import", "whole.tilt", "second.ron"]] {
        let said = stderr(&OSP.run_in(folder.path(), command));
        assert!(said.lines().eq([expected]), "{said}");
    }
}

#[test]
fn only_what_osp_makes_counts_as_finished_and_no_session_is_replaced_through_a_link() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    let convert =
        |args: &[&str]| OSP.run_in(folder.path(), [&["convert", "a.ron", "--to", "glb"], args].concat());
    // A model of another program, and a folder, are newer than the session.
    fs::write(at("a.glb"), b"glTF\x02\0\0\0\x30\0\0\0\x1c\0\0\0JSON{\"asset\":{\"version\":\"2.0\"}}")
        .expect("written");
    assert!(stderr(&convert(&[])).contains("a.glb: exists already; --force replaces it"));
    fs::remove_file(at("a.glb")).expect("removed");
    fs::create_dir(at("a.glb")).expect("a folder");
    let said = stderr(&convert(&["--force"]));
    assert!(said.contains("a.glb: expected a file; found a folder"), "{said}");
    let alone = OSP.run_in(folder.path(), ["convert", "a.ron", "a.glb", "--force"]);
    assert_refused(&alone, &["a.glb: expected a file; found a folder"]);
    fs::remove_dir(at("a.glb")).expect("removed");
    #[cfg(unix)]
    {
        let session = fs::read(write_session(folder.path(), "b.ron")).expect("a session");
        std::os::unix::fs::symlink("b.ron", at("a.glb")).expect("linked");
        assert_refused(&convert(&["b.ron", "--force"]), &["a.glb: is an input, too"]);
        assert_eq!(fs::read(at("b.ron")).expect("a session"), session);
        fs::remove_file(at("a.glb")).expect("removed");
        // A pipe would take the model only when somebody reads it.
        assert!(make_pipe(&at("a.glb")));
        let said = stderr(&convert(&["--force"]));
        assert!(said.contains("a.glb: expected a file; found a folder, a pipe"), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn links_and_pipes_of_a_folder_are_named() {
    use std::os::unix::fs::symlink;
    let folder = temp();
    let at = |name: &str| folder.path().join("in").join(name);
    fs::create_dir_all(folder.path().join("other")).expect("made");
    fs::create_dir(folder.path().join("in")).expect("made");
    write_session(&folder.path().join("in"), "a.ron");
    fs::write(at("notes.txt"), "words").expect("written");
    let links = [("link.ron", "a.ron"), ("words", "notes.txt"), ("lost", "nowhere"), ("more", "../other")];
    links.iter().for_each(|(link, target)| symlink(target, at(link)).expect("linked"));
    if !make_pipe(&at("pipe")) {
        eprintln!("skipped: no mkfifo");
        return;
    }
    symlink("pipe", at("to-pipe")).expect("linked");
    let done = OSP.run_in(folder.path(), ["convert", "in", "--to", "glb", "--out", "out"]);
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(names(&folder.path().join("out")), ["a.glb"]);
    let skipped = [
        ("link.ron", "a link to a session"),
        ("lost", "a link that leads nowhere"),
        ("more", "a link to a folder"),
        ("pipe", "a pipe or a device"),
        ("to-pipe", "a link to a pipe or a device"),
    ];
    let expected =
        skipped.map(|(name, what)| format!("warning: in/{name}: {what} is skipped; name it to include it"));
    assert!(stderr(&done).lines().eq(expected), "{}", stderr(&done));
}

#[test]
fn a_session_of_a_wrong_clock_is_converted_once() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    set_changed(&at("a.ron"), SystemTime::now() + Duration::from_secs(100_000));
    for expected in [
        "1 converted now, 0 before, 0 failed",
        "0 converted now, 1 before (--force makes them again), 0 failed",
    ] {
        let output = OSP.run_in(folder.path(), ["convert", ".", "--to", "ron.zst", "--out", "out"]);
        assert_eq!(stdout(&output), format!("1 sessions: {expected}\n"), "{}", stderr(&output));
    }
    // It was saved again before its target was written.
    set_changed(&at("a.ron"), changed(&at("a.ron")) + Duration::from_secs(1));
    let output = OSP.run_in(folder.path(), ["convert", ".", "--to", "ron.zst", "--out", "out"]);
    assert!(stderr(&output).contains("exists already; --force replaces it"), "{}", stderr(&output));
    // The other file of a CASSIE sketch came after its target.
    ["sketch_history", "raw_data"].iter().for_each(|name| fs::create_dir(at(name)).expect("a folder"));
    let stroke = r#"[{"id":0,"input_samples":[[0,1,0],[0,2,0]],"curve_type":"line","ctrl_pts":[],
        "creation_time":1,"deletion_time":null}]"#;
    fs::write(at("sketch_history/a.json"), stroke).expect("written");
    let convert =
        || OSP.run_in(folder.path(), ["convert", "sketch_history", "--to", "ron.zst", "--out", "to"]);
    assert!(convert().status.success());
    fs::write(at("raw_data/a.json"), "").expect("written");
    set_changed(&at("raw_data/a.json"), SystemTime::now() + Duration::from_secs(100_000));
    assert!(stderr(&convert()).contains("exists already; --force replaces it"), "{:?}", names(&at("to")));
}

#[test]
fn sessions_among_the_outputs_are_left_out_with_a_warning() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("in/best")).expect("folders");
    write_session(&at("in"), "a.ron");
    write_session(&at("in/best"), "b.ron");
    let convert = |paths: &[&str]| {
        let to = ["--to", "ron.zst", "--out", "in/best"];
        let output = OSP.run_in(folder.path(), [&["convert"], paths, &to[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        (stdout(&output), stderr(&output))
    };
    let (said, warned) = convert(&["in"]);
    assert_eq!(said, "1 sessions: 1 converted now, 0 before, 0 failed\n");
    let skipped = "1 session in the folder of the outputs is skipped; name it to include it";
    assert_eq!(warned, format!("warning: in/best: {skipped}\n"));
    let (said, warned) = convert(&["in", "in/best/b.ron"]);
    assert_eq!(said, "2 sessions: 1 converted now, 1 before (--force makes them again), 0 failed\n");
    assert_eq!(warned, "");
    assert_eq!(names(&at("in/best")), ["a.ron.zst", "b.ron", "best"]);
}

#[test]
fn a_sketch_has_the_strokes_and_replaces_nothing_unasked() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    let mut text = fs::read_to_string(at("a.ron")).expect("text");
    text += "Erase(t: 9.0, stroke: 1)\nHead(t: 9.0, p: (0, 1, 0), q: (0, 0, 0, 1))\n";
    text += "Group(t: 9.0, group: 0, strokes: [0])\nGroup(t: 9.0, group: 1, strokes: [2], parent: 0, name: \"a\")\n";
    fs::write(at("a.ron"), text).expect("written");
    let output = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("a.tilt: 2 strokes, 40 points; "), "{}", stdout(&output));
    assert_eq!(
        stderr(&output),
        "warning: 2 strokes without a brush of Tilt Brush are written with the brush Flat\n\
         warning: 1 recorded pose of a head is not written: .tilt has no place for it\n\
         warning: 1 group in another group is not written: .tilt has no place for it\n\
         warning: 1 name of a group is not written: .tilt has no place for it\n"
    );
    let class = osp_testkit::at("recordings/class.ron");
    let class = OSP.run_in(folder.path(), ["convert", class.to_str().expect("utf-8"), "b.tilt"]);
    assert!(stderr(&class).contains("warning: which author drew a stroke is not written"), "{class:?}");
    fs::remove_file(at("b.tilt")).expect("removed");
    let widths: Vec<f32> = events_in(at("a.tilt"))
        .iter()
        .filter_map(|event| if let Event::Begin { width, .. } = event { Some(*width) } else { None })
        .collect();
    assert_eq!(widths, [0.05, 0.05]);
    let sketch = fs::read(at("a.tilt")).expect("a sketch");
    let again = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    assert_refused(&again, &["a.tilt: exists already; --force replaces it"]);
    let onto_itself = OSP.run_in(folder.path(), ["convert", "a.tilt", "a.tilt", "--force"]);
    assert_refused(&onto_itself, &["a.tilt: is an input, too"]);
    assert_eq!(fs::read(at("a.tilt")).expect("a sketch"), sketch);
    let forced = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt", "--force"]);
    assert!(forced.status.success(), "{}", stderr(&forced));
    for (args, words) in [
        (&["convert", "a.ron"][..], &["--to FORMAT", "found 1 paths"][..]),
        (&["convert", "a.ron", "a.usdz"], &["a.usdz: expected a name that ends in .glb"]),
        (&["convert", "none", "--to", "glb"], &["none"]),
        (
            &["convert", "a.ron", "--to", "glb", "--out", "a.tilt"],
            &["a.tilt: expected a folder; found a file"],
        ),
    ] {
        assert_refused(&OSP.run_in(folder.path(), args), words);
    }
    assert_eq!(names(folder.path()), ["a.ron", "a.tilt"]);
}

#[test]
fn what_is_named_or_linked_is_replaced_by_no_target() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    write_session(folder.path(), "a.ron");
    OSP.done_in(folder.path(), ["convert", "a.ron", "a.tilt"]);
    let before = fs::read(at("a.ron")).expect("a file");
    let named = OSP.run_in(folder.path(), ["convert", "a.ron", "a.tilt", "--to", "ron", "--force"]);
    assert_refused(&named, &["a.ron: is an input, too"]);
    assert_eq!(fs::read(at("a.ron")).expect("a file"), before);
    // Two targets lead to one file.
    fs::create_dir(at("in")).expect("made");
    for name in ["b.ron", "c.ron"] {
        write_session(&at("in"), name);
    }
    fs::create_dir(at("out")).expect("made");
    fs::write(at("out/b.glb"), "another program's").expect("written");
    std::os::unix::fs::symlink("b.glb", at("out/c.glb")).expect("linked");
    let linked = OSP.run_in(folder.path(), ["convert", "in", "--to", "glb", "--out", "out", "--force"]);
    assert_refused(&linked, &["c.glb: is a link to the target of another session"]);
    assert_refused(
        &OSP.run_in(folder.path(), ["convert", "-", "--to", "tilt"]),
        &["-: standard input has no name"],
    );
    // A named link to a folder is followed without a warning.
    std::os::unix::fs::symlink("in", at("link")).expect("linked");
    let output = OSP.run_in(folder.path(), ["convert", "link", "--to", "tilt"]);
    assert!(output.status.success() && !stderr(&output).contains("link:"), "{}", stderr(&output));
}
