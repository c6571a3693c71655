//! `--node-test` and `--score`, wherever they are taken.

use serde_json::Value;

use crate::command::{osp, text};

fn json(args: &[&str]) -> Value {
    let output = osp(args);
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn verified(args: &[&str]) -> Value {
    let small = ["scene:rooms", "--views", "3", "--pixels", "320x180", "--repeats", "1", "--json"];
    let report = json(&[&["verify"], &small[..], args].concat());
    report["runs"][0].clone()
}

fn hidden(run: &Value) -> f64 {
    run["hidden_culled_percent"].as_f64().expect("a number")
}

#[test]
fn verify_tests_nodes_as_asked() {
    let by = |test: &str| verified(&["--occlusion", "msvbsp", "--nodes-only", "--node-test", test]);
    let [whole, sphere, corners] = ["box", "sphere", "corners"].map(by);
    assert!(0.0 < hidden(&sphere) && hidden(&sphere) < hidden(&whole), "{sphere} {whole}");
    assert!(0.0 < hidden(&corners) && hidden(&corners) < hidden(&whole), "{corners} {whole}");
    for run in [&whole, &sphere, &corners] {
        assert_eq!((&run["sound"], &run["false_culls"]), (&true.into(), &0.into()), "{run}");
    }
    let apart = by("corners-apart");
    assert_eq!((&apart["sound"], &apart["occlusion"]), (&false.into(), &"msvbsp".into()), "{apart}");
    assert!(hidden(&apart) >= hidden(&corners), "{apart} {corners}");
    // The former name.
    let report = verified(&["--occlusion", "msvbsp", "--nodes-only", "--test", "sphere"]);
    assert_eq!(report["node_tests"], sphere["node_tests"]);
}

#[test]
fn verify_knows_the_papers_tree_without_caps_and_says_that_it_is_wrong() {
    let run = verified(&["--occlusion", "msvbsp-paper-capless"]);
    assert_eq!((&run["sound"], &run["occlusion"]), (&false.into(), &"msvbsp-paper-capless".into()), "{run}");
    assert!(run["false_culls"].as_u64().is_some_and(|n| n > 0), "{run}");
}

#[test]
fn verify_scores_as_asked() {
    let by = |score: &str| {
        verified(&["--occlusion", "msvbsp", "--grouping", "single", "--occluders", "4", "--score", score])
    };
    let [paper, measured] = ["paper", "solid-angle"].map(by);
    assert_eq!((&paper["false_culls"], &measured["false_culls"]), (&0.into(), &0.into()));
    assert!(hidden(&paper) > 0.0 && paper["tree_nodes"] != measured["tree_nodes"], "{paper} {measured}");
}

#[test]
fn replay_takes_both_options_and_nothing_visible_is_culled() {
    let replayed = |args: &[&str]| {
        let how = ["--occlusion", "msvbsp", "--polygon-ns", "100", "--occluders", "3", "--camera", "inside"];
        let more = ["--verify-frames", "3", "--json"];
        let report = json(
            &[&["replay", "recordings/room.ron", "--pace", "samples:64"], &how[..], &more, args].concat(),
        );
        report["runs"][0].clone()
    };
    let occluded = |run: &Value| run["occluded_mean"].as_f64().expect("a number");
    let usual = replayed(&[]);
    assert_eq!((&usual["node_test"], &usual["score"]), (&"box".into(), &"solid-angle".into()));
    for args in [["--node-test", "sphere"], ["--node-test", "corners"], ["--score", "paper"]] {
        let run = replayed(&args);
        assert_eq!(run[args[0].trim_start_matches("--").replace('-', "_").as_str()], args[1], "{run}");
        assert_eq!(run["false_culls"], 0, "{args:?}");
        assert_ne!(occluded(&run), occluded(&usual), "{args:?} changes nothing");
    }
}

#[test]
fn what_would_change_nothing_or_cull_wrongly_is_refused() {
    let output = osp(&["replay", "recordings/room.ron", "--node-test", "sphere"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("--node-test is about occlusion culling"), "{output:?}");
    let mut commands: Vec<&[&str]> = vec![&["replay", "recordings/room.ron", "--occlusion", "msvbsp"]];
    if cfg!(feature = "window") {
        commands.push(&["sketch"]);
    }
    for command in commands {
        let output = osp(&[command, &["--node-test", "corners-apart"]].concat());
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        assert!(text(&output.stderr).contains("corners"), "{output:?}");
    }
}
