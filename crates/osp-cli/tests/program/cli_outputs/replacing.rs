//! The reproductions: each of these destroyed something.

use std::fs;

use super::{assert_refused, built::has, names, session_text, write_session};
use crate::OSP;
use osp_testkit::{stderr, temp};

#[test]
fn a_shell_pattern_behind_csv_destroys_no_session() {
    let folder = temp();
    for name in ["a.ron", "bb.ron", "ccc.ron"] {
        write_session(folder.path(), name);
    }
    let output = OSP.run_in(folder.path(), ["replay", "--csv", "a.ron", "bb.ron", "ccc.ron"]);
    assert_refused(&output, &["a.ron", ".csv"]);
    assert_eq!(fs::read_to_string(folder.path().join("a.ron")).expect("there"), session_text(5.0));
    // Whoever insists may replace it: it is not read.
    OSP.done_in(folder.path(), ["replay", "--force", "--csv", "a.ron", "bb.ron"]);
    assert!(fs::read_to_string(folder.path().join("a.ron")).expect("there").starts_with("recording,index,"));
}

#[test]
fn an_input_is_never_an_output() {
    let folder = temp();
    let session = write_session(folder.path(), "a.ron");
    fs::create_dir(folder.path().join("sub")).expect("made");
    for path in ["a.ron", "./sub/../a.ron"] {
        let output = OSP.run_in(folder.path(), ["replay", "a.ron", "--csv", path, "--force"]);
        assert_refused(&output, &[path, "the input, too"]);
        assert_eq!(fs::read_to_string(&session).expect("there"), session_text(5.0), "{path}");
    }
    let pins = folder.path().join("p.pins");
    OSP.done_in(folder.path(), ["replay", "a.ron", "--pin", "p.pins"]);
    let before = fs::read(&pins).expect("pins");
    let output =
        OSP.run_in(folder.path(), ["replay", "a.ron", "--check", "p.pins", "--csv", "p.pins", "--force"]);
    assert_refused(&output, &["p.pins", "the input"]);
    assert_eq!(fs::read(&pins).expect("pins"), before);
    assert_eq!(names(folder.path()), ["a.ron", "p.pins", "sub"]);
}

/// As a shell does it with `>>`.
#[cfg(unix)]
#[test]
fn standard_output_is_no_way_into_an_input() {
    let folder = temp();
    let session = write_session(folder.path(), "a.ron");
    for args in [&["import", "a.ron", "-"][..], &["replay", "a.ron", "--csv", "-"]] {
        let onto = fs::File::options().append(true).open(&session).expect("the session");
        let output = OSP.command_in(folder.path(), args).stdout(onto).output().expect("osp");
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("the input, too"), "{args:?}: {}", stderr(&output));
        assert_eq!(fs::read_to_string(&session).expect("there"), session_text(5.0), "{args:?}");
    }
}

#[test]
fn what_is_inside_of_an_input_is_not_replaced_either() {
    let folder = temp();
    let sketch = folder.path().join("a.tilt");
    fs::create_dir(&sketch).expect("made");
    for name in ["data.sketch", "metadata.json", "thumbnail.png"] {
        fs::write(sketch.join(name), "\x05").expect("written");
    }
    let output = OSP.run_in(folder.path(), ["replay", "a.tilt", "--csv", "a.tilt/data.sketch", "--force"]);
    assert_refused(&output, &["data.sketch", "a.tilt"]);
    // CASSIE's sessions are two files; naming one reads both.
    for name in ["raw_data", "sketch_history"] {
        fs::create_dir(folder.path().join(name)).expect("made");
        fs::write(folder.path().join(name).join("a.json"), "[]").expect("written");
    }
    let args = ["replay", "sketch_history/a.json", "--csv", "raw_data/a.json", "--force"];
    assert_refused(&OSP.run_in(folder.path(), args), &["raw_data", "the input"]);
}

#[test]
fn two_outputs_of_one_command_need_two_files() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    write_session(folder.path(), "bb.ron");
    for args in [
        &["replay", "a.ron", "--csv", "x", "--pin", "x"][..],
        &["replay", "a.ron", "--csv", "x", "--pin", "./x"],
        &["bench", "a.ron", "--csv", "x", "--html", "x", "--quick", "--no-growth"],
        &["replay", "a.ron", "--csv", "-", "--pin", "/dev/stdout"],
    ]
    .into_iter()
    .filter(|args| has(args))
    {
        assert_refused(&OSP.run_in(folder.path(), args), &["cannot both"]);
    }
    assert_eq!(names(folder.path()), ["a.ron", "bb.ron"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("there", folder.path().join("link")).expect("linked");
        let output = OSP.run_in(folder.path(), ["replay", "a.ron", "--csv", "there", "--pin", "link"]);
        assert_refused(&output, &["cannot both"]);
    }
}

#[cfg(feature = "bench")]
#[test]
fn charts_of_several_sessions_are_checked_before_the_first() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    write_session(folder.path(), "bb.ron");
    fs::write(folder.path().join("c-2.svg"), session_text(0.0)).expect("written");
    let output = OSP.run_in(folder.path(), ["replay", "a.ron", "bb.ron", "--chart", "c.svg"]);
    assert_refused(&output, &["c-2.svg", "a session", "--force"]);
    assert_eq!(names(folder.path()), ["a.ron", "bb.ron", "c-2.svg"]);
    OSP.done_in(folder.path(), ["replay", "a.ron", "bb.ron", "--chart", "c.svg", "--force"]);
    assert_eq!(names(folder.path()), ["a.ron", "bb.ron", "c-1.svg", "c-2.svg"]);
}

#[test]
fn pins_of_other_recordings_stay_and_no_session_becomes_pins() {
    let folder = temp();
    for name in ["a.ron", "bb.ron"] {
        write_session(folder.path(), name);
        OSP.done_in(folder.path(), ["replay", name, "--pin", "all.pins"]);
    }
    let pins = fs::read_to_string(folder.path().join("all.pins")).expect("pins");
    assert!(pins.contains("\"a.ron\"") && pins.contains("\"bb.ron\""), "{pins}");
    assert_refused(
        &OSP.run_in(folder.path(), ["replay", "a.ron", "--pin", "bb.ron"]),
        &["bb.ron", "a session", "--force"],
    );
    let damaged = pins.replace("fingerprint", "fingerprnt");
    fs::write(folder.path().join("all.pins"), &damaged).expect("written");
    assert_refused(&OSP.run_in(folder.path(), ["replay", "a.ron", "--pin", "all.pins"]), &["all.pins, line"]);
    assert_eq!(fs::read_to_string(folder.path().join("all.pins")).expect("pins"), damaged);
}

#[cfg(target_os = "linux")]
#[test]
fn a_session_that_somebody_has_open_is_not_written_into() {
    use std::fs::File;
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let other = write_session(folder.path(), "b.ron");
    for place in ["/dev/fd/0", "/proc/self/fd/0", "/dev/stdin"] {
        for args in [
            &["replay", "a.ron", "--csv", place][..],
            &["replay", "a.ron", "--pin", place],
            &["draw-index", "a.ron", place],
            &["import", "a.ron", place],
            &["synth", "scribble", "--polygons", "10", place],
        ]
        .into_iter()
        .filter(|args| has(args))
        {
            let mut osp = OSP.command_in(folder.path(), args);
            osp.stdin(File::open(&other).expect("opened to be read"));
            assert_refused(&osp.output().expect("osp"), &[]);
            assert_eq!(fs::read_to_string(&other).expect("there"), session_text(5.0), "{args:?}");
        }
    }
    // What was opened to be written is written.
    let table = folder.path().join("t.csv");
    let mut osp = OSP.command_in(folder.path(), ["replay", "a.ron", "--csv", "/dev/fd/0"]);
    assert!(osp.stdin(File::create(&table).expect("made")).status().expect("osp").success());
    assert!(fs::read_to_string(&table).expect("there").starts_with("recording,index,"));
}
