//! `osp verify --all`: every session of a folder, and a table of all.

use std::fs;

use crate::OSP;
use osp_testkit::{stderr, stdout};

const QUICK: [&str; 9] =
    ["--views", "1", "--pixels", "160x90", "--repeats", "1", "--occlusion", "msvbsp", "--pace=samples:64"];

fn folder_of_sessions() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir_all(folder.path().join("all/deep/deeper")).expect("folders");
    for (i, name) in ["all/a.ron", "all/deep/b.ron", "all/deep/deeper/c.ron"].into_iter().enumerate() {
        let seed = i.to_string();
        OSP.done_in(folder.path(), ["synth", "room", name, "--polygons", "200", "--seed", &seed]);
    }
    fs::write(folder.path().join("all/notes.txt"), "no session").expect("a file");
    folder
}

#[test]
fn every_session_below_a_folder_is_verified_and_summed_up() {
    let folder = folder_of_sessions();
    let text = OSP.done_in(folder.path(), ["verify", "--all", "all"].into_iter().chain(QUICK));
    for name in ["a.ron", "deep/b.ron", "deep/deeper/c.ron"] {
        assert_eq!(text.lines().filter(|line| line.starts_with(&format!(" {name} "))).count(), 1, "{text}");
    }
    assert!(!text.contains("notes.txt"));
    let end = "3 sessions, 3 views: conservative methods culled 0 visible polygons";
    assert_eq!(text.lines().last(), Some(end));
}

#[test]
fn the_parts_are_all_sessions_once() {
    let folder = folder_of_sessions();
    let mut lines: Vec<String> = Vec::new();
    for part in ["1/2", "2/2"] {
        let args = ["verify", "--all", "--json", "--part", part, "all"];
        let said = OSP.done_in(folder.path(), args.into_iter().chain(QUICK));
        lines.extend(said.lines().map(str::to_owned));
    }
    assert_eq!(lines.len(), 3);
    for name in ["a.ron", "b.ron", "c.ron"] {
        let is_of = |line: &&String| line.contains(&format!("\"recording\":\"{name}\""));
        assert_eq!(lines.iter().filter(is_of).count(), 1, "{name}");
    }
    assert!(lines.iter().all(|line| line.contains("\"node_test\":\"box\",\"score\":\"solid-angle\"")));
}

#[test]
fn a_damaged_session_is_named_and_the_others_are_verified() {
    let folder = folder_of_sessions();
    fs::write(folder.path().join("all/deep/bad.ron"), "Header(version: 2)\nnonsense\n").expect("a file");
    let output = OSP.run_in(folder.path(), ["verify", "--all", "all"].into_iter().chain(QUICK));
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("bad.ron"), "{}", stderr(&output));
    assert!(
        stdout(&output).ends_with("culled 0 visible polygons; 1 could not be read\n"),
        "{}",
        stdout(&output)
    );
}
