//! The file that lines are added to: nothing of it is lost, and nobody else's file is touched.

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    process::{Child, Stdio},
};

use super::{facts, lines, names, sessions};
use crate::OSP;
use osp_testkit::{stderr, temp, wait_until};

const SESSIONS: usize = 10;
/// Makes a session take some tens of milliseconds.
const SLOWLY: [&str; 6] = ["study", "in", "--out", "r.ndjson", "--pace", "samples:1"];

fn started(folder: &Path, args: &[&str]) -> Child {
    let mut command = OSP.command_in(folder, args);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts")
}

#[test]
fn killed_at_any_point_it_goes_on_and_measures_nothing_twice() {
    let folder = temp();
    sessions(folder.path(), SESSIONS);
    let path = folder.path().join("r.ndjson");
    let count = || if path.exists() { lines(&path).len() } else { 0 };
    let (mut killed, mut before) = (0, Vec::new());
    // Numbers of lines as good as random. The first ones end at once; more follow until one was killed before its end.
    let steps = [0, 0, 1, 2, 1, 0, 2].into_iter().chain(std::iter::repeat(0));
    for (number, step) in steps.enumerate() {
        if number >= 7 && killed > 0 {
            break;
        }
        let least = count() + step;
        let mut child = started(folder.path(), &SLOWLY);
        wait_until("a line", || count() >= least || child.try_wait().expect("it is there").is_some());
        killed += usize::from(child.try_wait().expect("it is there").is_none());
        // It may have ended by now.
        let _ = child.kill();
        child.wait().expect("it has ended");
        let now = fs::read(&path).unwrap_or_default();
        assert!(now.starts_with(&before), "a line was changed");
        before = now;
    }
    OSP.done_in(folder.path(), SLOWLY);
    let found = lines(&path);
    assert_eq!(found.len(), SESSIONS, "{:?}", names(&found));
    assert!(fs::read(&path).expect("there").starts_with(&before));
    // As if nothing had happened.
    let whole = SLOWLY.map(|word| if word == "r.ndjson" { "whole.ndjson" } else { word });
    OSP.done_in(folder.path(), whole);
    let whole = lines(&folder.path().join("whole.ndjson"));
    for (one, other) in found.iter().zip(&whole) {
        assert_eq!((&one["file"], &one["file_hash"]), (&other["file"], &other["file_hash"]));
        assert_eq!(facts(&one["report"]), facts(&other["report"]));
    }
}

const ARGS: [&str; 4] = ["study", "in", "--out", "r.ndjson"];

/// The file of a study of two sessions, and its lines.
fn studied(folder: &Path) -> (PathBuf, Vec<u8>) {
    sessions(folder, 2);
    OSP.done_in(folder, ARGS);
    let path = folder.join("r.ndjson");
    let whole = fs::read(&path).expect("there");
    (path, whole)
}

#[test]
fn a_part_of_a_line_stays_and_is_passed_over() {
    let folder = temp();
    let (path, whole) = studied(folder.path());
    let cut = whole.len() - 100;
    fs::write(&path, &whole[..cut]).expect("written");
    assert!(OSP.done_in(folder.path(), ARGS).starts_with("2 sessions: 1 measured now, 1 before;"));
    let now = fs::read(&path).expect("there");
    assert!(now.starts_with(&[&whole[..cut], b"\n{\"osp_study\":"].concat()));
    assert_eq!(names(&lines(&path)), ["deep/s1.ron", "s0.ron"]);
}

#[test]
fn several_processes_add_to_one_file() {
    let folder = temp();
    sessions(folder.path(), 8);
    let names: Vec<String> =
        (0..8).map(|i| format!("in/{}s{i}.ron", if i % 2 == 0 { "" } else { "deep/" })).collect();
    let start = |name: &String| started(folder.path(), &["study", name, "--out", "r.ndjson"]);
    for child in names.iter().map(start).collect::<Vec<_>>() {
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let path = folder.path().join("r.ndjson");
    let mut expected: Vec<&str> = names.iter().map(String::as_str).collect();
    expected.sort_unstable();
    assert_eq!(super::names(&lines(&path)), expected);
    let text = fs::read_to_string(&path).expect("text");
    assert!(text.lines().all(|line| line.is_empty() || line.starts_with("{\"osp_study\":")), "{text}");
}

/// It is refused, and the file stays what it was.
fn is_refused(folder: &Path, args: &[&str], file: &str, says: &str) {
    let before = fs::read(folder.join(file)).expect("there");
    let said = OSP.refused_in(folder, args);
    assert!(said.contains(file) && said.contains(says) && said.lines().count() == 1, "{args:?}: {said}");
    assert!(fs::read(folder.join(file)).expect("there") == before, "{args:?}");
}

#[test]
fn the_file_of_another_program_is_replaced_only_when_asked() {
    let folder = temp();
    sessions(folder.path(), 2);
    let args = ["study", "in", "--out", "r.ndjson"];
    let path = folder.path().join("r.ndjson");
    for foreign in ["{\"file\":\"a\"}\n", "{\"osp\":1}", "Dear A,\n", "{}\n{\"osp_study\":1}\n", "\n"] {
        fs::write(&path, foreign).expect("written");
        is_refused(folder.path(), &args, "r.ndjson", "--force");
    }
    let with_force = args.into_iter().chain(["--force"]);
    OSP.done_in(folder.path(), with_force.clone());
    let first = lines(&path);
    assert_eq!(names(&first), ["deep/s1.ron", "s0.ron"]);
    // Begun anew: all are measured again.
    assert!(OSP.done_in(folder.path(), with_force).starts_with("2 sessions: 2 measured now, 0 before;"));
    assert_eq!(lines(&path).len(), 2);
    // A session that is read is replaced by nothing.
    fs::copy(folder.path().join("in/s0.ron"), folder.path().join("s.ndjson")).expect("copied");
    let args = ["study", "s.ndjson", "--out", "s.ndjson", "--force"];
    is_refused(folder.path(), &args, "s.ndjson", "is an input, too");
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_is_no_file_to_add_to() {
    let folder = temp();
    sessions(folder.path(), 1);
    assert!(osp_testkit::make_pipe(&folder.path().join("pipe.ndjson")));
    for device in ["zero", "full", "null"] {
        let link = folder.path().join(format!("{device}.ndjson"));
        std::os::unix::fs::symlink(format!("/dev/{device}"), link).expect("a link");
    }
    for out in ["pipe.ndjson", "zero.ndjson", "full.ndjson", "null.ndjson", "/dev/stderr"] {
        for more in [None, Some("--force")] {
            let args: Vec<&str> = ["study", "in", "--out", out].into_iter().chain(more).collect();
            let said = OSP.refused_in(folder.path(), &args);
            assert!(said.contains(out) && said.contains("found a pipe or a device"), "{args:?}: {said}");
            assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
        }
    }
    // As for every output, `-` is standard output.
    assert!(OSP.done_in(folder.path(), ["study", "in", "--out", "-"]).starts_with("{\"osp_study\":"));
}

/// A number below 2 to the power of 31.
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

#[test]
fn damaged_lines_are_measured_again_and_lose_nothing() {
    let folder = temp();
    let (path, whole) = studied(folder.path());
    let mut state = 7;
    for _ in 0..20 {
        let mut bytes = whole.clone();
        for _ in 0..1 + random(&mut state) % 4 {
            // Behind its beginning, which says whose it is.
            let at = 13 + random(&mut state) % (whole.len() - 13);
            bytes[at] = random(&mut state) as u8;
        }
        fs::write(&path, &bytes).expect("written");
        OSP.done_in(folder.path(), ARGS);
        assert!(fs::read(&path).expect("there").starts_with(&bytes));
        let known = lines_of_any_text(&path).iter().filter(|line| is_whole(line)).count();
        assert!(known >= 2, "{}", String::from_utf8_lossy(&bytes));
    }
}

fn lines_of_any_text(path: &Path) -> Vec<serde_json::Value> {
    let bytes = fs::read(path).expect("there");
    bytes.split(|&byte| byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect()
}

fn is_whole(line: &serde_json::Value) -> bool {
    line["file_hash"].is_string()
        && line["report"].is_object()
        && line["options"].as_str().is_some_and(|text| !text.is_empty())
}

#[test]
fn a_line_without_end_is_not_read_into_memory() {
    let folder = temp();
    sessions(folder.path(), 1);
    let path = folder.path().join("long.ndjson");
    let mut file = File::create(&path).expect("made");
    file.write_all(b"{\"osp_study\":1,\"file\":\"").expect("written");
    // A hole of 64 GiB: no disk holds it, and no memory.
    file.set_len(64 << 30).expect("a sparse file");
    drop(file);
    let said = OSP.refused_in(folder.path(), ["study", "in", "--out", "long.ndjson"]);
    assert!(said.contains("long.ndjson: byte 0: expected a line of fewer than 16777216 bytes"), "{said}");
}
