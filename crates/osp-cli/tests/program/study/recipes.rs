//! The recipes and questions of `examples/study`, run as `docs/study.md` has them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use super::{field, lines, names, sessions};
use crate::OSP;
use osp_testkit::{stderr, stdout, temp};

fn recipes() -> PathBuf {
    Path::new(osp_testkit::ROOT).join("examples/study")
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
fn ask(python: &str, folder: &Path, question: &str) -> Vec<Value> {
    let program = "import duckdb, json, sys\n\
        text = lambda name: open(name, encoding='utf-8').read()\n\
        duckdb.sql(text(sys.argv[2]))\n\
        relation = duckdb.sql(text(sys.argv[1]))\n\
        print(json.dumps([dict(zip(relation.columns, row)) for row in relation.fetchall()], default=str))";
    let question = recipes().join(question);
    let output = Command::new(python)
        .args(["-c", program])
        .arg(&question)
        .arg(recipes().join("tables.sql"))
        .current_dir(folder)
        .output()
        .expect("python starts");
    assert!(output.status.success(), "{}: {}", question.display(), stderr(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// The lines of `in`, in which a session is damaged.
fn a_study(folder: &Path) -> Vec<Value> {
    sessions(folder, 4);
    fs::write(folder.join("in/bad.ron"), "Header(version: 2)\n").expect("written");
    assert_eq!(OSP.run_in(folder, ["study", "in", "--out", "results.ndjson"]).status.code(), Some(2));
    lines(&folder.join("results.ndjson"))
}

#[test]
fn the_questions_in_sql_are_answered() {
    let Some(python) = python_with_duckdb() else { return };
    let folder = temp();
    let folder = folder.path();
    let found = a_study(folder);

    let wins = ask(&python, folder, "wins.sql");
    assert_eq!(wins.len(), 4);
    for win in wins {
        let line = found.iter().find(|line| win["file"] == line["file"]).expect("its line");
        let runs = line["report"]["runs"].as_array().expect("runs").iter();
        let times = runs.map(|run| (run["frame_us"]["p50"].as_f64().expect("a time"), field(run, "index")));
        let least = times.min_by(|a, b| a.partial_cmp(b).expect("times")).expect("a run");
        assert_eq!(win["least_time"], least.1, "{win}");
    }
    let quantiles = ask(&python, folder, "quantiles.sql");
    assert_eq!(quantiles.len(), 4);
    for row in &quantiles {
        assert_eq!(row["sessions"], 4, "{row}");
        let is_osp = row["times_osp_median"] == 1.0 && row["times_osp_95th"] == 1.0;
        assert_eq!(row["index"] == "osp", is_osp, "{row}");
    }
    let growth = ask(&python, folder, "growth.sql");
    let sessions: u64 = growth.iter().map(|row| row["sessions"].as_u64().expect("a number")).sum();
    assert_eq!(sessions, 16);
    let errors = ask(&python, folder, "errors.sql");
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0]["file"], "bad.ron");

    // The program that asks them all.
    let output = Command::new(&python)
        .arg(recipes().join("ask.py"))
        .arg("results.ndjson")
        .current_dir(folder)
        .output();
    let output = output.expect("python starts");
    let said = stdout(&output);
    assert_eq!(
        (output.status.success(), said.matches("== ").count()),
        (true, 5),
        "{said}{}",
        stderr(&output)
    );
}

/// The path of programs with the built `osp` first.
fn path_with_osp() -> std::ffi::OsString {
    let folder = Path::new(OSP.0).parent().expect("a folder").to_owned();
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
    sessions(folder.path(), 12);
    let odd = folder.path().join("in/a 'b' $c;.ron");
    fs::rename(folder.path().join("in/s0.ron"), &odd).expect("renamed");
    let study = || {
        let command = "find in -name '*.ron' | \"$0\" 'all results.ndjson' --pace samples:32";
        let mut program = Command::new("bash");
        program.args(["-c", command]).arg(recipes().join("parallel.sh")).current_dir(folder.path());
        program.env("PATH", path_with_osp()).env("HOME", folder.path()).output().expect("bash starts")
    };
    let path = folder.path().join("all results.ndjson");
    // Run again, and once more with a session that is damaged: what is there is not measured again.
    for damaged in [false, false, true] {
        if damaged {
            fs::write(folder.path().join("in/bad.ron"), "nonsense").expect("written");
        }
        let output = study();
        assert_eq!(output.status.success(), !damaged, "{}", stderr(&output));
        assert_eq!(names(&lines(&path)).len(), 12 + usize::from(damaged));
    }
    let found = lines(&path);
    assert!(names(&found).contains(&"in/a 'b' $c;.ron"), "{:?}", names(&found));
    assert!(found.iter().all(|line| field(line, "options").contains("--pace samples:32")));
}
