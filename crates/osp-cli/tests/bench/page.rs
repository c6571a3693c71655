//! The page of `osp bench`: what it says is what was measured.

use std::{collections::BTreeMap, fs, sync::OnceLock};

use serde_json::Value;

use crate::{osp, session, text};

struct Made {
    page: String,
    csv: String,
    report: Value,
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
        let (html, csv, kinds) = (path("bench.html"), path("bench.csv"), KINDS.join(","));
        let files =
            ["bench", &first, &second, "--quick", "--sizes", "200,600", "--pace", "samples:8", "--json"];
        let output = osp(&[&files[..], &["--index", &kinds, "--html", &html, "--csv", &csv]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        Made {
            page: fs::read_to_string(html).expect("the page"),
            csv: fs::read_to_string(csv).expect("the figures"),
            report: serde_json::from_slice(&output.stdout).expect("one JSON object"),
        }
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

/// The figures of the CSV by part, name, index, polygons and figure.
fn figures(csv: &str) -> BTreeMap<(String, String, String, String, String), f64> {
    let line = |line: &str| {
        // The name alone may have a quote or a comma.
        let (part, rest) = line.split_once(',')?;
        let mut columns: Vec<&str> = rest.rsplitn(9, ',').collect();
        columns.reverse();
        let [name, index, polygons, _, figure, _, value, ..] = columns[..] else { return None };
        let key = [part, name.trim_matches('"'), index, polygons, figure].map(str::to_owned);
        let [part, name, index, polygons, figure] = key;
        Some(((part, name, index, polygons, figure), value.parse().ok()?))
    };
    csv.lines().skip(1).filter_map(line).collect()
}

#[test]
fn the_verdict_is_that_of_the_rows() {
    let Made { page, csv, report } = made();
    let verdict = between(page, "<section id=\"verdict\">", "</section>").next().expect("a verdict");
    assert!(page.find("<section id=\"verdict\">") < page.find("<table"), "it comes first");
    let lines: Vec<&str> = between(verdict, "For your sketch ", ".</p>").collect();
    assert_eq!(lines.len(), 2, "{verdict}");
    let figures = figures(csv);
    for (line, session) in lines.iter().zip(report["sessions"].as_array().expect("sessions")) {
        let name = session["recording"].as_str().expect("a name").replace('"', "\"\"");
        let polygons = session["polygons"].to_string();
        let of = |index: &str, figure: &str| {
            let key = ["session", &name, index, &polygons, figure].map(str::to_owned);
            let [part, name, index, polygons, figure] = key;
            figures[&(part, name, index, polygons, figure)]
        };
        let (_, said) = line.rsplit_once(".ron: ").expect("after the name");
        let (fastest, others) = said.split_once("; ").expect("others");
        for kind in KINDS {
            assert!(of(fastest, "frame_ratio") <= of(kind, "frame_ratio"), "{kind}: {line}");
        }
        let mut expected: Vec<(&str, f64)> = KINDS
            .iter()
            .filter(|kind| **kind != fastest)
            .map(|kind| (*kind, of(kind, "frame_against_fastest")))
            .collect();
        expected.sort_by(|a, b| a.1.total_cmp(&b.1));
        let named: Vec<&str> = others.split(", ").collect();
        assert!(named.iter().any(|words| words.starts_with("octree-rebuild")), "{line}");
        for (at, words) in named.iter().enumerate() {
            let (index, rest) = words.split_once(' ').expect("a name");
            let times = number(rest.trim_start_matches("takes ")).expect("a number");
            let (_, exact) = expected.iter().find(|(name, _)| *name == index).expect("it was measured");
            assert!((times / exact - 1.0).abs() < 0.06, "{words}: {exact}");
            assert!(at >= 2 || expected[at].0 == index, "the nearest come first: {line}");
        }
        assert!((1.0 - of(fastest, "frame_against_fastest")).abs() < 1.0e-9);
    }
    assert!(verdict.contains("Over all 2 sessions: "), "{verdict}");
    assert_eq!(
        between(verdict, "A synthetic model that grows, ", " polygons").collect::<Vec<_>>(),
        ["200", "600"]
    );
    assert_eq!(
        verdict.matches("NOT optimised").count(),
        usize::from(report["machine"]["optimized"] == false)
    );
}

#[test]
fn links_lead_to_headings_and_charts_and_nothing_comes_from_elsewhere() {
    let page = &made().page;
    let ids: Vec<&str> = between(page, " id=\"", "\"").collect();
    let unique: std::collections::BTreeSet<_> = ids.iter().collect();
    assert_eq!(unique.len(), ids.len(), "{ids:?}");
    let links: Vec<&str> = between(page, " href=\"", "\"").collect();
    for link in &links {
        assert!(link.strip_prefix('#').is_some_and(|id| ids.contains(&id)), "{link}");
    }
    let contents = between(page, "<nav id=\"contents\"", "</nav>").next().expect("contents");
    for id in between(page, "<figure id=\"", "\"").chain(between(page, "<h2 id=\"", "\"")) {
        let is_above = id == "the-verdict" || id == "the-contents";
        assert!(is_above || contents.contains(&format!("href=\"#{id}\"")), "{id} is not in the contents");
    }
    let headings =
        page.matches("<h1 id=").count() + page.matches("<h2 id=").count() + page.matches("<h3 id=").count();
    let figures = page.matches("<figure id=").count();
    assert_eq!(page.matches("class=\"self\"").count(), headings + figures, "each has a link to itself");
    for command in ["<link", "<img", "<iframe", "@import", "url(", " src=", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(command), "{command}");
    }
}

#[test]
fn tables_are_best_first() {
    let page = &made().page;
    let mut checked = 0;
    for table in between(page, "<table class=\"best\">", "</table>") {
        let heads: Vec<&str> = table.split("<th ").skip(1).collect();
        let sorted: Vec<usize> =
            (0..heads.len()).filter(|&at| heads[at].contains("aria-sort=\"ascending\"")).collect();
        let [column] = sorted[..] else { panic!("one column: {table}") };
        let cells = between(table, "<tr><td>", "</tr>").map(|row| {
            row.split("<td>").nth(column).unwrap_or_default().split('<').next().unwrap_or_default()
        });
        let numbers: Vec<f64> = cells.map(|cell| number(cell).unwrap_or(f64::INFINITY)).collect();
        assert!(numbers.is_sorted() && numbers.len() > 1, "{numbers:?}");
        checked += 1;
    }
    // Two sessions and all of them, two sizes, two tables for each of four models of rays, four for each size that moves.
    assert_eq!(checked, 2 + 1 + 2 + 2 * 4 + 4 * 2);
    assert!(
        page.contains("<th scope=\"col\" data-most>nearest, outside\nMRays/s</th>"),
        "more is better there"
    );
}

#[test]
fn charts_have_the_figures_of_the_csv_and_every_structure() {
    let Made { page, csv, .. } = made();
    let (data, figures) = (chart_data(page), figures(csv));
    let title = |id: &str| {
        let figure = page.split_once(&format!("<figure id=\"{id}\">")).expect("a figure for the data").1;
        between(figure, "<span>", "</span>").next().expect("a title").to_owned()
    };
    let mut compared = 0;
    for chart in data["charts"].as_array().expect("charts") {
        let title = title(chart["id"].as_str().expect("an id"));
        let lines = chart["lines"].as_array().expect("lines");
        let names: Vec<&str> = lines.iter().filter_map(|line| line["name"].as_str()).collect();
        let figure = match &title {
            title if title.starts_with("a frame that inserts and culls: ") => "frame",
            title if title.ends_with("frames a second") => {
                assert_eq!(names.len(), KINDS.len(), "{title}: {names:?}");
                continue;
            }
            title if title.starts_with("a frame that inserts nothing, from inside: ") => "still",
            title if title.starts_with("a frame that inserts nothing, all in view: ") => "still_all",
            title if title.starts_with("memory: ") => "memory",
            _ => continue,
        };
        assert_eq!(names.len(), KINDS.len(), "{title}: {names:?}");
        for line in lines {
            let x = data["xs"][line["x"].as_u64().expect("a place") as usize].as_array().expect("places");
            assert_eq!(x, &[Value::from(200.0), Value::from(600.0)], "{title}");
            for (size, y) in x.iter().zip(line["y"].as_array().expect("values")) {
                let size = size.as_f64().expect("a number").to_string();
                let key = ["growth", "scribble", line["name"].as_str().expect("a name"), &size, figure];
                let [part, name, index, polygons, figure] = key.map(str::to_owned);
                let exact = figures[&(part, name, index, polygons, figure)];
                let drawn = y.as_f64().expect("a number");
                assert!((drawn - exact).abs() <= 1.0e-4 * exact, "{title}, {key:?}: {drawn} {exact}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 4 * 2 * KINDS.len() * 2, "four figures, two groups, two sizes");
    assert_eq!(
        page.matches("<svg").count(),
        data["charts"].as_array().map_or(0, Vec::len),
        "each is a picture, too"
    );
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

#[test]
fn ratios_stand_beside_the_times_that_they_are_of() {
    let Made { page, report, .. } = made();
    for session in report["sessions"].as_array().expect("sessions") {
        for row in session["rows"].as_array().expect("rows") {
            let values = ["frame_us", "reference_us", "ratio"].map(|key| row[key]["values"].as_u64());
            assert!(values[0] > Some(0) && values[0] == values[1] && values[1] == values[2], "{row}");
        }
    }
    for row in report["growth"].as_array().expect("rows") {
        for keys in [
            ["frame_us", "reference_us", "ratio"],
            ["still_us", "still_reference_us", "still_ratio"],
            ["still_all_us", "still_all_reference_us", "still_all_ratio"],
        ] {
            let values = keys.map(|key| row[key]["values"].as_u64());
            assert!(values[0] > Some(0) && values[0] == values[1] && values[1] == values[2], "{row}");
        }
    }
    assert!(page.contains("reference\nµs</th><th scope=\"col\" aria-sort=\"ascending\">ratio\n(95 %)</th>"));
    let resolution_ns = report["machine"]["clock_resolution_ns"].as_u64().expect("a number");
    assert!(page.contains(&format!("The clock tells times {resolution_ns} ns apart.")));
}

#[test]
fn a_page_of_one_session_is_small() {
    // Two small sessions, 6 structures: pictures, data and the library.
    let kib = made().page.len() / 1024;
    assert!(kib < 1024, "{kib} KiB");
}
