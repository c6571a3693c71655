//! The report's part about moving things.

use super::Report;
use crate::OSP;

const KINDS: &str = "osp,bvh-sah,bvh-two-level,dynamic-bvh,octree-rebuild,bsp,brute-simd";
const MEASURED: [&str; 7] = ["bench", "--quick", "--no-rays", "--sizes", "400,900", "--index", KINDS];

#[test]
fn moving_things_are_in_every_form_of_the_report() {
    let report = Report::of(&OSP.run([&MEASURED[..], &["--json"]].concat()));
    assert_eq!(report.0["faults"].as_array().map(Vec::len), Some(0), "{}", report.0["faults"]);
    for motion in ["1 % scattered", "10 % scattered", "all scattered"] {
        let task = format!("moving/{motion}");
        assert_eq!(report.names(&task, "index").join(","), KINDS, "what is scattered has no groups");
        let (moving, all) =
            ["moving", "polygons"].map(|figure| report.value(&task, "scribble-900", "", figure)).into();
        assert!(moving > 0.0 && (motion != "all scattered" || moving == all), "{motion}: {moving} of {all}");
    }
    let mut motions = 0;
    for motion in [
        "1 % in pieces",
        "10 % in pieces",
        "all in pieces",
        "1 % as a group",
        "all as a group",
        "100 instances",
    ] {
        let task = format!("moving/{motion}");
        assert_eq!(report.names(&task, "index").join(","), format!("{KINDS},group-index"), "{motion}");
        assert_eq!(report.names(&task, "recording"), ["scribble-400", "scribble-900"], "{motion}");
        for size in ["scribble-400", "scribble-900"] {
            let of = |index: &str, figure: &str| report.value(&task, size, index, figure);
            let (moving, all) = (of("", "moving"), of("", "polygons"));
            for index in report.names(&task, "index") {
                assert!(of(index, "time") > 0.0 && of(index, "values") >= 3.0, "{task} {index}");
            }
            let own = of("osp", "entries_set") + of("osp", "entries_inserted");
            assert_eq!(own, moving, "each polygon that moves is an entry: {task}");
            assert_eq!(of("octree-rebuild", "entries_inserted"), all, "{task}");
            assert_eq!(report.maybe(&task, size, "brute-simd", "boxes_computed"), None, "it does not count");
            let groups = of("group-index", "entries_set");
            match motion {
                "100 instances" => assert_eq!(groups, 100.0),
                name if name.ends_with("group") => assert_eq!(groups, 1.0),
                _ => assert_eq!(groups, (moving / 32.0).ceil()),
            }
            motions += 1;
        }
    }
    assert_eq!(motions, 12);
}
