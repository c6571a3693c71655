use std::error::Error;

use super::{Compared, Disagreements, SessionOutcome};
use crate::report::{LineStyle, Scatter, push_html, short, thousands};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1240px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-size:13px;margin:1em 0;display:block;overflow-x:auto}\
th,td{padding:.2em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}td.text{text-align:left}\
figure{margin:2em 0}figcaption{font-weight:600}svg{max-width:100%;height:auto}";
/// Rows of a table at most: a browser shows no more without stuttering.
const MOST_ROWS: usize = 5000;
/// The index that the others are compared with, where it was measured without occlusion culling.
const REFERENCE: &str = "osp";

/// The results of a study as one HTML page that needs no other file: a verdict, charts (SVG) of the figures against the size
/// of the session, and a row for each session. `source` names where the results come from.
///
/// # Errors
/// A chart cannot be drawn.
pub fn study_page(
    compared: &Compared,
    disagreements: &Disagreements,
    source: &str,
) -> Result<String, Box<dyn Error>> {
    let mut page = Page(String::new());
    page.raw("<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>osp study</title><style>");
    page.raw(STYLE);
    page.raw("</style><h1>osp study</h1>");
    page.element("<p>Made from ", source, "</p>");
    page.raw("<h2>Verdict</h2>");
    for line in verdict(compared, disagreements) {
        page.element("<p>", &line, "</p>");
    }
    let names = compared.names();
    for (title, chart) in charts(compared, &names) {
        if !chart.is_empty() {
            page.element("<figure><figcaption>", title, "</figcaption>");
            page.raw(&chart.svg()?);
            page.raw("</figure>");
        }
    }
    page.raw("<h2>Sessions</h2>");
    sessions(&mut page, compared, &names);
    errors(&mut page, compared);
    page.raw("</html>\n");
    Ok(page.0)
}

/// What the results say, in sentences.
fn verdict(compared: &Compared, disagreements: &Disagreements) -> Vec<String> {
    let mut lines = Vec::new();
    let (rivals, wins) = compared.wins();
    let measured = compared.sessions().filter(|session| session.best.is_some()).count();
    let all = compared.sessions().count();
    let unread = compared.sessions().filter(|session| session.error.is_some()).count();
    lines.push(format!(
        "{} results of sessions: {} with figures, {} that could not be read.",
        thousands(all as u64),
        thousands(measured as u64),
        thousands(unread as u64)
    ));
    if let Some((best, n)) = wins.first() {
        let others = wins[1..].iter().map(|(name, n)| format!(", {name} in {}", thousands(*n as u64)));
        let others: String = others.collect();
        lines.push(format!(
            "{best} took the least time (median of a frame) in {} of {}{others}.",
            thousands(*n as u64),
            thousands(rivals as u64)
        ));
    }
    let names = compared.names();
    let reference = names.iter().find(|name| *name == REFERENCE).or(names.first());
    for other in names.iter().filter(|name| Some(*name) != reference) {
        let Some(reference) = reference else { continue };
        if let Some([least, median, most]) = compared.ratio(reference, other) {
            lines.push(format!(
                "{other} took {} times as long as {reference} in the median session ({} to {}).",
                short(median),
                short(least),
                short(most)
            ));
        }
    }
    let (rows, _) = disagreements.counts();
    let found: Vec<String> = disagreements.found().map(|found| found.text()).collect();
    if found.is_empty() && rows == 0 {
        lines.push(
            "Nothing could be compared: no session was measured by two indexes, machines or builds."
                .to_owned(),
        );
    } else if found.is_empty() {
        let rows = thousands(rows);
        lines.push(format!("All machines and indexes saw the same polygons ({rows} results compared)."));
    } else {
        lines.push(format!(
            "{} SESSIONS LOOK DIFFERENT ON DIFFERENT MACHINES, BUILDS OR INDEXES:",
            thousands(found.len() as u64)
        ));
        lines.extend(found);
    }
    lines
}

fn charts(compared: &Compared, names: &[String]) -> [(&'static str, Scatter); 3] {
    let chart = |axes, figure: fn(&SessionOutcome, &(String, [f64; 2], u64)) -> f64| {
        let points = |name: &String| {
            let runs = compared.sessions().filter_map(|session| {
                let run = session.runs.iter().find(|(other, ..)| other == name)?;
                Some((session.polygons as f64, figure(session, run)))
            });
            (name.clone(), look(name, names), runs.collect())
        };
        Scatter { axes, lines: names.iter().map(points).collect() }
    };
    [
        (
            "A frame against the size of the session: a dot a session, a line through their medians",
            chart(["polygons of the session", "median of a frame, µs"], |_, (_, [p50, _], _)| *p50),
        ),
        (
            "Slow frames",
            chart(["polygons of the session", "99th percentile of a frame, µs"], |_, (_, [_, p99], _)| *p99),
        ),
        (
            "Memory",
            chart(["polygons of the session", "bytes a polygon"], |session, (.., bytes)| {
                *bytes as f64 / session.polygons.max(1) as f64
            }),
        ),
    ]
}

/// How the line of a structure looks, or that of its method of occlusion culling.
fn look(name: &str, names: &[String]) -> LineStyle {
    let Some((index, method)) = name.split_once(" + ") else { return LineStyle::of_structure(name) };
    let mut indexes: Vec<&str> = names.iter().filter_map(|name| Some(name.split_once(" + ")?.0)).collect();
    indexes.dedup();
    let number = indexes.iter().position(|other| *other == index).unwrap_or(0);
    LineStyle::of_method(index, number, method)
}

fn sessions(page: &mut Page, compared: &Compared, names: &[String]) {
    let mut sessions: Vec<_> = compared.sessions().filter(|session| session.error.is_none()).collect();
    if sessions.len() > MOST_ROWS {
        sessions.sort_by_key(|session| std::cmp::Reverse(session.polygons));
        page.element("<p>", &format!("The {} largest sessions:", thousands(MOST_ROWS as u64)), "</p>");
        sessions.truncate(MOST_ROWS);
    }
    page.raw("<table><tr>");
    let heads = ["session", "machine", "polygons", "frames", "least time"].map(str::to_owned);
    let of_runs = names.iter().flat_map(|name| [format!("{name} p50 µs"), "p99 µs".to_owned()]);
    for head in heads.into_iter().chain(of_runs).chain(["indexes agree".to_owned()]) {
        page.element("<th>", &head, "</th>");
    }
    page.raw("</tr>");
    for session in sessions {
        page.raw("<tr>");
        let cells = [
            session.file.clone(),
            session.host.clone(),
            thousands(session.polygons),
            thousands(session.frames),
            session.best.clone().unwrap_or_default(),
        ];
        let of_runs = names.iter().flat_map(|name| {
            let run = session.runs.iter().find(|(other, ..)| other == name);
            run.map_or([String::new(), String::new()], |(_, times, _)| times.map(short))
        });
        let agree = if session.indexes_agree { "yes" } else { "NO" }.to_owned();
        for cell in cells.into_iter().chain(of_runs).chain([agree]) {
            page.element("<td>", &cell, "</td>");
        }
        page.raw("</tr>");
    }
    page.raw("</table>");
}

fn errors(page: &mut Page, compared: &Compared) {
    let failed: Vec<_> = compared.sessions().filter(|session| session.error.is_some()).collect();
    if failed.is_empty() {
        return;
    }
    page.raw("<h2>Sessions that could not be read</h2><table><tr><th>session</th><th>machine</th><th>error</th></tr>");
    for session in failed.into_iter().take(MOST_ROWS) {
        page.element("<tr><td>", &session.file, "</td>");
        page.element("<td>", &session.host, "</td>");
        page.element("<td class=\"text\">", session.error.as_deref().unwrap_or_default(), "</td></tr>");
    }
    page.raw("</table>");
}

struct Page(String);

impl Page {
    fn raw(&mut self, html: &str) {
        self.0.push_str(html);
    }

    /// Text, whatever is in it, between two pieces of HTML.
    fn element(&mut self, open: &str, text: &str, close: &str) {
        self.raw(open);
        push_html(&mut self.0, text);
        self.raw(close);
    }
}
