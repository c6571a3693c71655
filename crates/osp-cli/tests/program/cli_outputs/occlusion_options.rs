//! `--node-test` and `--score`, wherever they are taken.

use crate::OSP;
use serde_json::Value;

use super::command::{figure, methods};

/// The report on the rooms with one method, and the method's name.
fn verified(args: &[&str]) -> (Value, String) {
    let small = ["scene:rooms", "--views", "3", "--pixels", "320x180", "--repeats", "1", "--json"];
    let report = OSP.json([&["verify"], &small[..], args].concat());
    let method = methods(&report)[0].to_owned();
    (report, method)
}

#[test]
fn verify_tests_nodes_as_asked() {
    let by = |test: &str| verified(&["--occlusion", "msvbsp", "--nodes-only", "--node-test", test]);
    let of = |(report, method): &(Value, String), name: &str| figure(report, method, name);
    let [whole, sphere, corners] = ["box", "sphere", "corners"].map(by);
    let [a, b, c] = [&whole, &sphere, &corners].map(|run| of(run, "hidden"));
    assert!(0.0 < b && b < a && 0.0 < c && c < a, "{a} {b} {c}");
    for run in [&whole, &sphere, &corners] {
        assert_eq!((&*run.1, of(run, "wrong")), ("msvbsp, 64 occluders", 0.0));
    }
    let apart = by("corners-apart");
    assert_eq!(apart.1, "msvbsp, 64 occluders (not conservative)");
    assert!(of(&apart, "hidden") >= c);
}

#[test]
fn verify_scores_as_asked() {
    let by = |score: &str| {
        let args = ["--occlusion", "msvbsp", "--grouping", "single", "--occluders", "4", "--score", score];
        let (report, method) = verified(&args);
        assert_eq!(figure(&report, &method, "wrong"), 0.0);
        ["hidden", "planes"].map(|name| figure(&report, &method, name))
    };
    let [paper, measured] = ["paper", "solid-angle"].map(by);
    assert!(paper[0] > 0.0 && paper[1] != measured[1], "{paper:?} {measured:?}");
}

#[test]
fn replay_takes_both_options_and_nothing_visible_is_culled() {
    let replayed = |args: &[&str]| {
        let how = ["--occlusion", "msvbsp", "--polygon-ns", "100", "--occluders", "3", "--camera", "inside"];
        let more = ["--verify-frames", "3", "--json"];
        let report = OSP.json(
            [&["replay", "recordings/room.ron", "--pace", "samples:64"], &how[..], &more, args].concat(),
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
