//! The settings of the indexes: `--depth`, `--cube`, `--cut-nodes`, `--buckets`, `--leaf`, `--morton-bits`.

use std::path::Path;

use crate::{OSP, csv::Lines};
use osp_rivals::{IndexKind, IndexSetting};
use osp_testkit::temp;
use serde_json::Value;

const OPTIONS: [(&str, IndexSetting); 6] = [
    ("--depth", IndexSetting::MaxDepth),
    ("--cube", IndexSetting::Cube),
    ("--cut-nodes", IndexSetting::CutNodes),
    ("--buckets", IndexSetting::Buckets),
    ("--leaf", IndexSetting::LeafCapacity),
    ("--morton-bits", IndexSetting::MortonBits),
];

/// An index and a setting of it.
const SETTINGS: [[&str; 3]; 8] = [
    ["osp-paper", "--depth", "4"],
    ["osp-paper", "--cube", "3"],
    ["octree-paper", "--depth", "1"],
    ["bvh-sah", "--buckets", "2"],
    ["hlbvh", "--morton-bits", "1"],
    ["lbvh", "--morton-bits", "1"],
    ["kd-tree", "--leaf", "4"],
    ["octree-rebuild", "--leaf", "3"],
];

/// A folder with a session, `room.ron`.
fn room() -> tempfile::TempDir {
    let folder = temp();
    OSP.done_in(folder.path(), ["synth", "room", "room.ron", "--polygons", "1500"]);
    folder
}

/// A replay's run of one index, and the nodes, boxes and planes that it tested in all frames.
fn replayed(folder: &Path, args: &[&str]) -> (Value, [u64; 3]) {
    let how = ["replay", "room.ron", "--pace", "samples:64", "--json", "--csv", "f.csv", "--force"];
    let report = OSP.json_in(folder, [&how[..], args].concat());
    let lines = Lines::read(folder.join("f.csv"));
    let work = ["nodes", "boxes", "planes"].map(|name| lines.numbers(name).iter().sum());
    (report["runs"][0].clone(), work)
}

#[test]
fn a_setting_changes_the_work_of_a_replay_and_not_what_is_in_view() {
    let folder = room();
    let (reference, _) = replayed(folder.path(), &["--index", "brute-force"]);
    for [index, option, value] in SETTINGS {
        let (usual, usually) = replayed(folder.path(), &["--index", index]);
        let (run, work) = replayed(folder.path(), &["--index", index, option, value]);
        assert!(run["fingerprint"].is_string(), "{run}");
        assert_eq!(run["fingerprint"], reference["fingerprint"], "{index} {option} {value}");
        assert_eq!(run["fingerprint"], usual["fingerprint"], "{index}");
        assert_ne!(work, usually, "{index} {option} {value} changes nothing");
    }
    // A shallower tree of the paper has fewer nodes to test, and takes less memory.
    let bytes = |depth: &str| {
        let (run, _) = replayed(folder.path(), &["--index", "osp-paper", "--depth", depth]);
        run["bytes"].as_u64().expect("bytes")
    };
    let [small, large] = ["6", "15"].map(bytes);
    assert!(10 * small < large, "{small} {large}");
}

#[test]
fn all_polygons_of_cut_nodes_are_drawn_on_request() {
    let folder = room();
    for index in ["osp-paper", "octree-paper"] {
        let of = |args: &[&str]| replayed(folder.path(), &[&["--index", index], args].concat()).0;
        let visible = |run: &Value| run["visible_mean"].as_f64().expect("a mean");
        let (usual, tested, drawn) = (of(&[]), of(&["--cut-nodes", "tested"]), of(&["--cut-nodes", "drawn"]));
        assert_eq!(usual["fingerprint"], tested["fingerprint"]);
        assert!(visible(&drawn) > visible(&usual), "{index}: {drawn} {usual}");
    }
    let refused = |args: &[&str], words: &str| {
        let said =
            OSP.refused_in(folder.path(), [&["replay", "room.ron", "--cut-nodes", "drawn"], args].concat());
        assert!(said.contains(words), "{args:?}: {said}");
    };
    refused(&["--index", "osp-paper,osp"], "expected one index");
    refused(&["--index", "osp-paper", "--pin", "a.pins"], "expected no --check and no --pin");
    assert!(!folder.path().join("a.pins").exists());
}

#[cfg(feature = "bench")]
#[test]
fn an_index_is_drawn_with_the_settings() {
    let folder = room();
    let nodes = |args: &[&str]| {
        let how = ["draw-index", "room.ron", "out.dot", "--as", "tree", "--force", "--index"];
        let said = OSP.done_in(folder.path(), [&how[..], args].concat());
        let (before, _) = said.split_once(" nodes, ").expect("the number of nodes");
        let number = before.rsplit(' ').next().unwrap_or_default().replace(',', "");
        number.parse::<usize>().expect("a number")
    };
    assert!(nodes(&["kd-tree", "--leaf", "4"]) > 4 * nodes(&["kd-tree"]));
    // All nodes of a binary tree; in a cube that is too small, also the list of the polygons outside.
    let of_paper = |depth, cube| nodes(&["osp-paper", "--depth", depth, "--cube", cube]);
    assert_eq!([of_paper("3", "2"), of_paper("6", "2"), of_paper("6", "0.5")], [15, 127, 128]);
}

#[test]
fn a_setting_that_changes_nothing_is_refused() {
    let folder = room();
    let mut commands: Vec<&[&str]> = vec![&["replay", "room.ron"]];
    if cfg!(feature = "bench") {
        commands.push(&["draw-index", "room.ron", "out.svg"]);
    }
    let values = ["4", "2", "tested", "4", "4", "4"];
    for ((option, setting), value) in OPTIONS.into_iter().zip(values) {
        for command in &commands {
            if option == "--cut-nodes" && command[0] != "replay" {
                continue;
            }
            let args = [command, &["--index", "brute-force", option, value][..]].concat();
            let said = OSP.refused_in(folder.path(), args);
            assert!(said.contains(&format!("{option} is a setting of")), "{command:?}: {said}");
            for kind in IndexKind::ALL.iter().filter(|kind| kind.has(setting)) {
                assert!(said.contains(kind.name()), "{} in {said}", kind.name());
            }
        }
    }
}
