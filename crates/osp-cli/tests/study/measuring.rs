//! What is measured, and that it is what `osp replay --json` says.

use std::{collections::BTreeMap, fs, path::Path};

use osp_lab::study::StudyRow;
use serde_json::Value;

use super::{done, facts, osp, parts, rows, sessions, stderr, temp};

/// The rows of a session hold what `osp replay --json` says with the same options.
fn is_as_replayed(folder: &Path, session: &Path, options: &[&str], rows: &[&StudyRow]) {
    let mut args = vec!["replay".into(), session.as_os_str().to_owned(), "--json".into()];
    args.extend(options.iter().map(Into::into));
    let report: Value = serde_json::from_str(&done(folder, args)).expect("one JSON object");
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), rows.len(), "{}", session.display());
    for (run, row) in runs.iter().zip(rows) {
        let name = format!("{} {:?}", row.file, row.index);
        for (key, count) in [
            ("strokes", row.strokes),
            ("points", row.points),
            ("polygons", row.polygons),
            ("frames", row.frames),
        ] {
            assert_eq!(report[key].as_u64(), count, "{name}: {key}");
        }
        assert_eq!(run["index"].as_str(), row.index.as_deref(), "{name}");
        assert_eq!(run["occlusion"].as_str(), row.occlusion.as_deref(), "{name}");
        assert_eq!(run["fingerprint"].as_str(), row.fingerprint.as_deref(), "{name}");
        assert_eq!(run["drawn_fingerprint"].as_str(), row.drawn_fingerprint.as_deref(), "{name}");
        assert_eq!(run["frames_measured"].as_u64(), row.frames_measured, "{name}");
        assert_eq!(run["frames_fingerprinted"].as_u64(), row.frames_fingerprinted, "{name}");
        assert_eq!(run["refused"].as_u64(), row.refused, "{name}");
        assert_eq!(run["bytes"].as_u64(), row.index_bytes, "{name}");
        assert_eq!(run["allocations_steady"].as_u64(), row.allocations_steady, "{name}");
        for (key, mean) in [("visible_mean", row.visible_mean), ("culled_mean", row.culled_mean)] {
            let (theirs, ours) = (run[key].as_f64().expect("a number"), mean.expect("a number"));
            assert!((theirs - ours).abs() <= 1e-9 * theirs.abs(), "{name}: {key} {theirs} {ours}");
        }
        assert_eq!((&*row.pace, &*row.camera), (as_str(&report["pace"]), as_str(&report["camera"])));
        assert_eq!(row.indexes_agree, Some(true), "{name}");
        // Times are of this run alone, and in their order; of a session in which nothing was drawn there are none.
        let times = [row.frame_p50_us, row.frame_p95_us, row.frame_p99_us, row.frame_max_us];
        let times = times.map(|us| us.expect("a time"));
        assert!(times.is_sorted(), "{name}: {times:?}");
        if row.frames > Some(0) {
            assert!(times[3] > 0.0 && row.cull_us > Some(0.0), "{name}: {times:?}");
            // In some sessions every frame also changes what is there: then there is none.
            assert!(row.insert_ns_per_polygon >= Some(0.0), "{name}");
        }
    }
}

fn as_str(value: &Value) -> &str {
    value.as_str().expect("text")
}

fn by_file(rows: &[StudyRow]) -> BTreeMap<&str, Vec<&StudyRow>> {
    let mut files: BTreeMap<_, Vec<_>> = BTreeMap::new();
    rows.iter().for_each(|row| files.entry(row.file.as_str()).or_default().push(row));
    files
}

#[test]
fn the_shipped_sessions_are_measured_as_replay_does() {
    let folder = temp();
    let shipped = Path::new(crate::repository::ROOT).join("recordings");
    let name = shipped.to_str().expect("utf-8");
    let options = ["--budget", "600", "--pace", "samples:32"];
    let args = ["study", name, "--out", "r.ndjson"];
    let said = done(folder.path(), args.iter().chain(&options));
    assert!(said.contains(" measured now, 0 before; r.ndjson: "), "{said}");
    let rows = rows(&folder.path().join("r.ndjson"));
    let files = by_file(&rows);
    assert!(files.len() >= 5 && rows.len() == 4 * files.len(), "{files:?}");
    for (file, rows) in files {
        is_as_replayed(folder.path(), &shipped.join(file), &options, &rows);
        let row = rows[0];
        assert_eq!(row.format.as_deref(), Some("ron"));
        assert_eq!(row.file_bytes, fs::metadata(shipped.join(file)).expect("there").len());
        assert!(!row.host.is_empty() && !row.processor.is_empty() && !row.simd.is_empty() && row.threads > 0);
        assert_eq!(row.osp_version, env!("CARGO_PKG_VERSION"));
    }
}

#[test]
fn occlusion_culling_is_measured_too() {
    let folder = temp();
    sessions(folder.path(), 2);
    let options = ["--occlusion", "none,msvbsp", "--camera", "inside"];
    done(folder.path(), ["study", "in", "--out", "r.ndjson"].iter().chain(&options));
    let rows = rows(&folder.path().join("r.ndjson"));
    for (file, rows) in by_file(&rows) {
        assert_eq!(
            rows.iter().map(|row| row.occlusion.as_deref()).collect::<Vec<_>>(),
            [Some("none"), Some("msvbsp")]
        );
        is_as_replayed(folder.path(), &Path::new("in").join(file), &options, &rows);
    }
}

#[test]
fn a_damaged_session_is_a_row_and_the_others_are_measured() {
    let folder = temp();
    sessions(folder.path(), 3);
    fs::write(folder.path().join("in/bad.ron"), "Header(version: 2)\nnonsense\n").expect("written");
    fs::write(folder.path().join("in/short.tilt"), "tilT and then nothing").expect("written");
    let args = ["study", "in", "--out", "r.ndjson"];
    let output = osp(folder.path(), args);
    let (said, warned) = (String::from_utf8_lossy(&output.stdout), stderr(&output));
    assert!(said.starts_with("5 sessions: 5 measured now, 0 before, 2 could not be read;"), "{said}");
    for name in ["bad.ron", "short.tilt"] {
        assert!(warned.lines().any(|line| line.starts_with("warning: ") && line.contains(name)), "{warned}");
    }
    let found = rows(&folder.path().join("r.ndjson"));
    assert_eq!(found.len(), 3 * 4 + 2);
    for name in ["bad.ron", "short.tilt"] {
        let row = found.iter().find(|row| row.file == name).expect("a row");
        let error = row.error.as_deref().expect("an error");
        assert!(error.contains(name) && !error.contains('\n'), "{error}");
        assert!(row.file_hash.is_some() && row.index.is_none() && row.fingerprint.is_none());
    }
    // What is damaged is not tried again either; with other options it is.
    let said = done(folder.path(), args);
    assert!(said.starts_with("5 sessions: 0 measured now, 5 before, 2 could not be read;"), "{said}");
    let said = done(folder.path(), args.into_iter().chain(["--lenient"]));
    assert!(said.starts_with("5 sessions: 5 measured now, 0 before"), "{said}");
}

#[cfg(unix)]
#[test]
fn what_cannot_be_read_today_may_be_tomorrow() {
    use std::os::unix::fs::PermissionsExt;
    let folder = temp();
    sessions(folder.path(), 2);
    let locked = folder.path().join("in/s0.ron");
    let with_mode = |mode| fs::set_permissions(&locked, fs::Permissions::from_mode(mode)).expect("set");
    with_mode(0o000);
    if fs::File::open(&locked).is_ok() {
        eprintln!("skipped: this user may read every file");
        return;
    }
    let args = ["study", "in", "--out", "r.ndjson"];
    let said = done(folder.path(), args);
    assert!(said.contains("1 could not be read"), "{said}");
    let row = rows(&folder.path().join("r.ndjson")).into_iter().find(|row| row.error.is_some());
    assert!(row.expect("a row").file_hash.is_none());
    with_mode(0o644);
    let said = done(folder.path(), args);
    assert!(said.starts_with("2 sessions: 1 measured now, 1 before;"), "{said}");
}

#[test]
fn contents_count_and_names_do_not() {
    let folder = temp();
    sessions(folder.path(), 2);
    fs::copy(folder.path().join("in/s0.ron"), folder.path().join("in/again.ron")).expect("copied");
    let args = ["study", "in", "--out", "r.ndjson", "--work", "kept"];
    let said = done(folder.path(), args);
    assert!(said.starts_with("3 sessions: 2 measured now, 0 before;"), "{said}");
    let found = rows(&folder.path().join("r.ndjson"));
    let of = |name: &str| found.iter().filter(|row| row.file == name).collect::<Vec<_>>();
    let (first, again) = (of("s0.ron"), of("again.ron"));
    assert_eq!((first.len(), again.len()), (4, 4));
    for (first, again) in first.iter().zip(again) {
        assert_eq!(StudyRow { file: first.file.clone(), ..again.clone() }, **first);
    }
    // A session that has another name by now, or another place, is known; one that has grown is not.
    fs::rename(folder.path().join("in"), folder.path().join("moved")).expect("renamed");
    fs::rename(folder.path().join("moved/s0.ron"), folder.path().join("moved/t.ron")).expect("renamed");
    let args = ["study", "moved", "--out", "r.ndjson", "--work", "kept"];
    assert!(done(folder.path(), args).starts_with("3 sessions: 0 measured now, 2 before;"));
    assert!(rows(&folder.path().join("r.ndjson")).iter().any(|row| row.file == "t.ron"));
    let grown = folder.path().join("moved/t.ron");
    let text = fs::read_to_string(&grown).expect("a session") + "Undo(t: 1000.0)\n";
    fs::write(&grown, text).expect("written");
    assert!(done(folder.path(), args).starts_with("3 sessions: 1 measured now, 2 before;"));
}

#[test]
fn the_results_of_a_study_are_no_sessions() {
    let folder = temp();
    sessions(folder.path(), 2);
    for before in [0, 2, 2] {
        let said = done(folder.path(), ["study", "in", "--out", "in/r.ndjson"]);
        let now = 2 - before;
        assert!(said.starts_with(&format!("2 sessions: {now} measured now, {before} before;")), "{said}");
    }
    assert_eq!(parts(&folder.path().join("in/r.ndjson.parts")).len(), 2);
}

#[test]
fn what_cannot_be_meant_is_one_clear_error() {
    let folder = temp();
    sessions(folder.path(), 1);
    fs::create_dir_all(folder.path().join("none")).expect("a folder");
    fs::create_dir_all(folder.path().join("mine")).expect("a folder");
    fs::write(folder.path().join("mine/diary.txt"), "today").expect("written");
    fs::write(folder.path().join("foreign.parquet"), "PAR1").expect("written");
    for (args, says) in [
        (&["study", "in"][..], "--out <FILE>"),
        (&["study", "--out", "r.ndjson"], "<FILES_OR_FOLDERS>"),
        (&["study", "none", "--out", "r.ndjson"], "expected sessions; found none in none"),
        (&["study", "gone", "--out", "r.ndjson"], "gone: "),
        (&["study", "in", "--out", "r.csv"], "expected a name that ends in .ndjson or .parquet"),
        #[cfg(not(feature = "parquet"))]
        (
            &["study", "in", "--out", "r.parquet"],
            "r.parquet: Parquet needs a build with the feature `parquet`, which this one lacks: \
             cargo install --path crates/osp-cli --features parquet; tables whose name ends in .ndjson are in every build",
        ),
        #[cfg(not(feature = "parquet"))]
        (&["study", "check", "foreign.parquet"], "needs a build with the feature `parquet`"),
        (&["study", "in", "--out", "no/r.ndjson"], "there is no such folder"),
        (&["study", "in", "--out", "r.ndjson", "--shard", "3/2"], "expected K/N"),
        (&["study", "in", "--out", "r.ndjson", "--jobs", "0"], "--jobs"),
        (&["study", "in", "--out", "r.ndjson", "--work", "mine"], "found diary.txt"),
        (&["study", "in", "--out", "r.ndjson", "--occlusion", "hzb"], "culls while drawing"),
        (&["study", "in", "--out", "r.ndjson", "--node-test", "sphere"], "needs --occlusion"),
        (&["study", "in", "--out", "-"], "--work"),
        (&["study", "merge", "in", "--out", "r.ndjson"], "expected a session as `osp study` keeps it"),
        (&["study", "merge", "--out", "r.ndjson"], "<TABLE_OR_DIR>"),
        (&["study", "check", "gone.ndjson"], "gone.ndjson: "),
        (&["study", "check", "in/s0.ron"], "expected the results of `osp study`"),
        (&["study", "report", "in/s0.ron", "--out", "r.html"], "expected the results of `osp study`"),
    ] {
        let output = osp(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        let said = stderr(&output);
        assert!(said.contains(says), "{args:?}: {said}");
        assert_eq!(said.matches("error: ").count(), 1, "{args:?}: {said}");
        assert!(!said.contains("panicked"), "{args:?}: {said}");
    }
    let left: Vec<_> =
        fs::read_dir(folder.path()).expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("r.")), "{left:?}");
}

#[test]
fn real_sessions_are_measured_as_replay_does() {
    let Some(corpus) = std::env::var_os("OSP_CORPUS") else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    let folder = temp();
    let mut small = Vec::new();
    for kind in ["tilt", "apa", "cassie/sketch_history", "poses", "scenes"] {
        let entries = fs::read_dir(Path::new(&corpus).join(kind)).expect("a folder of the corpus");
        let entries = entries.map(|entry| entry.expect("an entry").path());
        let mut files: Vec<_> = entries.filter(|path| path.is_file() && !path.ends_with("LICENSE")).collect();
        files.retain(|path| path.extension().is_none_or(|ending| ending != "mocrec"));
        files.sort_by_key(|path| (path.metadata().map_or(0, |data| data.len()), path.clone()));
        small.extend(files.into_iter().take(2));
    }
    assert!(small.len() >= 8, "{small:?}");
    let options = ["--index", "osp,brute-force", "--pace", "samples:64", "--budget", "100000"];
    let mut args: Vec<_> = ["study", "--out", "r.ndjson"].map(Into::into).to_vec();
    args.extend(small.iter().map(|path| path.as_os_str().to_owned()));
    args.extend(options.iter().map(Into::into));
    done(folder.path(), args);
    let rows = rows(&folder.path().join("r.ndjson"));
    assert_eq!(facts(&rows).len(), 2 * small.len());
    let files = by_file(&rows);
    for session in &small {
        let rows = files.get(session.to_str().expect("utf-8")).expect("its rows");
        is_as_replayed(folder.path(), session, &options, rows);
    }
}
