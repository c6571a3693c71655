//! The culler depends on three crates. The program, as built by default, does without the large ones.

use std::process::Command;

use osp_testkit::{stderr, stdout};

/// The crates that `cargo tree` lists for these arguments, and its output.
fn crates(arguments: &[&str]) -> (Vec<String>, String) {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs, as it did to build this");
    let (tree, complaint) = (stdout(&output), stderr(&output));
    assert!(output.status.success(), "{complaint}");
    let names = tree.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned);
    (names.collect(), tree)
}

#[test]
fn the_culler_needs_three_crates() {
    let (crates, tree) = crates(&["--package", "osp", "--depth", "1"]);
    assert_eq!(crates, ["osp", "glam", "libm", "thiserror"], "{tree}");
}

#[test]
fn the_program_as_it_is_built_by_default_has_no_window_and_no_network() {
    let (crates, tree) = crates(&["--package", "osp-cli"]);
    let has = |name: &str| crates.iter().any(|found| found == name);
    assert!(has("clap"), "{tree}");
    for name in ["tokio", "wgpu", "winit"] {
        assert!(!has(name), "{name}: {tree}");
    }
}
