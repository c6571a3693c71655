//! What is measured, and that it is what `osp replay --json` says.

use std::{fs, path::Path};

use serde_json::Value;

use super::{facts, field, lines, names, sessions};
use crate::OSP;
use osp_testkit::{stderr, stdout, temp};

/// The line of a session holds what `osp replay --json` says with the same options.
fn is_as_replayed(folder: &Path, session: &Path, options: &[&str], line: &Value) {
    let mut args = vec!["replay".into(), session.as_os_str().to_owned(), "--json".into()];
    args.extend(options.iter().map(Into::into));
    let replayed: Value = serde_json::from_str(&OSP.done_in(folder, args)).expect("one JSON object");
    assert_eq!(facts(&line["report"]), facts(&replayed), "{}", session.display());
    for run in line["report"]["runs"].as_array().expect("runs") {
        let times = ["p50", "p95", "p99", "max"].map(|name| run["frame_us"][name].as_f64().expect("a time"));
        assert!(times.is_sorted(), "{run}");
    }
}

#[test]
fn the_shipped_sessions_are_measured_as_replay_does() {
    let folder = temp();
    let shipped = Path::new(osp_testkit::ROOT).join("recordings");
    let name = shipped.to_str().expect("utf-8");
    let options = ["--pace", "samples:32"];
    let said = OSP.done_in(folder.path(), ["study", name, "--out", "r.ndjson"].iter().chain(&options));
    assert!(said.contains(" measured now, 0 before; r.ndjson"), "{said}");
    let lines = lines(&folder.path().join("r.ndjson"));
    assert!(lines.len() >= 5, "{lines:?}");
    for line in &lines {
        let session = shipped.join(field(line, "file"));
        is_as_replayed(folder.path(), &session, &options, line);
        assert!(field(line, "file").ends_with(field(line, "format")) && line["error"].is_null(), "{line}");
        assert_eq!(line["file_bytes"], fs::metadata(session).expect("there").len());
        let machine = &line["machine"];
        for name in ["host", "processor", "system", "simd", "osp_commit"] {
            assert!(!field(machine, name).is_empty(), "{machine}");
        }
        assert_eq!(machine["osp_version"], env!("CARGO_PKG_VERSION"));
    }
}

#[test]
fn without_a_file_lines_are_printed() {
    let folder = temp();
    sessions(folder.path(), 2);
    let options = ["--occlusion", "none,msvbsp", "--camera", "inside"];
    let said = OSP.done_in(folder.path(), ["study", "in"].iter().chain(&options));
    assert_eq!(said.lines().count(), 2, "{said}");
    for line in said.lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        let methods = line["report"]["runs"].as_array().expect("runs").iter().map(|run| &run["occlusion"]);
        assert_eq!(methods.collect::<Vec<_>>(), ["none", "msvbsp"]);
        is_as_replayed(folder.path(), &Path::new("in").join(field(&line, "file")), &options, &line);
    }
}

#[test]
fn a_session_that_cannot_be_read_is_a_line_and_the_others_are_measured() {
    let folder = temp();
    sessions(folder.path(), 3);
    fs::write(folder.path().join("in/bad.ron"), "Header(version: 2)\nnonsense\n").expect("written");
    fs::write(folder.path().join("in/short.tilt"), "tilT and then nothing").expect("written");
    let args = ["study", "in", "--out", "r.ndjson"];
    // What is damaged is not tried again, but still said; with other options it is tried.
    for (now, more, count) in [(5, None, 5), (0, None, 5), (5, Some("--lenient"), 10)] {
        let output = OSP.run_in(folder.path(), args.into_iter().chain(more));
        let (said, warned) = (stdout(&output), stderr(&output));
        assert_eq!(output.status.code(), Some(2), "{warned}");
        assert!(said.starts_with(&format!("5 sessions: {now} measured now, ")), "{said}");
        for name in ["bad.ron", "short.tilt"] {
            assert!(
                warned.lines().any(|line| line.starts_with("warning: ") && line.contains(name)),
                "{warned}"
            );
        }
        assert!(warned.ends_with("error: 2 of 5 sessions could not be read\n"), "{warned}");
        assert_eq!(lines(&folder.path().join("r.ndjson")).len(), count);
    }
    let found = lines(&folder.path().join("r.ndjson"));
    for name in ["bad.ron", "short.tilt"] {
        let line = found.iter().find(|line| line["file"] == name).expect("a line");
        assert!(field(line, "error").contains(name) && line["report"].is_null(), "{line}");
        assert_eq!(field(line, "file_hash").len(), 32);
    }
}

#[cfg(unix)]
#[test]
fn what_the_system_refuses_today_it_may_give_tomorrow() {
    let folder = temp();
    sessions(folder.path(), 2);
    let session = folder.path().join("in/s0.ron");
    let text = fs::read(&session).expect("a session");
    fs::remove_file(&session).expect("removed");
    assert!(osp_testkit::make_pipe(&session));
    let args = ["study", "in/s0.ron", "in/deep/s1.ron", "--out", "r.ndjson"];
    OSP.refused_in(folder.path(), args);
    let found = lines(&folder.path().join("r.ndjson"));
    assert!(field(&found[0], "error").contains("a pipe or a device") && found[0]["file_hash"].is_null());
    fs::remove_file(&session).expect("removed");
    fs::write(&session, text).expect("written");
    let said = OSP.done_in(folder.path(), args);
    assert!(said.starts_with("2 sessions: 1 measured now, 1 before;"), "{said}");
}

#[test]
fn contents_count_and_names_do_not() {
    let folder = temp();
    sessions(folder.path(), 2);
    fs::copy(folder.path().join("in/s0.ron"), folder.path().join("in/again.ron")).expect("copied");
    let said = OSP.done_in(folder.path(), ["study", "in", "--out", "r.ndjson"]);
    assert!(said.starts_with("3 sessions: 2 measured now, 1 before;"), "{said}");
    // A session that has another name by now, or another place, is known; one that has grown is not.
    fs::rename(folder.path().join("in"), folder.path().join("moved")).expect("renamed");
    fs::rename(folder.path().join("moved/s0.ron"), folder.path().join("moved/t.ron")).expect("renamed");
    let args = ["study", "moved", "--out", "r.ndjson"];
    assert!(OSP.done_in(folder.path(), args).starts_with("3 sessions: 0 measured now, 3 before;"));
    let grown = folder.path().join("moved/t.ron");
    let text = fs::read_to_string(&grown).expect("a session") + "Undo(t: 1000.0)\n";
    fs::write(&grown, text).expect("written");
    assert!(OSP.done_in(folder.path(), args).starts_with("3 sessions: 1 measured now, 2 before;"));
    // With other options all are measured again, beside the first.
    let said = OSP.done_in(folder.path(), args.into_iter().chain(["--pace", "samples:8"]));
    assert!(said.starts_with("3 sessions: 3 measured now, 0 before;"), "{said}");
    let found = lines(&folder.path().join("r.ndjson"));
    assert_eq!(names(&found).len(), 6, "{found:?}");
}

#[test]
fn the_lines_of_a_study_are_no_session() {
    let folder = temp();
    sessions(folder.path(), 2);
    for now in [2, 0] {
        let said = OSP.done_in(folder.path(), ["study", "in", "--out", "in/r.ndjson"]);
        assert!(said.starts_with(&format!("2 sessions: {now} measured now, ")), "{said}");
    }
}
