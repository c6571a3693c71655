//! The report's part about moving things.

use std::fs;

use serde_json::Value;

use crate::{osp, text};

const KINDS: &str = "osp,bvh-sah,bvh-two-level,dynamic-bvh,octree-rebuild,bsp,brute-simd";
const MEASURED: [&str; 7] = ["bench", "--quick", "--no-rays", "--sizes", "400,900", "--index", KINDS];

#[test]
fn moving_things_are_in_every_form_of_the_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
    let (html, csv) = (path("bench.html"), path("bench.csv"));
    let output = osp(&[&MEASURED[..], &["--json", "--html", &html, "--csv", &csv]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let sizes = report["moving"].as_array().expect("sizes");
    assert_eq!(
        sizes.iter().map(|size| size["polygons"].as_u64()).collect::<Vec<_>>(),
        [Some(400), Some(900)]
    );
    for size in sizes {
        assert_eq!(size["disagree"].as_array().map(Vec::len), Some(0), "{}", size["disagree"]);
        let all = size["polygons"].as_f64().expect("a number");
        let motions = size["motions"].as_array().expect("motions");
        let names: Vec<&str> = motions.iter().filter_map(|motion| motion["motion"].as_str()).collect();
        assert_eq!(names.len(), 7, "{names:?}");
        for motion in motions {
            let moving = motion["moving"].as_f64().expect("a number");
            let rows = motion["rows"].as_array().expect("rows");
            let indexes: Vec<&str> = rows.iter().filter_map(|row| row["index"].as_str()).collect();
            assert_eq!(indexes.join(","), format!("{KINDS},group-index"), "{motion}");
            for row in rows {
                let [frame, ratio] = ["frame_us", "ratio"].map(|key| &row[key]);
                assert!(frame["median"].as_f64() > Some(0.0), "{row}");
                assert!(ratio["values"].as_u64() >= Some(3), "{row}");
            }
            let entries = |index: &str, key: &str| {
                let row = rows.iter().find(|row| row["index"] == index).expect("it is measured");
                row["upkeep"][key].as_f64()
            };
            let own = entries("osp", "adjusted").zip(entries("osp", "filed")).map(|(set, filed)| set + filed);
            assert_eq!(own, Some(moving), "each polygon that moves is an entry: {motion}");
            assert_eq!(entries("octree-rebuild", "filed"), Some(all / 100.0 * 100.0), "{motion}");
            assert_eq!(entries("brute-simd", "boxes"), None, "it does not count");
            let groups = entries("group-index", "adjusted").expect("it counts");
            match motion["motion"].as_str().expect("a name") {
                "100 instances" => assert_eq!(groups, 100.0),
                name if name.ends_with("group") => assert_eq!(groups, 1.0),
                _ => assert_eq!(groups, (moving / 32.0).ceil()),
            }
        }
    }
    let page = fs::read_to_string(&html).expect("the page");
    assert_eq!(page.matches("<figcaption><span>Moving things: ").count(), 2 * 2, "two charts a size");
    for words in ["Moving things: 900 polygons", "in pieces of 32".to_uppercase().as_str(), "group-index"] {
        assert!(page.to_uppercase().contains(&words.to_uppercase()), "{words}");
    }
    let table = fs::read_to_string(&csv).expect("the figures");
    for (figure, indexes) in [("move,ns/polygon", 8), ("entries_filed", 7), ("frame_ratio", 8)] {
        let of = |line: &&str| line.starts_with("moving,") && line.contains(figure);
        assert_eq!(table.lines().filter(of).count(), 2 * 7 * indexes, "{figure}");
    }
    assert!(table.lines().all(|line| line.matches(',').count() == 9), "{table}");
}

#[test]
fn moving_things_can_be_left_out_and_are_in_the_tables_otherwise() {
    let args = ["bench", "--quick", "--no-rays", "--sizes", "300", "--index", "lbvh"];
    let with = osp(&args);
    let without = osp(&[&args[..], &["--no-moving"]].concat());
    assert!(with.status.success() && without.status.success());
    let heading = "Moving things";
    assert!(text(&with.stdout).contains(heading) && !text(&without.stdout).contains(heading));
    for words in ["In pieces of 32", "As a group", "group-index", "100 instances", "all in pieces: "] {
        assert!(text(&with.stdout).contains(words), "{words}: {}", text(&with.stdout));
    }
    assert!(text(&osp(&["bench", "--help"]).stdout).contains("--no-moving"));
}
