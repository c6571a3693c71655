//! `osp verify` as a user meets it.

use std::process::Output;

use crate::OSP;
use osp_testkit::json;
use serde_json::Value;

/// The methods that `osp verify --json` has rows of.
pub(crate) fn methods(report: &Value) -> Vec<&str> {
    let mut methods: Vec<&str> =
        report["rows"].as_array().expect("rows").iter().filter_map(|row| row["index"].as_str()).collect();
    methods.dedup();
    methods.retain(|method| !method.is_empty());
    methods
}

/// A figure of a method; of the session itself for an empty name.
pub(crate) fn figure(report: &Value, method: &str, figure: &str) -> f64 {
    let is_it = |row: &&Value| row["index"] == method && row["figure"] == figure;
    let row = report["rows"].as_array().expect("rows").iter().find(is_it);
    row.unwrap_or_else(|| panic!("{figure} of {method}: {report}"))["value"].as_f64().expect("a number")
}

const SMALL: [&str; 2] = ["--pixels", "320x180"];

fn verify(args: &[&str]) -> Output {
    OSP.run([&["verify"], args, &SMALL].concat())
}

/// A session that names no source is no built-in scene: its head path is not looked along again at the end.
#[test]
fn as_many_views_are_taken_as_are_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("heads.ron");
    let mut lines = String::from("Header(format: 1, name: \"heads\")\n");
    for i in 0..40 {
        let (t, x) = (f64::from(i) * 0.1, f64::from(i) * 0.05);
        lines += &format!("Head(t: {t}, p: ({x}, 1.0, 3.0), q: (0.0, 0.0, 0.0, 1.0))\n");
        lines += &format!(
            "Polygon(t: {t}, vertices: [({x}, 0.5, 0.0), ({x}, 1.5, 0.0), ({}, 1.5, 0.0)], color: (1.0, 0.5, 0.2, 1.0))\n",
            x + 0.1
        );
    }
    std::fs::write(&path, lines).expect("a session");
    let path = path.to_str().expect("a path in UTF-8");
    let pace = ["--pace", "samples:1", "--occlusion", "msvbsp", "--no-truth", "--repeats", "1"];
    let report = json(&verify(&[&[path, "--views", "3", "--json"], &pace[..]].concat()));
    assert_eq!(figure(&report, "", "views"), 3.0);
}

#[test]
fn no_sound_method_culls_what_is_visible_in_the_shipped_recordings() {
    let mut files: Vec<String> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings"))
        .expect("the folder of recordings")
        .map(|entry| entry.expect("an entry").path().to_string_lossy().into_owned())
        .filter(|path| path.ends_with(".ron"))
        .collect();
    files.sort();
    assert!(files.len() >= 4, "{files:?}");
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let said = OSP.done([&["verify", "--views", "3", "--pixels", "640x360", "--json"], &files[..]].concat());
    let (mut hidden, mut views) = (0.0, 0.0);
    for line in said.lines() {
        let report: Value = serde_json::from_str(line).expect("JSON");
        hidden += figure(&report, "", "hidden");
        views += figure(&report, "", "views");
        let methods = methods(&report);
        assert_eq!(methods.len(), 5);
        assert!(methods.iter().all(|method| figure(&report, method, "wrong") == 0.0), "{report}");
    }
    assert!(hidden > 100.0 && views >= 4.0 * 3.0, "{hidden} hidden, {views} views");
}

#[test]
fn verify_compares_what_was_visible_last() {
    let args = ["recordings/portrait.ron", "--whole", "--views", "2", "--occlusion", "msvbsp,depth-last"];
    let report = json(&verify(&[&args[..], &["--camera", "orbit", "--repeats", "1", "--json"]].concat()));
    let [msvbsp, last] = methods(&report)[..] else { panic!("two methods: {report}") };
    assert!(
        msvbsp.starts_with("msvbsp,") && last.starts_with("depth-last,") && !last.contains("not"),
        "{last}"
    );
    let of = |name| figure(&report, last, name);
    assert_eq!((of("wrong"), of("misreported")), (0.0, 0.0));
    let paint = figure(&report, msvbsp, "hidden");
    assert!(of("hidden") > 2.0 && of("hidden") > 3.0 * paint, "paint behind paint: {report}");
}

fn replay(args: &[&str]) -> Output {
    OSP.run([&["replay", "recordings/room.ron"], args].concat())
}

#[test]
fn replay_runs_every_method_of_occlusion_and_sees_the_same_in_the_frustum() {
    let methods = "none,frusta,svbsp,msvbsp-paper,msvbsp,depth,depth-last,auto";
    let plain = json(&replay(&["--index", "osp", "--json"]));
    assert!(plain["runs"][0]["occlusion"].is_null() && plain["runs"][0]["occluded_mean"].is_null());
    let args = ["--occlusion", methods, "--polygon-ns", "20000", "--verify-frames", "2", "--json"];
    let report = json(&replay(&args));
    assert_eq!(report["indexes_agree"], true);
    let runs = report["runs"].as_array().expect("runs");
    let names: Vec<_> = runs.iter().filter_map(|run| run["occlusion"].as_str()).collect();
    assert_eq!(names.join(","), methods);
    for run in runs {
        let name = run["occlusion"].as_str().expect("a name");
        assert_eq!(run["index"], "osp");
        assert_eq!(run["fingerprint"], plain["runs"][0]["fingerprint"], "{name}: the frustum's own");
        assert_eq!(run["allocations_steady"], 0, "{name}");
        if name != "msvbsp-paper" {
            assert_eq!(run["false_culls"], 0, "{name}");
        }
        let occluded = run["occluded_mean"].as_f64().expect("a number");
        assert_eq!(occluded > 0.0, name != "none", "{name}: {occluded}");
        for key in ["occlusion_us", "occlusion_build_us", "occlusion_query_us"] {
            assert_eq!(run[key].as_f64().expect(key) > 0.0, name != "none", "{name}: {key}");
        }
        assert!(run["frame_drawn_us"]["p50"].as_f64() > run["frame_us"]["p50"].as_f64(), "{name}");
        let used = run["occlusion_used_percent"].as_f64().expect("a number");
        assert!(if name == "none" { used == 0.0 } else { used > 0.0 && used <= 100.0 }, "{name}: {used}");
    }
    assert_eq!(runs[0]["drawn_fingerprint"], runs[0]["fingerprint"]);
}

/// With `--check`, what is drawn does not depend on the clock.
#[test]
fn replay_with_check_decides_by_work_and_draws_the_same_each_time() {
    let pins = ["--check", "recordings/fingerprints.pins"];
    let args = ["--occlusion", "auto", "--polygon-ns", "40", "--json"];
    let runs: Vec<Value> =
        (0..2).map(|_| json(&replay(&[&args[..], &pins].concat()))["runs"][0].clone()).collect();
    let used = runs[0]["occlusion_used_percent"].as_f64().expect("a number");
    assert!(used > 0.0 && used < 100.0, "{used} % of the frames: it should have switched");
    for key in ["drawn_fingerprint", "occlusion_used_percent", "occluded_mean"] {
        assert_eq!(runs[0][key], runs[1][key], "{key}");
    }
}
