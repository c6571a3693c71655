use std::{error::Error, fmt::Write};

use super::{
    BenchReport,
    charts::{Chart, charts},
    moving,
    paper::{charts as paper_charts, notes, tables},
    rays::show,
    table::{Grid, flight_grid, growth_grid, session_grid},
};
use crate::lab::report::{printable, short, thousands};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1240px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-size:13px;margin:1em 0;display:block;overflow-x:auto}\
th,td{padding:.2em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}\
figure{margin:2em 0}figcaption{font-weight:600}svg{max-width:100%;height:auto}\
.legend span{margin-right:1.2em;white-space:nowrap}.legend i{display:inline-block;width:2em;height:.2em;margin-right:.4em;vertical-align:middle}\
.legend b{display:block;font:16px/.2em sans-serif;text-align:center}\
code{background:#f4f4f4;padding:.1em .3em}p.remark{margin:.2em 0;color:#444}";

/// The report as one HTML page that needs no other file: tables, charts (SVG), and beside each chart what the paper
/// found and what is found here.
///
/// # Errors
/// A chart cannot be drawn.
pub fn page(report: &BenchReport) -> Result<String, Box<dyn Error>> {
    let mut page = Page(String::new());
    page.raw("<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>osp bench</title><style>");
    page.raw(STYLE);
    page.raw("</style><h1>osp bench</h1>");
    page.paragraph(&report.machine.text());
    page.raw("<p>Made by <code>");
    page.text(&report.command);
    page.raw("</code></p>");
    // The paper's chapter says itself what its frames are.
    if !report.sessions.is_empty() || !report.growth.is_empty() {
        page.paragraph(&format!(
        "All structures were measured in turns within one process, frame by frame. Intervals hold the median in 95 of \
         100 cases. Ratios compare a frame with the same frame of {}; above 1 the structure is slower. A frame is insertion \
         and culling: nothing is drawn.",
        report.reference
    ));
    }
    for session in &report.sessions {
        page.heading(&format!(
            "{}: {} polygons, {} frames ({}, camera {})",
            session.recording,
            thousands(session.polygons),
            thousands(session.frames),
            session.pace,
            session.camera
        ));
        page.paragraph(if session.indexes_agree {
            "All indexes saw the same polygons in every frame that they were measured on."
        } else {
            "NOT ALL INDEXES SAW THE SAME POLYGONS: the figures compare different work."
        });
        page.table(&session_grid(session));
    }
    if !report.growth.is_empty() {
        page.heading("Growth: a synthetic session of loose strokes in a 4 m cube");
        page.table(&growth_grid(&report.growth));
        for skipped in &report.skipped {
            page.paragraph(&format!(
                "{} was left out at {} polygons: filling it and drawing three frames takes about {} s.",
                skipped.index,
                thousands(u64::from(skipped.polygons)),
                short(skipped.expected_secs)
            ));
        }
    }
    if !report.flights.is_empty() {
        page.heading("Flight through the finished models");
        page.table(&flight_grid(&report.flights));
    }
    for result in &report.rays {
        page.heading(&show::heading(result));
        page.paragraph(&show::legend(&report.reference));
        page.table(&show::times(result));
        page.paragraph(show::WALKS);
        page.table(&show::walks(result));
        if !result.moved.is_empty() {
            page.paragraph(show::MOVED);
            page.table(&show::moved(result));
        }
        for remark in show::remarks(result, &report.reference) {
            page.paragraph(&remark);
        }
    }
    for result in &report.moving {
        page.heading(&moving::show::heading(result, &report.reference));
        for (about, grid) in moving::show::tables(result) {
            page.paragraph(&about);
            page.table(&grid);
        }
        for remark in moving::show::remarks(result, &report.reference) {
            page.paragraph(&remark);
        }
    }
    let charts = charts(report);
    if !charts.is_empty() {
        page.heading("Charts");
    }
    for chart in charts {
        page.chart(&chart)?;
    }
    for paper in &report.paper {
        page.heading(&format!("The paper, as it is printed: {}", paper.recording));
        notes(paper).iter().for_each(|note| page.paragraph(note));
        for (title, grid) in tables(paper) {
            page.element("<h3>", &title, "</h3>");
            page.table(&grid);
        }
        for chart in paper_charts(paper) {
            page.chart(&chart)?;
        }
    }
    page.raw("</html>\n");
    Ok(page.0)
}

struct Page(String);

impl Page {
    fn raw(&mut self, html: &str) {
        self.0.push_str(html);
    }

    /// Text, whatever is in it.
    fn text(&mut self, text: &str) {
        for c in printable(text).chars() {
            match c {
                '<' => self.raw("&lt;"),
                '>' => self.raw("&gt;"),
                '&' => self.raw("&amp;"),
                '"' => self.raw("&quot;"),
                c => self.0.push(c),
            }
        }
    }

    fn element(&mut self, open: &str, text: &str, close: &str) {
        self.raw(open);
        self.text(text);
        self.raw(close);
    }

    fn heading(&mut self, text: &str) {
        self.element("<h2>", text, "</h2>");
    }

    fn paragraph(&mut self, text: &str) {
        self.element("<p>", text, "</p>");
    }

    fn table(&mut self, grid: &Grid) {
        self.raw("<table><tr>");
        for head in &grid.head {
            self.element("<th>", &head.replace('\n', " "), "</th>");
        }
        self.raw("</tr>");
        for row in &grid.rows {
            self.raw("<tr>");
            for cell in row {
                self.element("<td>", cell, "</td>");
            }
            self.raw("</tr>");
        }
        self.raw("</table>");
    }

    fn chart(&mut self, chart: &Chart) -> Result<(), Box<dyn Error>> {
        self.element("<figure><figcaption>", &chart.title, "</figcaption><p class=\"legend\">");
        for (name, style) in chart.legend() {
            let (color, mark) = (style.css_color(), style.mark_character());
            // Writing to a string does not fail.
            let _ = write!(
                self.0,
                "<span><i style=\"background:{color}\"><b style=\"color:{color}\">{mark}</b></i>"
            );
            self.element("", name, "</span>");
        }
        self.raw("</p>");
        self.raw(&chart.svg()?);
        for remark in &chart.remarks {
            self.element("<p class=\"remark\">", remark, "</p>");
        }
        self.raw("</figure>");
        Ok(())
    }
}
