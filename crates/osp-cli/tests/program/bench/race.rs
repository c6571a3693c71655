//! `osp race`: structures on one session, frame by frame.

use super::{NAME, Report, session};
use crate::{OSP, csv::Lines};
use osp_testkit::{stderr, stdout};

const PART: &str = "race";

#[test]
fn every_structure_has_a_line_and_a_place_in_the_verdict() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = session(folder.path());
    let output = OSP.run(["race", &file, "--index", "osp,octree-rebuild,brute-simd"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "", "there is no terminal");
    let said = stdout(&output);
    let verdict = said.lines().next().expect("a verdict");
    assert!(verdict.starts_with(&format!("On {NAME} (")) && verdict.ends_with('.'), "{verdict}");
    assert!(verdict.contains(" polygons, ") && verdict.contains(" frames) osp "), "{verdict}");
    for name in ["osp", "octree-rebuild", "brute-simd"] {
        assert!(verdict.contains(&format!("{name} ")), "{name}: {verdict}");
        let line = said.lines().find(|line| line.trim_start().starts_with(&format!("{name} ")));
        // The frames' times, what was missed, the memory.
        assert!(line.is_some_and(|line| line.split_whitespace().count() >= 6), "{name}: {said}");
    }
    assert!(said.contains("One thread, thus one core, runs all structures in turns"), "{said}");
}

#[test]
fn csv_and_json_have_the_figures_of_the_table() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = session(folder.path());
    let csv = folder.path().join("race.csv").to_str().expect("utf-8").to_owned();
    let report = Report::of(&OSP.run(["race", &file, "--json", "--csv", &csv]));
    assert_eq!(report.names(PART, "index"), ["osp", "octree-rebuild"]);
    let of = |index: &str, figure: &str| report.value(PART, NAME, index, figure);
    let replayed = OSP.json(["replay", &file, "--index", "osp", "--json"]);
    for figure in ["frames", "polygons"] {
        assert_eq!(Some(of("", figure)), replayed[figure].as_f64(), "{figure}");
    }
    for name in ["osp", "octree-rebuild"] {
        let [p50, p99, max] = ["frame_p50", "frame_p99", "frame_max"].map(|figure| of(name, figure));
        assert!(0.0 < p50 && p50 <= p99 && p99 <= max, "{name}: {p50} {p99} {max}");
        assert_eq!(of(name, "missed") > 0.0, max * 1000.0 >= 11_111_112.0, "{name}: {max}");
        assert_eq!(of(name, "missed") > 0.0, report.maybe(PART, NAME, name, "first_missed_at").is_some());
        assert!(of(name, "memory") > 0.0, "{name}");
    }
    assert!(report.0["verdict"].as_str().is_some_and(|said| said.contains("octree-rebuild")));
    assert_eq!(Lines::read(&csv).rows.len(), report.rows().len());
}
