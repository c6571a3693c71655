//! The commands that draw.

use std::process::Command;

use super::scenes::gpu;

#[test]
fn a_replay_takes_the_time_of_drawing_each_frame() {
    let Some(_) = gpu() else { return };
    let output = Command::new(env!("CARGO_BIN_EXE_osp"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["replay", "recordings/room.ron", "--pace", "samples:200", "--draw=160x90", "--json"])
        .args(["--index", "osp", "--occlusion", "none,msvbsp"])
        .output()
        .expect("osp");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 2);
    for run in runs {
        assert_eq!(run["frames_drawn"], report["frames"]);
        let us = |name: &str| run["draw_us"][name].as_f64().expect("a number");
        assert!(us("p50") > 0.0 && us("p50") <= us("p99") && us("p99") <= us("max"), "{run}");
        assert!(run["send_us"]["p50"].as_f64() > Some(0.0));
    }
}
