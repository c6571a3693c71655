//! The report's part about rays, ranges and neighbours.

use std::fs;

use serde_json::Value;

use crate::{osp, session, text};

#[test]
fn rays_ranges_and_neighbours_are_in_every_form_of_the_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
    let (html, csv) = (path("bench.html"), path("bench.csv"));
    let kinds = "osp,osp-paper,kd-tree,bvh-midpoint,bvh-sah,dynamic-bvh,brute-force";
    let measured =
        ["bench", &session, "--quick", "--sizes", "300,900", "--index", kinds, "--pace", "samples:32"];
    let output = osp(&[&measured[..], &["--json", "--html", &html, "--csv", &csv]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let models = report["rays"].as_array().expect("models");
    let sizes: Vec<u64> = models.iter().filter_map(|model| model["polygons"].as_u64()).collect();
    assert!(sizes.len() == 3 && sizes[0] > 1000 && sizes[1..] == [300, 900], "{sizes:?}");
    for model in models {
        assert_eq!(model["disagree"].as_array().map(Vec::len), Some(0), "{}", model["disagree"]);
        let rows = model["rows"].as_array().expect("rows");
        let names: Vec<&str> = rows.iter().filter_map(|row| row["index"].as_str()).collect();
        assert_eq!(names.join(","), kinds);
        let of = |index: &str, keys: [&str; 2]| {
            let row = rows.iter().find(|row| row["index"] == index).expect("it is measured");
            row[keys[0]][keys[1]].as_f64().expect("a number")
        };
        for name in &names {
            for query in ["outside", "inside", "any", "range", "neighbours", "growing"] {
                let row = rows.iter().find(|row| row["index"] == *name).expect("it is measured");
                assert!(row[query]["us"]["median"].as_f64() > Some(0.0), "{name} {query}: {row}");
                assert!(row[query]["ratio"]["values"].as_u64() >= Some(3), "{name} {query}: {row}");
            }
            // Whoever looks at the nearest first looks at no more; equal places may take turns.
            let nodes = |order| of(name, [order, "nodes"]);
            assert!(nodes("best_first") <= nodes("in_order") * 1.05 + 0.5, "{name}");
            assert!(of(name, ["in_order", "boxes"]) <= of("brute-force", ["in_order", "boxes"]), "{name}");
        }
        let moved = model["moved"].as_array().expect("rows");
        assert!(moved.len() > 5 && moved[0]["refitted"] == moved[0]["rebuilt"], "{moved:?}");
        let last = &moved[moved.len() - 1];
        assert!(last["refitted"].as_f64() > last["rebuilt"].as_f64(), "{last}");
    }
    let page = fs::read_to_string(&html).expect("the page");
    assert_eq!(
        page.matches("refit against rebuild as polygons move</span>").count(),
        3,
        "a chart for each model"
    );
    assert_eq!(
        page.matches("<figcaption><span>Rays, ranges and neighbours: ").count(),
        6,
        "charts over the sizes"
    );
    for words in ["SAH against midpoint: a ray tests", "Refit against rebuild", "nearest, inside\nMRays/s"] {
        assert!(page.contains(words), "{words}");
    }
    let table = fs::read_to_string(&csv).expect("the figures");
    for figure in ["any_inside,us/ray", "best_first_boxes,1/ray", "growing_ratio", "neighbours_nodes,1/query"]
    {
        let count = table.lines().filter(|line| line.starts_with("rays,") && line.contains(figure)).count();
        assert_eq!(count, 3 * 7, "{figure}");
    }
    assert!(
        table.contains("rays_moved,\"scribble\",sah-refitted,900,1,boxes_after_32_moves,1/ray,"),
        "{table}"
    );
    assert!(table.lines().all(|line| line.matches(',').count() == 9), "{table}");
}

#[test]
fn rays_can_be_left_out_and_are_in_the_tables_otherwise() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let args = ["bench", &session, "--quick", "--no-growth", "--index", "bvh-sah", "--pace", "samples:32"];
    let with = osp(&args);
    let without = osp(&[&args[..], &["--no-rays"]].concat());
    assert!(with.status.success() && without.status.success());
    let heading = "Rays, ranges and neighbours";
    assert!(text(&with.stdout).contains(heading) && !text(&without.stdout).contains(heading));
    for words in ["MRays/s", "best first", "SAH, refitted", "hit", "nearest hit from inside: "] {
        assert!(text(&with.stdout).contains(words), "{words}: {}", text(&with.stdout));
    }
}
