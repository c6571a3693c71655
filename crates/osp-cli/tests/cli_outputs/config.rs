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
fn rules_about_options_hold_for_defaults_too() {
    let (folder, _) = place();
    let here = folder.path();
    // An option that another one needs may come from the file.
    assert!(refused(here, &["replay", "s.ron", "--json", "--verify-frames", "2"]).contains("--occlusion"));
    done(here, &["config", "set", "replay.occlusion", "msvbsp"]);
    done(here, &["replay", "s.ron", "--json", "--verify-frames", "2"]);
    done(here, &["config", "unset", "replay.occlusion"]);
    // One that cannot be combined with what is given is left out; else it counts: there is no such file of sets.
    done(here, &["config", "set", "replay.pvs", "none.pvs"]);
    assert!(refused(here, &["replay", "s.ron"]).contains("none.pvs"));
    done(here, &["replay", "s.ron", "--pin", "a.pins"]);
    // Two of the file that exclude each other are refused as on the command line.
    done(here, &["config", "set", "replay.pin", "b.pins"]);
    let said = refused(here, &["replay", "s.ron"]);
    assert!(said.contains("cannot be used with") && said.contains("osp config shows"), "{said}");
    // Commands below commands have tables below tables.
    done(here, &["config", "set", "study.merge.force", "true"]);
    done(here, &["config", "set", "force", "false"]);
    assert!(done(here, &["config"]).contains("study.merge.force = true"));
    // The bench's page names the command line with the defaults in it.
    done(here, &["config", "unset", "replay.pin"]);
    done(here, &["config", "set", "bench.index", "osp", "time-order"]);
    let bench =
        ["bench", "s.ron", "--quick", "--sizes", "100", "--no-rays", "--no-moving", "--html", "b.html"];
    done(here, &bench);
    let page = fs::read_to_string(here.join("b.html")).expect("a page");
    assert!(page.contains("--index=osp,time-order"), "the page says what was measured");
}

#[test]
fn the_example_of_the_help_is_a_file_of_defaults() {
    let (folder, file) = place();
    let help = done(folder.path(), &["config", "--help"]);
    let lines = help.lines().skip_while(|line| !line.starts_with("  max-polygons"));
    let example: Vec<&str> = lines.take_while(|line| line.starts_with("  ")).collect();
    assert!(example.len() > 4, "{help}");
    fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    fs::write(&file, example.join("\n")).expect("written");
    assert!(done(folder.path(), &["config"]).contains("bench.html = bench.html"));
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
        (&["replay.csv", "my", "frames.csv"], "expected one value"),
    ] {
        let said = refused(here, &[&["config", "set"], args].concat());
        assert!(said.contains(expected) && said.lines().count() == 1, "{args:?}: {said}");
    }
    assert!(refused(here, &["config", "unset", "pace"]).contains("the file has no such default"));
    assert_eq!(fs::read(&file).expect("read"), before);
}

#[test]
fn what_is_text_stays_as_it_was_given() {
    let (folder, file) = place();
    for (value, written) in [("007", "\"007\""), ("+5", "\"+5\""), ("12", "12"), ("1.10", "\"1.10\"")] {
        done(folder.path(), &["config", "set", "replay.csv", value]);
        let text = fs::read_to_string(&file).expect("read");
        assert!(text.contains(&format!("csv = {written}\n")), "{text}");
        assert!(done(folder.path(), &["config"]).contains(&format!("replay.csv = {value}\n")));
    }
}

#[test]
fn a_damaged_file_is_one_line_that_names_its_line() {
    let (folder, file) = place();
    let here = folder.path();
    fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    for (text, line, expected) in [
        ("lenient = true\npace =\n", 2, "expected TOML"),
        ("[replay]\npace = 1979-05-27\n", 2, "expected text, a number, true, false"),
        ("[render]\nindex = [[\"osp\"]]\n", 2, "expected text, a number, true, false"),
        ("\nlenient = 3\n", 2, "expected true or false"),
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

#[test]
fn what_other_programs_left_in_the_file_stops_no_command_and_can_be_removed() {
    let (folder, file) = place();
    let here = folder.path();
    fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    fs::write(&file, "old-one = 1\n[sketch]\nold-two = 2\n[gone]\nx = \"y\"\n").expect("written");
    done(here, &["info", "s.ron"]);
    assert!(refused(here, &["config"]).contains("line 1: old-one: expected an option of a command"));
    for key in ["old-one", "sketch.old-two", "gone.x"] {
        done(here, &["config", "unset", key]);
    }
    assert!(done(here, &["config"]).contains("no defaults"));
}

#[test]
fn a_default_for_what_this_build_lacks_waits_for_one_that_has_it() {
    if cfg!(feature = "render") {
        eprintln!("not looked at here: defaults for drawing in a build that cannot draw");
        return;
    }
    let (folder, _) = place();
    let here = folder.path();
    done(here, &["config", "set", "replay.draw", "64x64"]);
    done(here, &["config", "set", "replay.memory", "1M"]);
    assert!(!indexes(&done(here, &["replay", "s.ron", "--json"])).is_empty());
    assert!(refused(here, &["replay", "s.ron", "--draw=64x64"]).contains("feature `render`"));
}
