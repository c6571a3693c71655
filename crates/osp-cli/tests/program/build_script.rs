//! What `build.rs` says to Cargo: the package's own commit, and nothing of a repository around a copy of the package.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use osp_testkit::stderr;

/// Git, whatever its user has set.
fn git(folder: &Path, args: &[&str]) -> String {
    let output = Command::new("git")
        .args(["-c", "user.name=Ann", "-c", "user.email=ann@example.org", "-c", "core.logAllRefUpdates=true"])
        .args(args)
        .current_dir(folder)
        .env("GIT_CONFIG_GLOBAL", "")
        .env("GIT_CONFIG_NOSYSTEM", "1")
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .env_remove("GIT_INDEX_FILE")
        .output()
        .expect("git runs");
    assert!(output.status.success(), "git {args:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("plain text").trim().to_owned()
}

fn repository(folder: &Path) {
    git(folder, &["init", "--quiet"]);
    git(folder, &["add", "."]);
    git(folder, &["commit", "--quiet", "--message", "a commit"]);
}

fn package(folder: PathBuf) -> PathBuf {
    fs::create_dir_all(folder.join("src")).expect("a folder");
    fs::write(folder.join("src/lib.rs"), "").expect("written");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("build.rs"), folder.join("build.rs"))
        .expect("copied");
    folder
}

/// What the script of a package prints, run as Cargo runs it.
fn printed(script: &Path, package: &Path, variables: &[(&str, &Path)]) -> Vec<String> {
    let output = Command::new(script)
        .current_dir(package)
        .env("CARGO_MANIFEST_DIR", package)
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .envs(variables.iter().copied())
        .output()
        .expect("the script runs");
    assert!(output.status.success(), "{}", stderr(&output));
    String::from_utf8(output.stdout).expect("plain text").lines().map(str::to_owned).collect()
}

#[test]
fn the_script_names_and_watches_the_packages_own_repository_only() {
    if Command::new("git").arg("--version").output().is_err() {
        eprintln!("skipped: git does not run");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("it is there");
    let script = root.join(format!("script{}", std::env::consts::EXE_SUFFIX));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("build.rs");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let compiled = Command::new(rustc).args(["--edition", "2024", "-o"]).args([&script, &source]).status();
    assert!(compiled.expect("rustc runs").success(), "build.rs compiles");
    let script_alone = ["cargo::rerun-if-changed=build.rs"];

    // A copy in another's repository, also where a hook of git names that repository.
    let copy = package(root.join("user/vendor/osp/crates/osp-cli"));
    let user = root.join("user");
    repository(&user);
    assert_eq!(printed(&script, &copy, &[]), script_alone);
    assert_eq!(printed(&script, &copy, &[("GIT_DIR", &user.join(".git"))]), script_alone);
    // No repository at all.
    assert_eq!(printed(&script, &package(root.join("unpacked")), &[]), script_alone);

    // Its own, and a worktree of it.
    let own = root.join("own");
    package(own.join("crates/osp-cli"));
    repository(&own);
    git(&own, &["worktree", "add", "--quiet", "../tree"]);
    let commit = git(&own, &["rev-parse", "--short=12", "HEAD"]);
    for (copy, kept) in [(own.as_path(), ".git"), (&root.join("tree"), ".git/worktrees/tree")] {
        let lines = printed(&script, &copy.join("crates/osp-cli"), &[]);
        let log = own.join(kept).join("logs/HEAD");
        assert!(log.is_file(), "{}", log.display());
        assert_eq!(
            lines,
            [
                "cargo::rerun-if-changed=build.rs".to_owned(),
                "cargo::rerun-if-changed=../../src".to_owned(),
                "cargo::rerun-if-changed=../osp-cli/src".to_owned(),
                format!("cargo::rerun-if-changed={}", log.display()),
                format!("cargo::rustc-env=OSP_COMMIT={commit}")
            ]
        );
    }
}
