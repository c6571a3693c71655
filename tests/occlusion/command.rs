//! `osp verify` as a user meets it.

use std::process::{Command, Output};

use serde_json::Value;

fn osp(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_osp"))
        .args(args)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json_of(output: &Output) -> Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

const SMALL: [&str; 2] = ["--pixels", "320x180"];

fn verify(args: &[&str]) -> Output {
    osp(&[&["verify"], args, &SMALL].concat())
}

#[test]
fn verify_says_what_each_method_culled_and_what_it_cost() {
    let report = json_of(&verify(&["recordings/room.ron", "--views", "3", "--json"]));
    assert_eq!((&report["recording"], &report["views"]), (&"room.ron".into(), &3.into()));
    let runs = report["runs"].as_array().expect("runs");
    let names: Vec<_> = runs.iter().filter_map(|run| run["occlusion"].as_str()).collect();
    assert_eq!(names, ["frusta", "svbsp", "msvbsp", "depth"], "every method that is sound");
    for run in runs {
        assert_eq!((&run["views"], &run["false_culls"]), (&3.into(), &0.into()), "{run}");
        assert_eq!(run["sound"], true);
        assert!(run["hidden_culled_percent"].as_f64().is_some_and(|p| p > 50.0 && p <= 100.0), "{run}");
        for key in ["node_tests", "tree_nodes", "select_us", "build_us", "query_us"] {
            assert!(run[key].as_f64().is_some_and(|n| n > 0.0), "{key} in {run}");
        }
    }
}

#[test]
fn verify_prints_a_line_for_each_method_and_number_of_occluders() {
    let output =
        verify(&["scene:rooms", "--views", "2", "--occlusion", "msvbsp,msvbsp-paper", "--occluders", "4,16"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    let count = |start: &str| table.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((count("| msvbsp "), count("| msvbsp-paper (unsound) ")), (2, 2), "{table}");
}

/// What promises nothing may cull what is visible, and is shown to; that is no failed check.
#[test]
fn verify_shows_that_the_paper_hides_what_is_visible() {
    let args = ["scene:ribbons-wide", "--views", "1", "--occlusion", "msvbsp-paper", "--json"];
    let report = json_of(&verify(&args));
    let run = &report["runs"][0];
    assert_eq!((&run["occlusion"], &run["sound"]), (&"msvbsp-paper".into(), &false.into()));
    assert!(run["false_culls"].as_u64().is_some_and(|n| n > 0), "{run}");
}

#[test]
fn verify_refuses_what_it_does_not_know() {
    for (args, expected) in [
        (&["scene:cellar"][..], "no scene is called cellar: expected rooms, panels"),
        (&["recordings/none.ron"], "none.ron"),
        (&["recordings/room.ron", "--occlusion", "guess"], "invalid value 'guess'"),
        (&["recordings/room.ron", "--views", "0"], "0 is not in 1..=10000"),
        (&["recordings/room.ron", "--occluders", "some"], "invalid value 'some'"),
    ] {
        let output = verify(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(text(&output.stderr).contains(expected), "{args:?}: {}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
    let output = osp(&["verify", "recordings/room.ron", "--pixels", "big"]);
    assert!(text(&output.stderr).contains("expected WIDTHxHEIGHT"), "{}", text(&output.stderr));
}

#[test]
fn verify_help_has_examples_and_every_method() {
    let help = text(&osp(&["verify", "--help"]).stdout);
    for word in ["osp verify recordings/room.ron", "msvbsp-paper", "frusta", "svbsp", "depth", "scene:"] {
        assert!(help.contains(word), "{word}");
    }
}
