//! `osp bench --paper`: the experiments of the paper, as it is printed.

use super::{NAME, Report, session};
use crate::OSP;

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
