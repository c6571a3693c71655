//! `osp bench`: the report as text, JSON, CSV and page.

#[path = "bench/moving.rs"]
mod moving;
#[path = "bench/page.rs"]
mod page;
#[path = "bench/paper.rs"]
mod paper;
#[path = "bench/rays.rs"]
mod rays;

use std::{fs, path::Path, process::Command, process::Output};

use serde_json::Value;

fn osp(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_osp")).args(args).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A session with walls that hide, named with characters that HTML and CSV must not take for their own.
fn session(folder: &Path) -> String {
    let path = folder.join("a <b> & \"c\".ron").to_str().expect("utf-8").to_owned();
    let made = osp(&["synth", "room", "--polygons", "1500", &path]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    path
}

fn all_kinds() -> Vec<&'static str> {
    osp_lab::Contender::all().into_iter().map(|contender| contender.name()).collect()
}

#[test]
fn every_index_is_measured_on_sessions_and_growth_and_the_page_holds_all_of_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
    let (html, csv) = (path("bench.html"), path("bench.csv"));
    let output = osp(&[
        "bench",
        &session,
        "--quick",
        "--sizes",
        "200,600",
        "--pace",
        "samples:8",
        "--json",
        "--html",
        &html,
        "--csv",
        &csv,
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let rows = report["sessions"][0]["rows"].as_array().expect("rows");
    let names: Vec<&str> = rows.iter().filter_map(|row| row["index"].as_str()).collect();
    assert_eq!(names, all_kinds());
    assert_eq!(report["sessions"][0]["indexes_agree"], true);
    // `osp --version` prints it in brackets.
    let version = text(&osp(&["--version"]).stdout);
    let commit = version.split_once('(').and_then(|(_, rest)| rest.split_once(')')).map(|(commit, _)| commit);
    assert_eq!(report["machine"]["commit"], commit.unwrap_or("unknown"));
    for row in rows {
        let frame = &row["frame_us"];
        let [low, median, high] = ["low", "median", "high"].map(|key| frame[key].as_f64().expect("a number"));
        assert!(0.0 < low && low <= median && median <= high, "{row}");
        assert!(row["frames_measured"].as_u64().is_some_and(|n| n >= 40), "{row}");
        let reference = row["index"] == "osp";
        assert!(!reference || row["ratio"]["median"] == 1.0, "{row}");
    }
    let growth = report["growth"].as_array().expect("rows");
    assert_eq!(growth.len(), 2 * names.len());
    for row in growth {
        assert!([200, 600].contains(&row["polygons"].as_u64().expect("a number")), "{row}");
        assert!(row["ratio"]["values"].as_u64().is_some_and(|n| n >= 3), "{row}");
    }
    // In a room something is hidden.
    let flight = &report["flights"][1];
    assert!(flight["drawn"].as_f64() < flight["in_view"].as_f64(), "{flight}");

    let page = fs::read_to_string(&html).expect("the page");
    assert!(
        page.contains("a &lt;b&gt; &amp; &quot;c&quot;.ron") && !page.contains("a <b>"),
        "the name is text"
    );
    assert!(page.matches("<svg").count() > 12, "{} charts", page.matches("<svg").count());
    assert_eq!(page.matches("The paper (figure").count(), 2 + 1 + 2, "whole, two sizes; two flights");
    let table = fs::read_to_string(&csv).expect("the figures");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("part,recording,index,polygons,frames,figure,unit,value,low,high"));
    for line in lines {
        // Quotes in the name are doubled; the name has no comma.
        assert_eq!(line.matches(',').count(), 9, "{line}");
    }
    assert!(table.contains("session,\"a <b> & \"\"c\"\".ron\",lbvh,"), "{table}");
}

#[test]
fn the_tables_name_the_machine_and_what_was_compared() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = osp(&[
        "bench",
        &session(folder.path()),
        "--quick",
        "--no-growth",
        "--index",
        "lbvh",
        "--pace",
        "samples:32",
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report = text(&output.stdout);
    for words in ["threads", "commit", " osp ", " lbvh ", "ratio", "break-even"] {
        assert!(report.contains(words), "{words}: {report}");
    }
    assert!(!report.contains("Growth") && !report.contains("kd-tree"), "{report}");
    assert!(!report.contains("All sessions"), "one session needs no table of all: {report}");
    assert_eq!(text(&output.stderr), "");
}

#[test]
fn several_sessions_are_listed_with_the_fastest_other_index() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = session(folder.path());
    let args =
        ["--quick", "--no-growth", "--no-rays", "--index", "osp,brute-simd,bsp", "--pace", "samples:32"];
    let output = osp(&[&["bench", &file, &file][..], &args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report = text(&output.stdout);
    let (each, all) = report.split_once("All sessions: osp against").expect("a table of all sessions");
    // Of the tables of single sessions: the median of the ratios, frame by frame.
    let each = each.lines().filter(|line| line.contains("brute-simd") && line.contains(".."));
    let ratio = |line: &str| line.split(" (").next()?.split_whitespace().last()?.parse::<f64>().ok();
    let ratios: Vec<f64> = each.filter_map(ratio).collect();
    assert_eq!(ratios.len(), 2, "{ratios:?}");
    let rows: Vec<&str> = all.lines().filter(|line| line.contains("brute-simd")).collect();
    assert_eq!(rows.len(), 2, "bsp is rebuilt in every frame, so it is never the fastest: {all}");
    for (row, ratio) in rows.into_iter().zip(ratios) {
        let figures: Vec<f64> = row.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [own, other, against] = figures[figures.len() - 3..] else { panic!("three figures: {row}") };
        assert!(own > 0.0 && other > 0.0 && (against * ratio - 1.0).abs() < 0.02, "{ratio}: {row}");
    }
}

#[test]
fn wrong_use_is_refused_before_anything_is_measured() {
    for args in [
        &["bench", "--no-growth"][..],
        &["bench", "--sizes", "0"],
        &["bench", "--sizes", "5", "--html", "no-such-folder/bench.html"],
        &["bench", "--sizes", "5", "--index", "no-such"],
        &["bench", "no-such-file.ron"],
    ] {
        let output = osp(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{args:?}");
    }
}
