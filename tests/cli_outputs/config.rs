//! The user's defaults of options.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use crate::{command, session_text, stderr, stdout, temp};

/// A folder with a session, and the file of defaults in a folder that is not there yet.
fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = temp();
    fs::write(folder.path().join("s.ron"), session_text(0.0)).expect("written");
    let file = folder.path().join("settings/config.toml");
    (folder, file)
}

fn run(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).env("OSP_CONFIG", "settings/config.toml").output().expect("the program starts")
}

fn done(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    stdout(&output)
}

fn refused(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stdout(&output));
    stderr(&output)
}

/// The indexes that a replay has measured.
fn indexes(said: &str) -> Vec<String> {
    let runs: serde_json::Value = serde_json::from_str(said.lines().next().expect("a line")).expect("JSON");
    let runs = runs["runs"].as_array().expect("runs");
    runs.iter().map(|run| run["index"].as_str().expect("a name").to_owned()).collect()
}

#[test]
fn what_the_command_line_leaves_open_is_taken_from_the_file() {
    let (folder, file) = place();
    let here = folder.path();
    assert!(done(here, &["config"]).contains("no defaults"));
    done(here, &["config", "set", "replay.index", "brute-simd", "osp"]);
    done(here, &["config", "set", "index", "time-order"]);
    let replay = |more: &[&str]| indexes(&done(here, &[&["replay", "s.ron", "--json"], more].concat()));
    assert_eq!(replay(&[]), ["brute-simd", "osp"]);
    assert_eq!(replay(&["--index", "kd-tree"]), ["kd-tree"]);
    // The general one is for the commands that have no own.
    let pick = ["pick", "s.ron", "--at", "0.5,0.5"];
    assert!(done(here, &pick).contains("time-order tested"));
    done(here, &["config", "unset", "replay.index"]);
    assert_eq!(replay(&[]), ["time-order"]);
    // A switch that is on; an option that excludes it on the command line counts more.
    done(here, &["config", "set", "replay.json", "true"]);
    assert_eq!(indexes(&done(here, &["replay", "s.ron"])), ["time-order"]);
    let shown = done(here, &["config", "show"]);
    assert!(shown.contains("replay.json = true") && shown.contains("index = time-order"), "{shown}");
    // An empty variable stands for no file.
    let without = command(here, pick).output().expect("the program starts");
    assert!(stdout(&without).contains("osp tested"), "{}", stdout(&without));
    assert_eq!(done(here, &["config", "path"]).trim(), "settings/config.toml");
    assert!(file.is_file());
}

#[test]
fn the_file_keeps_its_comments_and_what_was_not_named() {
    let (folder, file) = place();
    fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    let text = "# mine\nlenient = true # because\n\n[replay]\n# the usual\npace = \"samples:16\"\n";
    fs::write(&file, text).expect("written");
    done(folder.path(), &["config", "set", "replay.pace", "samples:8"]);
    assert_eq!(fs::read_to_string(&file).expect("read"), text.replace("samples:16", "samples:8"));
    done(folder.path(), &["config", "set", "max-polygons", "5000"]);
    let now = fs::read_to_string(&file).expect("read");
    assert!(now.starts_with("# mine\nlenient = true # because\nmax-polygons = 5000\n"), "{now}");
}

#[test]
fn what_cannot_be_a_default_is_refused_and_the_file_stays() {
    let (folder, file) = place();
    let here = folder.path();
    done(here, &["config", "set", "lenient", "true"]);
    let before = fs::read(&file).expect("read");
    for (args, expected) in [
        (&["replay.indx", "osp"][..], "did you mean index?"),
        (&["rplay.index", "osp"], "expected the name of a command"),
        (&["replay.index", "ospp"], "a similar value exists: 'osp'"),
        (&["replay.index", "osp", "ospp"], "'ospp'"),
        (&["lenient", "1"], "expected true or false"),
        (&["pace", "samples:0"], "samples"),
        (&["bake.cells", "-3"], "-3"),
        (&["study.report.out", "x.html"], "has to be given each time"),
        (&["config.key", "x"], "expected the name of a command"),
        (&["a..b", "x"], "expected OPTION or COMMAND.OPTION"),
        (&["lenient.x", "1"], "expected a table"),
    ] {
        let said = refused(here, &[&["config", "set"], args].concat());
        assert!(said.contains(expected) && said.lines().count() == 1, "{args:?}: {said}");
    }
    assert!(refused(here, &["config", "unset", "pace"]).contains("the file has no such default"));
    assert_eq!(fs::read(&file).expect("read"), before);
}

#[test]
fn a_damaged_file_is_one_line_that_names_its_line_and_commands_that_mend_it_run() {
    let (folder, file) = place();
    let here = folder.path();
    fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    for (text, line, expected) in [
        ("lenient = true\npace =\n", 2, "expected TOML"),
        ("\n\nno-such-option = 1\n", 3, "expected an option of a command"),
        ("[replay]\nindex = { a = 1 }\n", 2, "expected the name of a command"),
        ("[replay]\npace = 1979-05-27\n", 2, "expected text, a number, true, false"),
        ("[render]\nindex = [[\"osp\"]]\n", 2, "expected text, a number, true, false"),
        ("pace = \"no\"\n", 1, "no"),
    ] {
        fs::write(&file, text).expect("written");
        let said = refused(here, &["info", "s.ron"]);
        let place = format!("config.toml: line {line}: ");
        assert!(said.contains(&place) && said.contains(expected), "{text}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(run(here, &["config", "path"]).status.success());
        assert!(run(here, &["--help"]).status.success());
    }
    fs::write(&file, [0xff, 0xfe, 0]).expect("written");
    assert!(refused(here, &["info", "s.ron"]).contains("expected text in UTF-8"));
    fs::remove_file(&file).expect("removed");
    fs::create_dir(&file).expect("made");
    assert!(refused(here, &["info", "s.ron"]).contains("found a folder"));
}
