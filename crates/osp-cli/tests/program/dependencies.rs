//! The culler depends on three crates. The program, as built by default, does without the large ones. The culler's modules
//! depend only on modules above them.

use std::{fs, process::Command};

use osp_testkit::{at, stderr, stdout};

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

#[test]
fn a_module_of_the_culler_names_only_modules_above_it() {
    let layers = ["math", "polygon", "index", "view", "occlusion", "frame", "culler"];
    for (i, layer) in layers.iter().enumerate() {
        let files = walkdir::WalkDir::new(at(format!("src/{layer}"))).into_iter().flatten();
        let files: Vec<_> =
            files.filter(|file| file.path().extension().is_some_and(|end| end == "rs")).collect();
        assert!(!files.is_empty(), "{layer}");
        for file in files {
            let text = fs::read_to_string(file.path()).expect("a source");
            let code = text.split("\n#[cfg(test)]").next().unwrap_or_default();
            let code: Vec<&str> = code.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
            // What follows `crate::` up to the end of the statement: one path, or those of a `use`.
            let code = code.concat();
            let paths = code.split("crate::").skip(1).filter_map(|rest| rest.split(';').next());
            let words = paths.flat_map(|path| path.split(|c: char| !c.is_alphanumeric() && c != '_'));
            let named: Vec<&str> = words.filter(|word| layers[i + 1..].contains(word)).collect();
            assert!(named.is_empty(), "{} names {named:?}", file.path().display());
        }
    }
}
