//! `osp query`: what is in a box, in a sphere, near a point, along a ray.

use crate::OSP;
use osp_testkit::temp;
use serde_json::Value;

use super::write_session;

fn query(folder: &std::path::Path, args: &[&str]) -> Value {
    OSP.json_in(folder, ["query"].iter().chain(args).chain(&["--json"]))
}

fn distances(report: &Value) -> Vec<f64> {
    let found = report["found"].as_array().expect("found");
    found.iter().filter_map(|found| found["distance_m"].as_f64()).collect()
}

fn strokes(report: &Value) -> Vec<u64> {
    report["strokes"].as_array().expect("strokes").iter().filter_map(Value::as_u64).collect()
}

#[test]
fn every_index_finds_what_is_in_a_part_of_the_model() {
    let folder = temp();
    // Three upright ribbons above each other, at y = 5, 5.1 and 5.2 (five letters of the name), 5 cm wide, x from 0 to 0.38.
    write_session(folder.path(), "a.ron");
    let parts: [(&[&str], &[u64]); 9] = [
        (&["--box", "-1,4.9,-1", "1,5.04,1"], &[0]),
        (&["--box", "0.1,5.05,-1", "0.2,5.3,1"], &[1, 2]),
        (&["--box", "-3,-3,-3", "-1,-1,-1"], &[]),
        (&["--sphere", "0.2,5.1,0.04", "0.05"], &[1]),
        (&["--sphere", "0.2,5.15,0.04", "0.01"], &[]),
        (&["--nearest", "0.2,9,0", "3"], &[2]),
        (&["--nearest", "0,5.1,0", "100000"], &[0, 1, 2]),
        (&["--ray", "-0.2,4.9,-0.085", "2.5,1,0.875"], &[0, 1]),
        (&["--ray", "-0.2,4.9,-0.085", "2.5,1,0.875", "--hits", "nearest"], &[0]),
    ];
    for (part, expected) in parts {
        let of = |index: &str| query(folder.path(), &[&["a.ron", "--index", index], part].concat());
        let plain = of("brute-force");
        assert_eq!(strokes(&plain), expected, "{part:?}: {plain}");
        assert!(distances(&plain).is_sorted(), "{part:?}: {plain}");
        assert_eq!(plain["query"], part[0].trim_start_matches('-'));
        for kind in osp_rivals::IndexKind::ALL {
            let found = of(kind.name());
            assert_eq!(found["found"], plain["found"], "{} {part:?}", kind.name());
            let asked = found["polygons_asked"].as_u64();
            assert!(asked <= plain["polygons"].as_u64(), "{} {part:?}", kind.name());
        }
    }
}

#[test]
fn polygons_decide_and_not_their_boxes() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    // The ribbon bends: a ray beside it enters boxes and meets nothing.
    let beside = query(folder.path(), &["a.ron", "--ray", "0.2,9,0.042", "0,-1,0", "--index", "bvh-sah"]);
    assert_eq!(beside["found"].as_array().map(Vec::len), Some(0), "{beside}");
    assert!(beside["polygons_asked"].as_u64() > Some(0), "{beside}");
    // So does a sphere.
    let beside = query(folder.path(), &["a.ron", "--sphere", "0.208,5,0.0404", "0.001"]);
    assert_eq!(beside["found"].as_array().map(Vec::len), Some(0), "{beside}");
    assert!(beside["polygons_asked"].as_u64() > Some(0), "{beside}");
    // One across it meets both triangles of a quad at most, and the distances are in order.
    let across = query(folder.path(), &["a.ron", "--ray", "-0.2,4.9,-0.085", "0.25,0.1,0.0875"]);
    assert!((distances(&across)[0] - 0.2832).abs() < 1.0e-3, "{across}");
    // A box across the corner of its box that the triangle leaves free; and parts that touch its corner.
    std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    for (part, count) in [
        (["--box", "0.6,0.6,-1", "1,1,1"], 0),
        (["--box", "-1,-1,-1", "0,0,0"], 1),
        (["--sphere", "-2,0,0", "2"], 1),
    ] {
        let found = query(folder.path(), &[&["a.obj"], &part[..]].concat());
        assert_eq!(found["found"].as_array().map(Vec::len), Some(count), "{found}");
    }
}

#[test]
fn both_orders_find_what_the_index_finds_and_count_their_work() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let mut boxes = [0, 0];
    for hits in ["all", "nearest"] {
        let ray = ["a.ron", "--ray", "-0.2,4.9,-0.085", "2.5,1,0.875", "--hits", hits];
        let plain = query(folder.path(), &ray);
        assert!(plain["work"].is_null() && !plain["found"].as_array().expect("found").is_empty(), "{plain}");
        for kind in osp_rivals::IndexKind::ALL {
            for (order, boxes) in ["in-order", "best-first"].into_iter().zip(&mut boxes) {
                let args = ["--index", kind.name(), "--search", order];
                let found = query(folder.path(), &[&ray[..], &args].concat());
                assert_eq!(found["found"], plain["found"], "{order} {}", kind.name());
                let work = &found["work"];
                assert!(work["boxes"].as_u64() >= found["polygons_asked"].as_u64(), "{found}");
                // How much of this one is in its list depends on when the thread has built the tree.
                if *kind != osp_rivals::IndexKind::OctreeRebuildThread {
                    *boxes += work["boxes"].as_u64().expect("boxes");
                }
            }
        }
    }
    assert!(boxes[1] <= boxes[0], "in order {}, best first {}", boxes[0], boxes[1]);
}

#[test]
fn a_wide_ray_meets_what_a_thin_one_passes() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    // The ray that meets nothing passes the ribbons at less than a centimetre.
    let ray = ["a.ron", "--ray", "0.2,9,0.042", "0,-1,0"];
    let wide = |radius: &str, index: &str| {
        query(
            folder.path(),
            &[&ray[..], &["--index", index, "--radius", radius, "--hits", "nearest"]].concat(),
        )
    };
    let distance_m = |report: &Value| report["found"][0]["distance_m"].as_f64();
    let found = wide("0.01", "osp");
    assert_eq!(strokes(&found), [2], "{found}");
    // The upper ribbon begins about 5 cm above y = 5.2, and a ball touches it at most its radius earlier.
    let [thin, thick] = ["0.01", "0.2"].map(|radius| distance_m(&wide(radius, "osp")).expect("a hit"));
    assert!(thick < thin && thin - thick < 0.2, "{thin} {thick}");
    assert_eq!(wide("0.0001", "osp")["found"].as_array().map(Vec::len), Some(0));
    for kind in osp_rivals::IndexKind::ALL {
        assert_eq!(wide("0.01", kind.name())["found"], found["found"], "{}", kind.name());
    }
    // All that a tenth of a metre around the ray meets is all three.
    let all = query(folder.path(), &[&ray[..], &["--radius", "0.1"]].concat());
    assert_eq!(strokes(&all), [0, 1, 2], "{all}");
    let at = |point: &str, more: &[&str]| query(folder.path(), &[&["a.ron", "--at", point], more].concat());
    let plain = at("0.5,0.5", &[]);
    let best = at("0.5,0.5", &["--search", "best-first", "--index", "kd-tree"]);
    assert_eq!((&plain["found"], strokes(&plain).len()), (&best["found"], 1));
    assert!(plain["work"].is_null() && best["work"]["nodes"].as_u64() > Some(0), "{plain} {best}");
    assert!(strokes(&at("0,0", &[])).is_empty());
    assert_eq!(strokes(&at("0,0", &["--radius", "100"])).len(), 1);
}

#[test]
fn the_first_frame_holds_less_than_the_last() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let all = ["a.ron", "--box", "-9,-9,-9", "9,9,9"];
    let last = query(folder.path(), &all);
    let first = query(folder.path(), &[&all[..], &["--frame", "0", "--pace", "samples:5"]].concat());
    assert_eq!((strokes(&first), strokes(&last)), (vec![0], vec![0, 1, 2]));
    assert_eq!(last["found"].as_array().map(Vec::len), last["polygons"].as_u64().map(|n| n as usize));
}
