//! The page of `osp bench`: what it says is what was measured.

use std::{fs, sync::OnceLock};

use serde_json::Value;

use super::{Report, session};
use crate::OSP;

struct Made {
    page: String,
    report: Report,
}

const KINDS: [&str; 6] = ["osp", "time-order", "octree-rebuild", "bvh-sah", "osp-paper", "brute-simd"];

/// One run of the program for all tests, of two sessions with names that are commands to a page.
fn made() -> &'static Made {
    static MADE: OnceLock<Made> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
        let first = session(folder.path());
        let second = path("<script>alert('1')<!-- \u{202e}.ron");
        fs::copy(&first, &second).expect("a copy");
        let (html, kinds) = (path("bench.html"), KINDS.join(","));
        let files =
            ["bench", &first, &second, "--quick", "--sizes", "200,600", "--pace", "samples:8", "--json"];
        let output = OSP.run([&files[..], &["--index", &kinds, "--html", &html]].concat());
        let report = Report::of(&output);
        Made { page: fs::read_to_string(html).expect("the page"), report }
    })
}

/// What stands between two strings, everywhere.
fn between<'a>(text: &'a str, start: &'a str, end: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(start).skip(1).filter_map(move |part| part.split_once(end).map(|(inside, _)| inside))
}

fn chart_data(page: &str) -> Value {
    let json = between(page, "id=\"chart-data\">", "</script>").next().expect("the data of the charts");
    serde_json::from_str(json).expect("JSON")
}

fn number(cell: &str) -> Option<f64> {
    cell.split_whitespace().next()?.replace(',', "").parse().ok()
}

#[test]
fn the_verdict_is_that_of_the_rows() {
    let Made { page, report } = made();
    let verdict = between(page, "<section id=\"verdict\">", "</section>").next().expect("a verdict");
    let at = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
    let order =
        ["<section id=\"verdict\">", "<figure ", "Insertion: ", "<nav id=\"contents\"", "<table"].map(at);
    assert!(order.is_sorted(), "the verdict, the first chart, the rest: {order:?}");
    let sentence = between(verdict, "On your 2 sketches ", ".</p>").next().expect("a sentence");
    let recordings = report.names("session", "recording");
    let mean = |kind: &str, of: &str| {
        let ratio = |recording: &&str| {
            let row = report.row("session", recording, kind, "ratio").expect("a ratio");
            row[of].as_f64().expect("a number").ln()
        };
        (recordings.iter().map(ratio).sum::<f64>() / 2.0).exp()
    };
    let mut expected: Vec<(&str, f64)> = KINDS.iter().map(|kind| (*kind, mean(kind, "value"))).collect();
    expected.sort_by(|a, b| a.1.total_cmp(&b.1));
    let high = mean(expected[0].0, "high");
    let is_level = |(kind, _): &(&str, f64)| mean(kind, "low") <= high;
    let (level, others) = expected.iter().copied().partition::<Vec<_>, _>(is_level);
    assert!(sentence.contains(level[0].0), "{sentence}: {expected:?}");
    assert_eq!(sentence.contains("(level: intervals overlap)"), level.len() > 1, "{sentence}: {expected:?}");
    let (next, exact) = others[0];
    let said = sentence.split_once(&format!("; the next ({next}) takes ")).map(|(_, times)| number(times));
    let least = level.iter().find(|(kind, _)| *kind == "osp").map_or(level[0].1, |osp| osp.1);
    assert!(
        said.flatten().is_some_and(|times| (times / (exact / least) - 1.0).abs() < 0.06),
        "{sentence}: {expected:?}"
    );
    assert!(sentence.contains("an octree rebuilt in every frame "), "{sentence}");
    for (name, unit) in [("Insertion", "ns/polygon"), ("Query", "µs"), ("Memory", "bytes/polygon")] {
        let start = format!("<p>{name}: ");
        let line = between(page, &start, "</p>").next().expect("a line");
        assert!(line.contains("least") && line.contains("osp") && line.contains(unit), "{line}");
    }
    assert_eq!(
        verdict.matches("NOT optimised").count(),
        usize::from(report.0["machine"]["optimized"] == false)
    );
}

#[test]
fn charts_have_the_figures_of_the_rows_and_every_structure() {
    let Made { page, report } = made();
    let data = chart_data(page);
    let mut compared = 0;
    for chart in data["charts"].as_array().expect("charts") {
        let figure = page.split_once(&format!("<figure id=\"{}\">", chart["id"].as_str().expect("an id")));
        let title =
            between(figure.expect("a figure for the data").1, "<span>", "</span>").next().expect("a title");
        let lines = chart["lines"].as_array().expect("lines");
        let Some((task, figure)) = title.split_once(": ").filter(|(task, _)| task.starts_with("growth/"))
        else {
            continue;
        };
        let mut names: Vec<&str> = lines.iter().filter_map(|line| line["name"].as_str()).collect();
        assert_eq!(names[0], "osp", "the reference comes first: {title}");
        names.sort_unstable();
        let mut kinds = KINDS;
        kinds.sort_unstable();
        assert_eq!(names, kinds, "{title}");
        for line in lines {
            assert_eq!(line["x"], serde_json::json!([200.0, 600.0]), "{title}");
            for (size, y) in [200, 600].into_iter().zip(line["y"].as_array().expect("values")) {
                let name = line["name"].as_str().expect("a name");
                let exact = report.value(task, &format!("scribble-{size}"), name, figure);
                let drawn = y.as_f64().expect("a number");
                assert!((drawn - exact).abs() <= 1.0e-4 * exact, "{title}, {name}: {drawn} {exact}");
                compared += 1;
            }
        }
    }
    // Times of three tasks, boxes of two, and memory.
    assert_eq!(compared, 6 * KINDS.len() * 2);
    assert_eq!(page.matches("<figure id=").count(), data["charts"].as_array().map_or(0, Vec::len));
}

#[test]
fn names_of_files_are_text() {
    let page = &made().page;
    assert!(page.contains("&lt;script&gt;alert(&#39;1&#39;)&lt;!-- \\u202e.ron"), "the name is text");
    assert!(!page.contains("<script>alert") && !page.contains("<!--") && !page.contains('\u{202e}'));
    // The data of the charts, the library and our own script.
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script>").count(), 3);
}
