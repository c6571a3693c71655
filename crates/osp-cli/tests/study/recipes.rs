//! The recipes and questions of `examples/study`, run as `docs/study.md` has them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use osp_lab::study::StudyRow;

use super::{done, rows, sessions, temp};

fn recipes() -> PathBuf {
    Path::new(crate::repository::ROOT).join("examples/study")
}

/// The Python that has DuckDB: that of `OSP_DUCKDB_PYTHON`, which must have it, or else `python3`, which may.
fn python_with_duckdb() -> Option<String> {
    let named = std::env::var("OSP_DUCKDB_PYTHON").ok();
    let python = named.clone().unwrap_or_else(|| "python3".to_owned());
    let has_it = Command::new(&python).args(["-c", "import duckdb"]).output();
    if has_it.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    assert!(named.is_none(), "{python} has no duckdb (pip install duckdb)");
    eprintln!("skipped: {python} has no duckdb (pip install duckdb)");
    None
}

/// The answer to a question, as JSON.
fn ask(python: &str, folder: &Path, question: &str) -> Vec<serde_json::Value> {
    let program = "import duckdb, json, sys\n\
        relation = duckdb.sql(open(sys.argv[1], encoding='utf-8').read())\n\
        print(json.dumps([dict(zip(relation.columns, row)) for row in relation.fetchall()], default=str))";
    let question = recipes().join(question);
    let output = Command::new(python)
        .args(["-c", program])
        .arg(&question)
        .current_dir(folder)
        .output()
        .expect("python starts");
    assert!(output.status.success(), "{}: {}", question.display(), String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn the_questions_in_sql_are_answered() {
    let Some(python) = python_with_duckdb() else { return };
    let folder = temp();
    let folder = folder.path();
    sessions(folder, 4);
    fs::write(folder.join("in/bad.ron"), "Header(version: 2)\n").expect("written");
    done(folder, ["study", "in", "--out", "results.ndjson"]);
    let found = rows(&folder.join("results.ndjson"));

    let wins = ask(&python, folder, "wins.sql");
    assert_eq!(wins.len(), 4);
    for win in wins {
        let of_session = found.iter().filter(|row| win["file"] == row.file.as_str());
        // Two may take the same time.
        let of = |row: &StudyRow| (row.frame_p50_us.expect("a time"), row.index.clone());
        let least = of_session.map(of).min_by(|a, b| a.partial_cmp(b).expect("times")).expect("a row");
        assert_eq!(win["least_time"].as_str(), least.1.as_deref(), "{win}");
    }
    let quantiles = ask(&python, folder, "quantiles.sql");
    assert_eq!(quantiles.len(), 4);
    for row in &quantiles {
        assert_eq!(row["sessions"], 4, "{row}");
        assert_eq!(
            row["index"] == "osp",
            row["times_osp_median"] == 1.0 && row["times_osp_95th"] == 1.0,
            "{row}"
        );
    }
    let growth = ask(&python, folder, "growth.sql");
    let sessions: u64 = growth.iter().map(|row| row["sessions"].as_u64().expect("a number")).sum();
    assert_eq!(sessions, 16);
    let errors = ask(&python, folder, "errors.sql");
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0]["file"], "bad.ron");

    assert!(ask(&python, folder, "machines.sql").is_empty());
    let mut wrong = found.clone();
    wrong.extend(found.iter().map(|row| StudyRow { host: "elsewhere".to_owned(), ..row.clone() }));
    let last = wrong.last_mut().expect("a row");
    last.fingerprint = Some("0123456789abcdef".to_owned());
    let (file, index) = (last.file.clone(), last.index.clone().expect("an index"));
    super::results::write_rows(&folder.join("results.ndjson"), wrong);
    let disagree = ask(&python, folder, "machines.sql");
    assert_eq!(disagree.len(), 1, "{disagree:?}");
    assert_eq!((&disagree[0]["file"], &disagree[0]["index"]), (&file.into(), &index.into()));

    // The program that asks them all.
    let output = Command::new(&python)
        .arg(recipes().join("ask.py"))
        .arg("results.ndjson")
        .current_dir(folder)
        .output();
    let output = output.expect("python starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let questions = fs::read_dir(recipes()).expect("a folder").map(|entry| entry.expect("an entry").path());
    let questions = questions.filter(|path| path.extension().is_some_and(|ending| ending == "sql")).count();
    assert_eq!((output.status.success(), said.matches("== ").count()), (true, questions), "{said}");
}

/// The path of programs with the built `osp` first.
fn path_with_osp() -> std::ffi::OsString {
    let folder = Path::new(env!("CARGO_BIN_EXE_osp")).parent().expect("a folder").to_owned();
    let others = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder).chain(std::env::split_paths(&others));
    std::env::join_paths(all).expect("a path")
}

/// Whether a program starts at all.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

#[cfg(unix)]
#[test]
fn the_recipe_for_gnu_parallel_gives_the_whole() {
    if !is_there("parallel") {
        eprintln!("skipped: GNU parallel is not installed (apt-get install parallel)");
        return;
    }
    let folder = temp();
    sessions(folder.path(), 5);
    done(folder.path(), ["study", "in", "--out", "whole.ndjson"]);
    let status = Command::new(recipes().join("parallel.sh"))
        .args(["in", "results", "3"])
        .current_dir(folder.path())
        .env("PATH", path_with_osp())
        .env("HOME", folder.path())
        .output()
        .expect("bash starts");
    assert!(status.status.success(), "{}", String::from_utf8_lossy(&status.stderr));
    let all = rows(&folder.path().join("results/all.ndjson"));
    assert_eq!(super::facts(&all), super::facts(&rows(&folder.path().join("whole.ndjson"))));
}

#[cfg(unix)]
#[test]
fn the_recipe_for_slurm_measures_its_shard() {
    let folder = temp();
    sessions(folder.path(), 4);
    done(folder.path(), ["study", "in", "--out", "whole.ndjson"]);
    // What Slurm sets for the tasks of an array; Slurm itself is not here.
    for task in ["1", "2"] {
        let output = Command::new(recipes().join("slurm.sh"))
            .args(["in", "results", "2"])
            .current_dir(folder.path())
            .env("PATH", path_with_osp())
            .envs([("SLURM_ARRAY_TASK_ID", task), ("SLURM_CPUS_PER_TASK", "2")])
            .output()
            .expect("bash starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let tables = ["results/shard-1-of-2.ndjson", "results/shard-2-of-2.ndjson", "--out", "all.ndjson"];
    done(folder.path(), ["study", "merge"].into_iter().chain(tables));
    let whole = rows(&folder.path().join("whole.ndjson"));
    assert_eq!(super::facts(&rows(&folder.path().join("all.ndjson"))), super::facts(&whole));
}
