//! The report's part about rays, ranges and neighbours.

use super::{NAME, Report, session};
use crate::OSP;

#[test]
fn rays_ranges_and_neighbours_are_measured_in_sessions_and_sizes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let kinds = "osp,osp-paper,kd-tree,bvh-midpoint,bvh-sah,dynamic-bvh,brute-force";
    let measured = [
        "bench",
        &session,
        "--quick",
        "--sizes",
        "300,900",
        "--index",
        kinds,
        "--pace",
        "samples:32",
        "--json",
    ];
    let report = Report::of(&OSP.run(measured));
    assert_eq!(report.0["faults"].as_array().map(Vec::len), Some(0), "{}", report.0["faults"]);
    let models = [NAME, "scribble-300", "scribble-900"];
    for model in models {
        for task in ["nearest outside", "nearest inside", "any inside", "box", "neighbours", "growing"] {
            let task = format!("rays/{task}");
            assert_eq!(report.names(&task, "recording"), models, "{task}");
            assert_eq!(report.names(&task, "index").join(","), kinds, "{task}");
            for kind in kinds.split(',') {
                let of = |figure| report.value(&task, model, kind, figure);
                assert!(of("time") > 0.0 && of("values") >= 3.0, "{task} {kind}");
            }
        }
        for kind in kinds.split(',') {
            let of = |task, figure| report.value(task, model, kind, figure);
            // Whoever looks at the nearest first looks at no more; equal places may take turns.
            let [in_order, best_first] =
                ["rays/walk in order", "rays/walk best first"].map(|walk| of(walk, "nodes"));
            assert!(best_first <= in_order * 1.05 + 0.5, "{kind}");
            let all = report.value("rays/walk in order", model, "brute-force", "boxes");
            assert!(of("rays/walk in order", "boxes") <= all, "{kind}");
        }
        let boxes =
            |tree, moves| report.value("rays/moved", model, tree, &format!("boxes_after_{moves}_moves"));
        assert_eq!(boxes("sah-refitted", 0), boxes("sah-rebuilt", 0));
        assert!(boxes("sah-refitted", 32) > boxes("sah-rebuilt", 32), "{model}");
    }
}
