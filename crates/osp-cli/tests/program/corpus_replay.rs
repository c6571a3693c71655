//! Real sessions through every default index, from the file to equal fingerprints in every frame.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::OSP;
use osp_testkit::{json, stderr};
use serde_json::Value;

/// Frames that each session is cut into, if it has as many samples: each is checked, and all sessions together still
/// end in a minute or two.
const FRAMES: u64 = 250;

/// Every session and scene below the corpus.
fn sessions(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for kind in ["tilt", "apa", "cassie/raw_data", "cassie/sketch_history", "poses", "scenes"] {
        let entries = std::fs::read_dir(folder.join(kind)).expect("a folder of the corpus");
        // A video of depth buffers is no session.
        let is_session =
            |path: &PathBuf| !path.ends_with("LICENSE") && path.extension().is_none_or(|e| e != "mocrec");
        found.extend(entries.filter_map(|e| Some(e.ok()?.path())).filter(is_session));
    }
    found.sort();
    assert!(found.len() > 40, "{} has only {} sessions", folder.display(), found.len());
    found
}

fn osp(args: &[&str], session: &Path) -> Value {
    // Another build of the program may be faster.
    let program = std::env::var_os("OSP_PROGRAM").unwrap_or_else(|| OSP.0.into());
    let output = Command::new(program).args(args).arg(session).output().expect("the program starts");
    assert!(output.status.success(), "{}: {}", session.display(), stderr(&output));
    json(&output)
}

#[test]
fn every_corpus_session_replays_and_all_indexes_agree_in_every_frame() {
    let Some(folder) = std::env::var_os("OSP_CORPUS") else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    for session in sessions(Path::new(&folder)) {
        let info = osp(&["info", "--json"], &session);
        // A scene has no strokes: each of its faces is a sample.
        let count = |key: &str| info[key].as_u64().expect("a number");
        let samples = if count("points") > 0 { count("points") } else { count("polygons") };
        let pace = format!("samples:{}", (samples / FRAMES).max(1));
        let report = osp(&["replay", "--json", "--pace", &pace], &session);
        let runs = report["runs"].as_array().expect("runs");
        assert_eq!(runs.len(), 4, "{report}");
        let frames = report["frames"].as_u64().expect("frames");
        assert!(frames >= samples.min(FRAMES / 4), "{}: only {frames} frames", session.display());
        for run in runs {
            assert_eq!(run["fingerprint"], runs[0]["fingerprint"], "{}: {run}", session.display());
            assert_eq!(run["frames_measured"], report["frames"], "{}: {run}", session.display());
            let allocates = run["index"] == "osp" && run["allocations_steady"] != 0;
            assert!(!allocates, "{}: {run}", session.display());
        }
    }
}
