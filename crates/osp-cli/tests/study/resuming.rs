//! A study that is stopped goes on, and measures nothing twice; shards are a whole.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};

use super::{command, done, facts, parts, rows, sessions, temp};

const SESSIONS: usize = 10;
/// Makes a session take some tens of milliseconds.
const SLOWLY: [&str; 4] = ["--pace", "samples:1", "--jobs", "1"];

/// Waits until so many sessions are kept, or the program has ended.
fn wait_for(kept: &Path, least: usize, child: &mut std::process::Child) {
    let start = Instant::now();
    while parts(kept).len() < least && child.try_wait().expect("it is there").is_none() {
        assert!(start.elapsed() < Duration::from_secs(120), "no session is kept");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn killed_at_any_point_it_goes_on_and_measures_nothing_twice() {
    let folder = temp();
    sessions(folder.path(), SESSIONS);
    let whole = ["study", "in", "--out", "whole.ndjson"].into_iter().chain(SLOWLY);
    done(folder.path(), whole);
    let args = || ["study", "in", "--out", "r.ndjson"].into_iter().chain(SLOWLY);
    let kept = folder.path().join("r.ndjson.parts");
    let mut before = BTreeMap::new();
    let (mut killed, mut halfway) = (0, 0);
    // Steps and pauses as good as random, and the same in every run of the test.
    for (step, pause_ms) in [(0, 3), (1, 0), (2, 7), (1, 13), (0, 29), (3, 1), (1, 19)] {
        let mut child = command(folder.path(), args())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        wait_for(&kept, before.len() + step, &mut child);
        thread::sleep(Duration::from_millis(pause_ms));
        killed += usize::from(child.try_wait().expect("it is there").is_none());
        // Already ended is as well.
        let _ = child.kill();
        child.wait().expect("it has ended");
        let now = parts(&kept);
        for (name, part) in &before {
            assert_eq!(now.get(name), Some(part), "{name} was measured twice");
        }
        halfway += usize::from(!now.is_empty() && now.len() < SESSIONS);
        before = now;
    }
    assert!(killed >= 2 && halfway >= 3, "killed {killed} times, {halfway} times with sessions left");
    let said = done(folder.path(), args());
    let (now, then) = (SESSIONS - before.len(), before.len());
    assert!(said.starts_with(&format!("{SESSIONS} sessions: {now} measured now, {then} before;")), "{said}");
    let after = parts(&kept);
    assert!(before.iter().all(|(name, part)| after.get(name) == Some(part)), "a session was measured twice");
    let found = rows(&folder.path().join("r.ndjson"));
    assert_eq!(facts(&found), facts(&rows(&folder.path().join("whole.ndjson"))));
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_cleanly() {
    use std::os::unix::process::ExitStatusExt;
    let folder = temp();
    sessions(folder.path(), SESSIONS);
    let args = ["study", "in", "--out", "r.ndjson"].into_iter().chain(SLOWLY);
    let mut child = command(folder.path(), args)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let kept = folder.path().join("r.ndjson.parts");
    wait_for(&kept, 2, &mut child);
    // Whoever runs the tests in the background of a shell has the signal of Ctrl-C ignored; this one is handled alike.
    let sent = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    let output = child.wait_with_output().expect("it has ended");
    assert_eq!(output.status.signal(), Some(15), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.starts_with("stopped: ") && said.contains("the same command goes on from there"), "{said}");
    assert!(!folder.path().join("r.ndjson").exists());
    let names = fs::read_dir(&kept).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    assert!(!names.iter().any(|name| name.starts_with(".unfinished")), "{names:?}");
    assert!(!parts(&kept).is_empty() && parts(&kept).len() < SESSIONS);
}

#[test]
fn a_part_that_is_damaged_is_measured_again_with_a_word() {
    let folder = temp();
    sessions(folder.path(), 2);
    let args = ["study", "in", "--out", "r.ndjson"];
    done(folder.path(), args);
    let kept = folder.path().join("r.ndjson.parts");
    let name = parts(&kept).into_keys().next().expect("a part");
    fs::write(kept.join(&name), "{\"study\":1,\"rows\":[{").expect("written");
    let output = super::osp(folder.path(), args);
    assert!(output.status.success());
    assert!(super::stderr(&output).contains(&name), "{}", super::stderr(&output));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("2 sessions: 1 measured now, 1 before;"));
}

/// The hashes of the contents in each shard, and all rows of them.
fn shards(folder: &Path, sessions: &str, n: usize) -> Vec<BTreeSet<String>> {
    let shard = |i: usize| {
        let (shard, out) = (format!("{i}/{n}"), format!("{sessions}-{i}.ndjson"));
        done(folder, ["study", sessions, "--shard", &shard, "--out", &out]);
        rows(&folder.join(out)).into_iter().filter_map(|row| row.file_hash).collect()
    };
    (1..=n).map(shard).collect()
}

#[test]
fn shards_are_disjoint_and_together_the_whole() {
    let folder = temp();
    sessions(folder.path(), SESSIONS);
    fs::write(folder.path().join("in/bad.ron"), "nonsense\n").expect("written");
    done(folder.path(), ["study", "in", "--out", "whole.ndjson"]);
    let whole = rows(&folder.path().join("whole.ndjson"));
    let found = shards(folder.path(), "in", 3);
    let count: usize = found.iter().map(BTreeSet::len).sum();
    let all: BTreeSet<String> = found.iter().flatten().cloned().collect();
    assert_eq!(count, all.len(), "a session is in two shards");
    assert_eq!(all, whole.iter().filter_map(|row| row.file_hash.clone()).collect());
    assert!(found.iter().filter(|shard| !shard.is_empty()).count() > 1, "{found:?}");

    let tables = ["in-1.ndjson", "in-2.ndjson", "in-3.ndjson"];
    let merge = ["study", "merge"].into_iter().chain(tables);
    done(folder.path(), merge.chain(["--out", "all.ndjson"]));
    assert_eq!(facts(&rows(&folder.path().join("all.ndjson"))), facts(&whole));
    // The folders of parts give the same, and what is there twice is taken once.
    let merge = ["study", "merge", "in-1.ndjson.parts"].into_iter().chain(tables);
    let merge = merge.chain(["in-2.ndjson.parts", "in-3.ndjson.parts", "--out", "again.ndjson"]);
    let said = done(folder.path(), merge);
    assert!(said.contains("were there twice"), "{said}");
    assert_eq!(facts(&rows(&folder.path().join("again.ndjson"))), facts(&whole));

    // Other names in another order: the same shards.
    fs::create_dir(folder.path().join("other")).expect("a folder");
    for (i, entry) in walk(&folder.path().join("in")).into_iter().enumerate() {
        fs::copy(entry, folder.path().join(format!("other/{}.ron", 99 - i))).expect("copied");
    }
    assert_eq!(shards(folder.path(), "other", 3), found);
}

fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { files.extend(walk(&path)) } else { files.push(path) }
    }
    files
}
