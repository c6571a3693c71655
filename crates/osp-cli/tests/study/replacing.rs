//! What a study replaces, and what it opens: no table of another study, nothing but regular files.

use std::{fs, path::Path};

use super::{done, osp, rows, sessions, stderr, temp};

/// It fails with this in its message, and the table stays what it was.
fn is_refused(folder: &Path, table: &str, args: &[&str]) {
    let before = fs::read(folder.join(table)).expect("there");
    let output = osp(folder, args);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert!(said.contains(&format!("{table}: holds rows of another study")), "{args:?}: {said}");
    assert!(said.contains("--force") && said.lines().count() == 1, "{args:?}: {said}");
    assert!(fs::read(folder.join(table)).expect("there") == before, "{args:?}");
}

#[test]
fn a_table_of_other_sessions_is_replaced_only_when_asked() {
    let folder = temp();
    sessions(folder.path(), 5);
    done(folder.path(), ["study", "in", "--out", "r.ndjson"]);
    assert_eq!(rows(&folder.path().join("r.ndjson")).len(), 20);
    // Fewer sessions, in the same folder of parts or in another one.
    is_refused(folder.path(), "r.ndjson", &["study", "in/s0.ron", "--out", "r.ndjson"]);
    is_refused(folder.path(), "r.ndjson", &["study", "in/s0.ron", "--out", "r.ndjson", "--work", "kept"]);
    done(folder.path(), ["study", "in/s0.ron", "--out", "r.ndjson", "--force"]);
    assert_eq!(rows(&folder.path().join("r.ndjson")).len(), 4);
    // More of them replace it.
    fs::remove_file(folder.path().join("r.ndjson")).expect("removed");
    done(folder.path(), ["study", "in/deep", "--out", "r.ndjson"]);
    done(folder.path(), ["study", "in", "--out", "r.ndjson"]);
    assert_eq!(rows(&folder.path().join("r.ndjson")).len(), 20);
}

#[test]
fn rows_that_are_kept_nowhere_are_replaced_only_when_asked() {
    let folder = temp();
    sessions(folder.path(), 1);
    let coarse = ["--pace", "samples:64"];
    done(folder.path(), ["study", "in", "--out", "r.ndjson"].into_iter().chain(coarse));
    // With other options: what was measured with the first is kept.
    done(folder.path(), ["study", "in", "--out", "r.ndjson"]);
    done(folder.path(), ["study", "in", "--out", "r.ndjson"].into_iter().chain(coarse));
    // Not any more: the table alone has it.
    fs::remove_dir_all(folder.path().join("r.ndjson.parts")).expect("removed");
    is_refused(folder.path(), "r.ndjson", &["study", "in", "--out", "r.ndjson"]);
    // The same measured anew is the same study.
    done(folder.path(), ["study", "in", "--out", "r.ndjson"].into_iter().chain(coarse));
    // Another machine's rows of the same session.
    let path = folder.path().join("r.ndjson");
    let mut found = rows(&path);
    found.iter_mut().for_each(|row| "elsewhere".clone_into(&mut row.host));
    super::results::write_rows(&path, found);
    is_refused(folder.path(), "r.ndjson", &["study", "in", "--out", "r.ndjson", "--pace", "samples:64"]);
}

#[test]
fn merging_replaces_a_table_that_it_holds_whole() {
    let folder = temp();
    sessions(folder.path(), 2);
    done(folder.path(), ["study", "in/s0.ron", "--out", "a.ndjson"]);
    done(folder.path(), ["study", "in/deep/s1.ron", "--out", "b.ndjson"]);
    done(folder.path(), ["study", "merge", "a.ndjson", "--out", "all.ndjson"]);
    done(folder.path(), ["study", "merge", "a.ndjson", "b.ndjson", "--out", "all.ndjson"]);
    is_refused(folder.path(), "all.ndjson", &["study", "merge", "b.ndjson", "--out", "all.ndjson"]);
    done(folder.path(), ["study", "merge", "b.ndjson", "--out", "all.ndjson", "--force"]);
    assert_eq!(rows(&folder.path().join("all.ndjson")).len(), 4);
}

/// Ends the program if it waits for a pipe.
#[cfg(unix)]
fn ends(folder: &Path, args: &[&str]) -> std::process::Output {
    use std::{process::Stdio, thread, time::Duration};
    let mut child = super::command(folder, args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    for _ in 0..1200 {
        if child.try_wait().expect("it is there").is_some() {
            return child.wait_with_output().expect("it has ended");
        }
        thread::sleep(Duration::from_millis(50));
    }
    child.kill().expect("it is there");
    panic!("{args:?} hangs");
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_where_a_session_is_kept_is_one_clear_error() {
    let folder = temp();
    sessions(folder.path(), 1);
    let study = ["study", "in", "--out", "r.ndjson"];
    done(folder.path(), study);
    let kept = folder.path().join("r.ndjson.parts");
    let name = super::parts(&kept).into_keys().next().expect("a part");
    let pipe = |path: &Path| {
        let made = std::process::Command::new("mkfifo").arg(path).status().expect("mkfifo starts");
        assert!(made.success());
    };
    let device = |path: &Path| std::os::unix::fs::symlink("/dev/zero", path).expect("a link");
    for (there, found) in [(&pipe as &dyn Fn(&Path), "a pipe or a device"), (&device, "a pipe or a device")] {
        for place in [kept.join(&name), kept.join("osp-study.txt")] {
            let before = fs::read(&place).expect("a file");
            fs::remove_file(&place).expect("removed");
            there(&place);
            let args: &[&[&str]] = match place.ends_with(&name) {
                true => &[&study, &["study", "merge", "r.ndjson.parts", "--out", "m.ndjson"]],
                false => &[&study],
            };
            for args in args {
                let output = ends(folder.path(), args);
                let said = stderr(&output);
                assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
                assert!(said.contains("r.ndjson.parts") && said.contains(found), "{args:?}: {said}");
                assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
            }
            fs::remove_file(&place).expect("removed");
            fs::write(&place, before).expect("written");
        }
    }
    assert!(done(folder.path(), study).starts_with("1 sessions: 0 measured now, 1 before;"));
}
