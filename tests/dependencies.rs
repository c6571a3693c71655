//! What the library needs without features, three crates; and what the program does not need.

use std::{collections::BTreeSet, process::Command};

#[test]
fn without_features_the_library_needs_three_crates() {
    let arguments = ["tree", "--locked", "--offline", "--no-default-features", "--edges", "normal"];
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .args(["--depth", "1", "--prefix", "none", "--format", "{p}", "--package", "osp"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs, as it did to build this");
    let (tree, complaint) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{complaint}");
    let crates: Vec<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(crates, ["osp", "glam", "libm", "thiserror"], "{tree}");
}

#[test]
fn the_program_as_it_is_built_by_default_has_no_server_and_no_parquet() {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(["--package", "osp"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs, as it did to build this");
    let (tree, complaint) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{complaint}");
    let crates: BTreeSet<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
    assert!(crates.contains("clap"), "{tree}");
    // These two, and what came with them.
    for name in ["parquet", "chrono", "num-bigint", "zerocopy", "hyper", "tokio", "tower-http"] {
        assert!(!crates.contains(name), "{name}: {tree}");
    }
}
