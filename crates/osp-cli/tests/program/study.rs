//! `osp study`: a line for each session, once, whatever stops the program; and what is asked of the lines.
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

mod keeping;
mod measuring;
mod recipes;

use std::{fs, path::Path};

use crate::OSP;
use serde_json::Value;

/// Small sessions that differ, in the folder `in`.
fn sessions(folder: &Path, n: usize) {
    fs::create_dir_all(folder.join("in/deep")).expect("folders");
    for i in 0..n {
        let (kind, seed) = (["room", "portrait", "scribble"][i % 3], i.to_string());
        let name = if i % 2 == 0 { format!("in/s{i}.ron") } else { format!("in/deep/s{i}.ron") };
        OSP.done_in(folder, ["synth", kind, &name, "--polygons", "900", "--seed", &seed]);
    }
}

/// The whole lines of a study.
fn lines(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).expect("lines of text");
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

fn field<'a>(line: &'a Value, name: &str) -> &'a str {
    line[name].as_str().unwrap_or_else(|| panic!("{name}: {line}"))
}

/// The names of the sessions, sorted.
fn names(lines: &[Value]) -> Vec<&str> {
    let mut names: Vec<&str> = lines.iter().map(|line| field(line, "file")).collect();
    names.sort_unstable();
    names
}

/// What a replay found, without its times and what depends on them.
fn facts(report: &Value) -> Value {
    let mut report = report.clone();
    for run in report["runs"].as_array_mut().expect("runs") {
        let run = run.as_object_mut().expect("a run");
        run.retain(|key, _| !key.ends_with("_us") && !key.contains("_ns_per_"));
    }
    report
}
