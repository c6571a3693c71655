//! The report as one HTML page without external files.

mod charts;

use std::fmt::Write;

use self::charts::Charts;
use super::BenchReport;
use crate::{
    report::{css_variables, one_line, push_html},
    rows::{Cells, Part, Summary, Table, is_of},
};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("uplot/LICENSE");

/// The report as one HTML page, which needs no other file. It has the verdict, the first chart, a table of contents,
/// and a chapter for each part. A click on a table's head sorts the table. A chart shows values under the pointer, and
/// its curves can be hidden. Without scripts the tables are sorted best first, and there are no charts.
pub fn page(report: &BenchReport) -> String {
    let mut chapters = Html::default();
    let mut charts = Charts::default();
    let tables = report.rows.tables();
    for part in &report.rows.parts {
        let of: Vec<&Table<'_>> = tables.iter().filter(|table| is_of(table.part, part.part)).collect();
        chapter(&mut chapters, &mut charts, report, part, &of);
    }
    method_chapter(&mut chapters, report);

    let [light, dark] = css_variables();
    let title = title(&tables);
    let mut page = Html::default();
    page.raw("<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">");
    page.raw("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>");
    page.text(&title);
    page.raw("</title><style>");
    page.raw(UPLOT_STYLE);
    // The rule for print comes after the dark theme, because paper is always white.
    page.raw(&format!(
        ":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}@media print{{:root{{{light}}}}}"
    ));
    page.raw(STYLE);
    page.raw("</style></head><body><header>");
    page.heading(1, "top", &title);
    page.raw("</header><section id=\"verdict\">");
    page.heading(2, "the-verdict", "Verdict");
    let verdict = report.verdict(usize::MAX);
    if verdict.is_empty() {
        page.paragraph("There is nothing to compare: one structure was measured, or none.");
    }
    for (at, line) in verdict.iter().enumerate() {
        page.element(if at == 0 { "<p class=\"first\">" } else { "<p>" }, line, "</p>");
    }
    page.raw("</section>");
    page.raw(&chapters.first_figure);
    report.details().iter().for_each(|line| page.paragraph(line));
    page.raw("<nav id=\"contents\" aria-label=\"Contents\">");
    page.heading(2, "the-contents", "Contents");
    page.contents(&chapters.entries);
    page.raw("</nav><main>");
    page.raw(&chapters.html);
    page.raw("</main>");
    if !charts.is_empty() {
        page.raw("<script type=\"application/json\" id=\"chart-data\">");
        page.raw(&charts.to_json());
        page.raw("</script><script>/*\n");
        page.raw(UPLOT_LICENSE);
        page.raw("*/\n");
        page.raw(UPLOT);
        page.raw("</script>");
    }
    page.raw("<script>");
    page.raw(SCRIPT);
    page.raw("</script></body></html>\n");
    page.html
}

fn title(tables: &[Table<'_>]) -> String {
    let mut sessions = tables.iter().filter(|table| is_of(table.part, "session"));
    match (sessions.next(), sessions.count()) {
        (None, _) => "osp bench".to_owned(),
        (Some(session), 0) => format!("osp bench: {}", one_line(session.recording)),
        (Some(_), more) => format!("osp bench: {} sessions", more + 1),
    }
}

fn chapter(page: &mut Html, charts: &mut Charts, report: &BenchReport, part: &Part, tables: &[&Table<'_>]) {
    page.chapter(part.title);
    part.notes.iter().for_each(|note| page.paragraph(note));
    if let Some(summary) = Summary::of(tables).filter(|_| tables.len() > 1) {
        page.paragraph(&format!(
            "In short: geometric means over {} recordings; ratios to {}; median and p99 belong to the first column of ratios.",
            summary.recordings, report.reference
        ));
        page.table(part.title, &summary.cells);
    }
    for table in tables {
        let title = format!("{}, {}", table.part, one_line(table.recording));
        page.subheading(&title);
        page.paragraph(&table.about());
        page.table(&title, &table.cells());
    }
    for (title, chart) in charts::of(report, part.part, tables) {
        let id = page.figure(&title, &chart);
        charts.add(id, chart);
    }
    page.raw("</details>");
}

fn method_chapter(page: &mut Html, report: &BenchReport) {
    page.chapter("How it was measured");
    page.paragraph(&report.machine.text());
    page.element("<p>Made by <code>", &report.command, "</code></p>");
    page.paragraph(&format!(
        "All structures were measured in turns within one process. Intervals contain the median in 95 of 100 cases. A ratio \
         divides the time of a frame or query by that of {}; above 1 the structure is slower. The tables have the median of these \
         ratios. Time and reference are medians of the same frames or queries.",
        report.reference
    ));
    page.paragraph(
        "The verdict compares geometric means over the recordings; structures are level if the means of their intervals overlap.",
    );
    page.paragraph(&format!(
        "The clock has steps of {} ns. Repeatable work shorter than {} steps is measured over so many runs at once that the error of \
         the clock is about 2 %. A frame that inserts cannot be repeated.",
        report.machine.clock_resolution_ns,
        crate::clock::RESOLUTIONS
    ));
    page.raw("</details>");
}

/// An entry of the table of contents: a chapter, and its charts.
struct Entry {
    id: String,
    title: String,
    charts: Vec<(String, String)>,
}

/// HTML, and the data for the table of contents.
#[derive(Default)]
struct Html {
    html: String,
    entries: Vec<Entry>,
    /// The first chart, which stands before all chapters.
    first_figure: String,
    ids: usize,
}

impl Html {
    fn raw(&mut self, html: &str) {
        self.html.push_str(html);
    }

    /// Text; special characters are escaped.
    fn text(&mut self, text: &str) {
        push_html(&mut self.html, text);
    }

    fn element(&mut self, open: &str, text: &str, close: &str) {
        self.raw(open);
        self.text(text);
        self.raw(close);
    }

    fn paragraph(&mut self, text: &str) {
        self.element("<p>", text, "</p>");
    }

    /// A heading with a link to itself.
    fn heading(&mut self, level: u8, id: &str, title: &str) {
        // Writing to a string never fails.
        let _ = write!(self.html, "<h{level} id=\"{id}\">");
        self.text(title);
        self.link_to_self(id);
        let _ = write!(self.html, "</h{level}>");
    }

    fn link_to_self(&mut self, id: &str) {
        let _ = write!(self.html, "<a class=\"self\" href=\"#{id}\" aria-label=\"Link to this place\">#</a>");
    }

    /// A heading within a chapter, which is not in the table of contents.
    fn subheading(&mut self, title: &str) {
        let id = self.id(title);
        self.heading(3, &id, title);
    }

    fn chapter(&mut self, title: &str) {
        let id = self.id(title);
        self.raw("<details class=\"chapter\" open><summary>");
        self.heading(2, &id, title);
        self.raw("</summary>");
        self.entries.push(Entry { id, title: title.to_owned(), charts: Vec::new() });
    }

    /// A unique id: the title's letters, and a running number.
    fn id(&mut self, title: &str) -> String {
        let mut id = String::new();
        for c in title.chars().take(48) {
            match c.is_ascii_alphanumeric() {
                true => id.push(c.to_ascii_lowercase()),
                false if !id.is_empty() && !id.ends_with('-') => id.push('-'),
                false => {}
            }
        }
        self.ids += 1;
        format!("{}-{}", id.trim_end_matches('-'), self.ids)
    }

    fn table(&mut self, about: &str, cells: &Cells) {
        if cells.rows.is_empty() {
            return;
        }
        self.element("<div class=\"table\" role=\"region\" tabindex=\"0\" aria-label=\"", about, "\">");
        let is_sorted = cells.sorted_by.is_some();
        self.raw(if is_sorted { "<table class=\"best\"><thead><tr>" } else { "<table><thead><tr>" });
        for (at, head) in cells.head.iter().enumerate() {
            let most = if head.ends_with("/s") { " data-most" } else { "" };
            let sort = if cells.sorted_by == Some(at) { " aria-sort=\"ascending\"" } else { "" };
            self.element(&format!("<th scope=\"col\"{most}{sort}>"), head, "</th>");
        }
        self.raw("</tr></thead><tbody>");
        for row in &cells.rows {
            self.raw("<tr>");
            row.iter().for_each(|cell| self.element("<td>", cell, "</td>"));
            self.raw("</tr>");
        }
        self.raw("</tbody></table></div>");
    }

    /// Appends the element in which the script draws a chart. Stores the element of the first chart separately. Returns
    /// the id.
    fn figure(&mut self, title: &str, chart: &charts::Chart) -> String {
        let id = self.id(title);
        let start = self.html.len();
        let _ = write!(self.html, "<figure id=\"{id}\">");
        self.element("<figcaption><span>", title, "</span>");
        self.link_to_self(&id);
        self.raw("</figcaption><ul class=\"legend\">");
        for line in &chart.lines {
            let dashed = if line.dash.is_some() { " dashed" } else { "" };
            let (color, mark) = (line.color, line.mark);
            let _ = write!(
                self.html,
                "<li><span class=\"sample{dashed}\" style=\"--c:var({color})\" aria-hidden=\"true\">{mark}</span>"
            );
            self.element("", &line.name, "</li>");
        }
        self.raw("</ul></figure>");
        if self.first_figure.is_empty() {
            self.first_figure = self.html.split_off(start);
        }
        if let Some(entry) = self.entries.last_mut() {
            entry.charts.push((id.clone(), title.to_owned()));
        }
        id
    }

    /// Links to the chapters and their charts.
    fn contents(&mut self, entries: &[Entry]) {
        self.raw("<ul>");
        for Entry { id, title, charts } in entries {
            self.link(id, title);
            if !charts.is_empty() {
                self.raw("<ul>");
                for (id, title) in charts {
                    self.link(id, title);
                    self.raw("</li>");
                }
                self.raw("</ul>");
            }
            self.raw("</li>");
        }
        self.raw("</ul>");
    }

    fn link(&mut self, id: &str, title: &str) {
        let _ = write!(self.html, "<li><a href=\"#{id}\">");
        self.element("", title, "</a>");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_of_plain_letters_and_none_comes_twice() {
        let mut html = Html::default();
        html.subheading("a <b> & \"c\".ron");
        html.subheading("a <b> & \"c\".ron");
        let text = html.html;
        assert!(
            text.contains("<h3 id=\"a-b-c-ron-1\">") && text.contains("<h3 id=\"a-b-c-ron-2\">"),
            "{text}"
        );
    }
}
