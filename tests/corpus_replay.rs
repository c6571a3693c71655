//! Real sessions through every default index, from the file to equal fingerprints in every frame.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

/// Every session below the corpus, if there is one.
fn sessions(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for kind in ["tilt", "apa", "cassie/raw_data", "poses"] {
        let entries = std::fs::read_dir(folder.join(kind)).expect("a folder of the corpus");
        found.extend(entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| !p.ends_with("LICENSE")));
    }
    found.sort();
    assert!(found.len() > 30, "{} has only {} sessions", folder.display(), found.len());
    found
}

#[test]
fn every_corpus_session_replays_and_all_indexes_agree_in_every_frame() {
    let Some(folder) = std::env::var_os("OSP_CORPUS") else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    for session in sessions(Path::new(&folder)) {
        // Large steps: each frame is checked, and the session still ends in seconds.
        let output = Command::new(env!("CARGO_BIN_EXE_osp"))
            .args(["replay", "--json", "--pace", "samples:400", "--budget", "600"])
            .arg(&session)
            .output()
            .expect("the program starts");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {complaint}", session.display());
        let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        let runs = report["runs"].as_array().expect("runs");
        assert_eq!(runs.len(), 4, "{report}");
        for run in runs {
            assert_eq!(run["fingerprint"], runs[0]["fingerprint"], "{}: {run}", session.display());
            assert_eq!(run["frames_measured"], report["frames"], "{}: {run}", session.display());
        }
    }
}
