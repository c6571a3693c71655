//! `osp bench --paper`: the experiments of the paper, as it is printed.

use std::fs;

use super::{NAME, Report, session};
use crate::OSP;
use osp_testkit::stderr;

const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/room.ron");
const GROWING: &str = "paper-growing/whole session";

/// The experiments on a small session of rooms.
fn paper(args: &[&str]) -> Report {
    let folder = tempfile::tempdir().expect("a temporary folder");
    paper_of(&session(folder.path()), args)
}

fn paper_of(session: &str, args: &[&str]) -> Report {
    let usual = ["bench", session, "--paper", "--quick", "--pace", "samples:8", "--json"];
    let report = Report::of(&OSP.run([&usual[..], args].concat()));
    assert!(
        report.rows().iter().all(|row| row["part"].as_str().is_some_and(|part| part.starts_with("paper-")))
    );
    report
}

#[test]
fn the_trees_grow_as_printed_and_their_tests_are_counted() {
    let report = paper(&[]);
    let loops = ["time-order", "brute-simd", "brute-force"];
    let trees = ["osp-paper", "octree-paper", "octree-rebuild"];
    assert_eq!(report.names(GROWING, "index"), [&trees[..], &loops, &["osp"]].concat());
    let of = |tree, figure| report.value(GROWING, NAME, tree, figure);
    // Figure 6: more is drawn than is in view. The others draw only polygons in view.
    for tree in ["osp-paper", "octree-paper"] {
        assert!(of(tree, "drawn") > of(tree, "in_view"), "{tree}");
    }
    for tree in ["octree-rebuild", "osp"].into_iter().chain(loops) {
        assert_eq!(of(tree, "drawn"), of(tree, "in_view"), "{tree}");
    }
    // Figure 1: one plane a level, against eight children for every polygon whenever one comes.
    let [osp, octree] = ["osp-paper", "octree-paper"].map(|tree| of(tree, "planes"));
    assert!(osp > 0.0 && osp <= 15.0 && octree > 100.0 * osp, "{osp} {octree}");
    assert!(of("osp-paper", "time") > 0.0 && report.maybe(GROWING, NAME, "osp-paper", "draw").is_none());
    let has = |part: &str| !report.names(&format!("paper-growing/{part}"), "index").is_empty();
    assert!(has("up to 1,000 polygons") && has("1,000 to 10,000") && !has("over 10,000"));
}

#[test]
fn the_structures_that_grow_can_be_chosen_and_are_compared_with_the_reference() {
    let report = paper(&["--index", "brute-simd,octree-paper", "--reference", "octree-rebuild"]);
    let expected = ["brute-simd", "octree-paper", "osp", "octree-rebuild"];
    assert_eq!(report.names(GROWING, "index"), expected);
    assert_eq!(report.value(GROWING, NAME, "octree-rebuild", "ratio"), 1.0);
    for kind in expected {
        let of = |figure| report.value(GROWING, NAME, kind, figure);
        assert_eq!(of("in_view"), report.value(GROWING, NAME, "osp", "drawn"), "{kind}");
        assert!(of("time") > 0.0 && of("drawn") >= of("in_view"), "{kind}");
    }
    assert_eq!(report.names("paper-growing/1,000 to 10,000", "index"), expected);
}

#[test]
fn the_flight_says_which_cullers_are_wrong() {
    // All of them: smaller models are drawn faster than `osp` tests their nodes.
    let report = paper_of(ROOM, &["--depth", "15"]);
    let of = |way: &str, figure: &str| report.value("paper-flight", "room.ron", way, figure);
    let drawn = |way: &str| of(way, "drawn");
    for way in report.names("paper-flight", "index") {
        assert!(way.ends_with("(not conservative)") || of(way, "visible_culled") == 0.0, "{way}");
    }
    assert!(drawn("no culling") > drawn("paper, frustum"));
    assert!(drawn("paper, frustum") > drawn("frustum (osp)"), "over-draw");
    assert!(drawn("paper, msvbsp, box, solid-angle") < drawn("paper, frustum"));
    for name in ["frusta", "svbsp", "msvbsp", "depth", "depth-last"] {
        assert!(drawn(&format!("osp, {name}")) < drawn("frustum (osp)"), "{name}");
    }
    // As printed: what lies before an occluder is hidden, too.
    for name in ["sphere, no caps", "8 corners, no caps"] {
        assert!(
            of(&format!("paper, msvbsp-paper, {name} (not conservative)"), "visible_culled") > 0.0,
            "{name}"
        );
    }
    for name in ["sphere", "8 corners"] {
        let way = format!("paper, msvbsp-paper, {name} (not conservative)");
        assert!(drawn(&way) < drawn("paper, frustum"), "{way}");
    }
}

#[test]
fn depth_and_cube_choose_the_tree() {
    let report = paper(&["--depth", "2,7", "--cube", "1,3"]);
    let cubes = ["cube x 1, depth 2", "cube x 1, depth 7", "cube x 3, depth 2", "cube x 3, depth 7"];
    assert_eq!(report.names("paper-cube", "index"), cubes);
    let of = |cube: &str, figure: &str| report.value("paper-cube", NAME, cube, figure);
    for cube in cubes {
        let depth = if cube.ends_with('2') { 2.0 } else { 7.0 };
        assert!(of(cube, "planes") <= depth && of(cube, "boxes") > 0.0, "{cube}");
        assert!(of(cube, "drawn") >= of("", "in_view"), "{cube}");
    }
    assert!(of(cubes[1], "drawn") < of(cubes[0], "drawn"), "smaller leaves, less over-draw");
    assert_eq!(of(cubes[2], "edge"), 3.0 * of(cubes[0], "edge"));
    let notes = |report: &Report| report.0["parts"][0]["notes"].to_string();
    assert!(notes(&report).contains("15 levels"), "two depths: the other experiments take the usual one");
    let single = paper(&["--depth", "7", "--cube", "3"]);
    assert!(notes(&single).contains("7 levels"), "{}", notes(&single));
    assert!(single.value(GROWING, NAME, "osp-paper", "planes") <= 7.0);
}

#[test]
fn node_test_score_and_occluders_are_those_of_the_flight() {
    let drawn = |args: &[&str], way: &str| paper(args).value("paper-flight", NAME, way, "drawn");
    let usual = drawn(&[], "paper, msvbsp, box, solid-angle");
    let sphere = drawn(&["--node-test", "sphere"], "paper, msvbsp, sphere, solid-angle");
    assert!(sphere > usual, "{sphere} {usual}");
    let few = drawn(&["--score", "paper", "--occluders", "2"], "paper, msvbsp, box, paper");
    assert!(few > usual, "{few} {usual}");
}

#[test]
fn the_page_and_the_text_have_the_chapters() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (session, html) = (session(folder.path()), folder.path().join("paper.html"));
    let args = [
        "bench",
        &session,
        "--paper=also",
        "--no-growth",
        "--index",
        "osp,osp-paper,octree-paper,brute-force",
        "--quick",
        "--pace",
        "samples:8",
    ];
    let more = ["--depth", "3,9", "--all", "--html", html.to_str().expect("utf-8")];
    let report = OSP.done([&args[..], &more].concat());
    for words in [
        "Sessions: ",
        "without its planes brute-force takes",
        "of what osp-paper saves",
        "Fig. 20",
        "planes",
        "(not conservative)",
        "octree-paper",
        "Nothing was drawn",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    let page = fs::read_to_string(&html).expect("the page");
    for words in ["Figs. 19, 21 to 23", "cube x 0.5, depth 9", "polygons handed to the renderer (Fig. 20)"] {
        assert!(page.contains(words), "{words}");
    }
}

/// Real draw times, or one line that says why there are none.
#[test]
fn frames_are_drawn_where_there_is_an_adapter() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let args = ["--paper", "--draw=160x90", "--quick", "--pace", "samples:64", "--depth", "3", "--json"];
    let output = OSP.run([&["bench", &session(folder.path())], &args[..]].concat());
    let report = Report::of(&output);
    let said = stderr(&output);
    let is_drawn = report.0["parts"][0]["notes"].to_string().contains("Drawn by");
    let must_draw = std::env::var_os("OSP_GPU_TESTS").is_some_and(|value| value == "1");
    assert!(is_drawn || !(must_draw && cfg!(feature = "render")), "{said}");
    assert!(said.contains(if is_drawn { "drawn by" } else { "nothing is drawn" }), "{said}");
    for part in [GROWING, "paper-flight"] {
        for index in report.names(part, "index") {
            let draw = report.maybe(part, NAME, index, "draw");
            assert_eq!(draw.is_some(), is_drawn, "{index}");
            let time = report.value(part, NAME, index, "time");
            assert!(
                draw.is_none_or(|draw| 0.0 < draw && draw < time),
                "the drawing is in the frame: {index}"
            );
        }
    }
    assert_eq!(report.names("paper-flight", "index").contains(&"osp, hzb"), is_drawn);
}

#[test]
fn without_a_session_a_synthetic_one_is_taken() {
    let args =
        ["bench", "--paper", "--quick", "--pace", "samples:64", "--depth", "3", "--cube", "1", "--json"];
    let report = Report::of(&OSP.run(args));
    assert_eq!(report.names("paper-growing/over 10,000", "recording"), ["synth-room"]);
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
        let output = OSP.run(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{args:?}");
    }
}
