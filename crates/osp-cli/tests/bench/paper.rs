//! `osp bench --paper`: the experiments of the paper, as it is printed.

use std::fs;

use serde_json::Value;

use crate::{osp, session, text};

/// The experiments on a small session of rooms.
fn paper(args: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a temporary folder");
    paper_of(&session(folder.path()), args)
}

fn paper_of(session: &str, args: &[&str]) -> Value {
    let usual = ["bench", session, "--paper", "--quick", "--pace", "samples:8", "--json"];
    let output = osp(&[&usual[..], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let mut report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!((report["sessions"].as_array(), report["growth"].as_array()), (Some(&vec![]), Some(&vec![])));
    report["paper"][0].take()
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}

fn rows<'a>(result: &'a Value, part: &str) -> &'a Vec<Value> {
    result[part].as_array().expect("rows")
}

fn way<'a>(result: &'a Value, name: &str) -> &'a Value {
    let found = rows(result, "flight").iter().find(|row| row["way"] == name);
    found.unwrap_or_else(|| panic!("{name} in {}", result["flight"]))
}

#[test]
fn the_trees_grow_as_printed_and_their_tests_are_counted() {
    let result = paper(&[]);
    let whole: Vec<&Value> =
        rows(&result, "growing").iter().filter(|row| row["part"] == "whole session").collect();
    let trees: Vec<_> = whole.iter().filter_map(|row| row["tree"].as_str()).collect();
    assert_eq!(trees, ["osp-paper", "octree-paper", "octree-rebuild", "osp"]);
    // Figure 6: more is drawn than is in view. The two others draw what is in view.
    assert!(number(whole[0], "drawn") > number(whole[0], "in_view"), "{}", whole[0]);
    assert!(number(whole[1], "drawn") > number(whole[1], "in_view"), "{}", whole[1]);
    for row in &whole[2..] {
        assert_eq!((&row["drawn"], &row["as_printed"]), (&row["in_view"], &false.into()), "{row}");
    }
    // Figure 1: one plane a level, against eight children for every polygon whenever one comes.
    let [osp, octree] = [whole[0], whole[1]].map(|row| number(row, "planes_per_polygon"));
    assert!(osp > 0.0 && osp <= 15.0 && octree > 100.0 * osp, "{osp} {octree}");
    for row in whole {
        assert!(number(&row["frame_us"], "median") > 0.0 && row["draw_us"].is_null(), "{row}");
    }
    assert!(result["drawn_by"].is_null());
    let parts: Vec<_> = rows(&result, "growing").iter().filter_map(|row| row["part"].as_str()).collect();
    assert!(parts.contains(&"up to 1,000 polygons") && parts.contains(&"1,000 to 10,000"), "{parts:?}");
    assert!(!parts.contains(&"over 10,000"), "{parts:?}");
}

#[test]
fn the_flight_says_which_cullers_are_wrong() {
    // All of them: smaller models are drawn faster than `osp` tests their nodes.
    let result =
        paper_of(concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/room.ron"), &["--depth", "15"]);
    for row in rows(&result, "flight") {
        if row["not_conservative"].is_null() {
            assert_eq!(row["wrong"], 0, "{row}");
        }
    }
    let drawn = |name: &str| number(way(&result, name), "drawn");
    assert!(drawn("no culling") > drawn("paper, frustum"));
    assert!(drawn("paper, frustum") > drawn("frustum (osp)"), "over-draw");
    assert!(drawn("paper, msvbsp, box, solid-angle") < drawn("paper, frustum"));
    for name in ["frusta", "svbsp", "msvbsp", "depth", "depth-last"] {
        assert!(drawn(&format!("osp, {name}")) < drawn("frustum (osp)"), "{name}");
    }
    // As printed: what lies before an occluder is hidden, too.
    for name in ["sphere, no caps", "8 corners, no caps"] {
        let row = way(&result, &format!("paper, msvbsp-paper, {name}"));
        assert!(row["not_conservative"].is_string() && number(row, "wrong") > 0.0, "{row}");
    }
    for name in ["sphere", "8 corners"] {
        let row = way(&result, &format!("paper, msvbsp-paper, {name}"));
        assert!(row["not_conservative"].is_string(), "{row}");
        assert!(number(row, "drawn") < drawn("paper, frustum"), "{row}");
    }
}

#[test]
fn depth_and_cube_choose_the_tree_and_are_charted() {
    let result = paper(&["--depth", "2,7", "--cube", "1,3"]);
    let cubes = rows(&result, "cubes");
    let inputs: Vec<_> = cubes.iter().map(|row| (number(row, "cube"), number(row, "depth"))).collect();
    assert_eq!(inputs, [(1.0, 2.0), (1.0, 7.0), (3.0, 2.0), (3.0, 7.0)]);
    for row in cubes {
        assert!(number(row, "planes_per_polygon") <= number(row, "depth"), "{row}");
        assert!(number(row, "drawn") >= number(row, "in_view") && number(row, "tests") > 0.0, "{row}");
    }
    assert!(number(&cubes[1], "drawn") < number(&cubes[0], "drawn"), "smaller leaves, less over-draw");
    assert_eq!(number(&cubes[2], "cube_m"), 3.0 * number(&cubes[0], "cube_m"));
    assert_eq!(result["depth"], 15, "two depths: the other experiments take the usual one");
    let single = paper(&["--depth", "7", "--cube", "3"]);
    assert_eq!((&single["depth"], &single["cube_m"]), (&7.into(), &cubes[3]["cube_m"]));
    let tree = &rows(&single, "growing")[0];
    assert!(number(tree, "planes_per_polygon") <= 7.0, "{tree}");
}

#[test]
fn node_test_score_and_occluders_are_those_of_the_flight() {
    let drawn = |args: &[&str], name: &str| number(way(&paper(args), name), "drawn");
    let usual = drawn(&[], "paper, msvbsp, box, solid-angle");
    let sphere = drawn(&["--node-test", "sphere"], "paper, msvbsp, sphere, solid-angle");
    assert!(sphere > usual, "{sphere} {usual}");
    let few = drawn(&["--score", "paper", "--occluders", "2"], "paper, msvbsp, box, paper");
    assert!(few > usual, "{few} {usual}");
}

#[test]
fn the_page_the_csv_and_the_tables_have_the_chapter() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
    let (session, html, csv) = (session(folder.path()), path("paper.html"), path("paper.csv"));
    let output = osp(&[
        "bench",
        &session,
        "--paper=also",
        "--no-growth",
        "--index",
        "osp",
        "--quick",
        "--pace",
        "samples:8",
        "--depth",
        "3,9",
        "--html",
        &html,
        "--csv",
        &csv,
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report = text(&output.stdout);
    for words in [
        "break-even",
        "The paper, as it is printed",
        "Fig. 20",
        "planes",
        "NO",
        "octree-paper",
        "Nothing was drawn",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    let page = fs::read_to_string(&html).expect("the page");
    for words in [
        "The paper (Fig. 19)",
        "The paper (Fig. 21)",
        "The paper (Fig. 22)",
        "The paper (Fig. 20)",
        "over-draw against",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let table = fs::read_to_string(&csv).expect("the figures");
    for words in ["paper-growing whole session", "paper-flight,", "paper-cube,", "visible_culled"] {
        assert!(table.contains(words), "{words}");
    }
    // Quotes in the name are doubled; nothing but what stands in quotes has a comma.
    for line in table.lines() {
        let outside: String = line.split('"').step_by(2).collect();
        assert_eq!(outside.matches(',').count(), 9, "{line}");
    }
}

/// Real draw times, or one line that says why there are none.
#[test]
fn frames_are_drawn_where_there_is_an_adapter() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let args = ["--paper", "--draw=160x90", "--quick", "--pace", "samples:64", "--depth", "3", "--json"];
    let output = osp(&[&["bench", &session(folder.path())], &args[..]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let result = &report["paper"][0];
    let is_drawn = result["drawn_by"].is_string();
    let must_draw = std::env::var_os("OSP_GPU_TESTS").is_some_and(|value| value == "1");
    assert!(is_drawn || !(must_draw && cfg!(feature = "render")), "{said}");
    assert!(said.contains(if is_drawn { "drawn by" } else { "nothing is drawn" }), "{said}");
    for row in rows(result, "growing").iter().chain(rows(result, "flight")) {
        assert_eq!(row["draw_us"].is_null(), !is_drawn, "{row}");
        if is_drawn {
            let [frame, draw] = ["frame_us", "draw_us"].map(|key| number(&row[key], "median"));
            assert!(draw > 0.0 && frame > draw, "the drawing is in the frame: {row}");
        }
    }
    let has_gpu_culling = rows(result, "flight").iter().any(|row| row["way"] == "osp, hzb");
    assert_eq!(has_gpu_culling, is_drawn);
}

#[test]
fn without_a_session_a_synthetic_one_is_taken() {
    let output = osp(&[
        "bench",
        "--paper",
        "--quick",
        "--pace",
        "samples:64",
        "--depth",
        "3",
        "--cube",
        "1",
        "--json",
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let result = &report["paper"][0];
    assert!(number(result, "polygons") > 10_000.0 && result["recording"] == "synth-room", "{result}");
    assert!(rows(result, "growing").iter().any(|row| row["part"] == "over 10,000"));
}

#[test]
fn options_of_the_paper_need_it() {
    for args in [
        &["bench", "--draw"][..],
        &["bench", "--depth", "3"],
        &["bench", "--cube", "1"],
        &["bench", "--occluders", "3"],
        &["bench", "--paper=never"],
        &["bench", "--paper", "--depth", "22"],
        &["bench", "--paper", "--cube", "0"],
        &["bench", "--paper", "--cube", "NaN"],
        &["bench", "--paper", "--draw=0x5"],
        &["bench", "--paper", "--node-test", "corners-apart"],
    ] {
        let output = osp(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{args:?}");
    }
}
