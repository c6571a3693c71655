//! Names the commit that the program is built from, for reports of measurements.

use std::process::Command;

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned())
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src");
    // A package without its history has no commit to name.
    let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) else { return };
    // Written at every commit and checkout.
    println!("cargo::rerun-if-changed={folder}/logs/HEAD");
    let Some(commit) = git(&["describe", "--always", "--abbrev=12", "--dirty", "--exclude=*"]) else {
        return;
    };
    println!("cargo::rustc-env=OSP_COMMIT={commit}");
}
