//! Names the commit that the program is built from, for reports of measurements.

use std::{env, fs, path::Path, process::Command};

fn git(args: &[&str]) -> Option<String> {
    let mut command = Command::new("git");
    // Hooks of git name the repository that they run for, which need not be this one.
    command.args(args).env_remove("GIT_DIR").env_remove("GIT_WORK_TREE");
    let output = command.output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned())
}

/// Whether this package lies where it does in osp's own repository. A copy within another's repository has neither that one's
/// commit nor is it built anew after each of its commits.
fn is_repository() -> bool {
    let real = |path: &Path| fs::canonicalize(path).ok();
    let package = env::var_os("CARGO_MANIFEST_DIR").and_then(|folder| real(Path::new(&folder)));
    let top = git(&["rev-parse", "--show-toplevel"]).and_then(|folder| real(Path::new(&folder)));
    package.is_some() && package == top.map(|top| top.join("crates/osp-cli"))
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // A package without its history has no commit to name.
    if !is_repository() {
        return;
    }
    // A change of a library makes the program another, too.
    println!("cargo::rerun-if-changed=../../src");
    for package in fs::read_dir("..").into_iter().flatten().flatten() {
        println!("cargo::rerun-if-changed={}", package.path().join("src").display());
    }
    let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) else { return };
    // Written at every commit and checkout.
    println!("cargo::rerun-if-changed={folder}/logs/HEAD");
    let Some(commit) = git(&["describe", "--always", "--abbrev=12", "--dirty", "--exclude=*"]) else {
        return;
    };
    println!("cargo::rustc-env=OSP_COMMIT={commit}");
}
